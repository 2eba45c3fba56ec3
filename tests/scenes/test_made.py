"""Cases made in Python: those of the file that says the same, with mistakes named as in one."""

from dataclasses import replace

import numpy as np
import pytest
import small

import fem_reference as fr
from fem_reference.foundations.mesh import Polylines

FIBRES = Polylines(np.array([[5.0, 5, 1], [5, 5, 39]]), np.array([0, 2]))


def in_python() -> dict[str, object]:
    """The small case as Python tables, numbers in place of text with units."""
    turn = {"axis": [1.0, 0.0, 0.0], "centre": (5.0, 5.0, 30.0)}
    angles = [{"frame": frame, "angle": angle} for frame, angle in ((0, 0.0), (10, 0.4), (20, 0.0))]
    return {
        "title": "A bar",
        "proves": "that no file is needed",
        "muscle": {"surface": "bar.vtp", "unit": "mm", "tet_size": 6.0},
        "bone": [
            {"name": "floor", "surface": "floor.vtp", "unit": "mm"},
            {"name": "lid", "surface": "lid.vtp", "unit": "mm", "motion": turn | {"keyframes": angles}},
        ],
        "attachment": [
            {"name": "origin", "bone": "floor", "within": 1.5},
            {"name": "insertion", "bone": "lid", "within": 1.5},
        ],
        "effect": [fr.make_effect("neo_hooke", mu=0.01), {"name": "incompressible", "bulk": 10.0}],
        "fibres": {"traced": {"count": 4, "start": "origin", "end": "insertion"}},
        "frames": {"first": 0, "last": 20, "every": 10},
        "reference": {"solver": "fenicsx", "first_step": 5},
    }


@pytest.mark.slow
def test_a_case_made_in_python_is_that_of_the_file(tmp_path) -> None:
    read = fr.load_case(small.write(tmp_path / "bar"), {"frames.every": 10})
    case = fr.make_case(in_python(), tmp_path / "bar", name="bar")
    assert case.key == read.key
    assert (case.expect, case.negative_control, case.candidate) == ((), None, ())
    assert "A bar" in case._repr_html_()
    run = fr.solve(case, "pbd", store=tmp_path / "runs", **read.candidate[0].settings)
    assert run.outcome.status == "converged"
    assert fr.solve(read, "pbd", store=tmp_path / "runs").folder == run.folder
    reference = replace(run, name="reference", fibres=FIBRES, fibre_positions=np.zeros((3, 2, 3)))
    result = fr.compare(case, reference, [run])
    assert result["pbd", "surface_deviation", "max"].values.tolist() == [0, 0, 0]
    assert result.word == "not judged"


def test_what_is_wrong_with_a_case_made_in_python_is_named(tmp_path) -> None:
    small.write(tmp_path / "bar")
    table = in_python()
    for key, value, message in (
        ("effect", [{"name": "neo_hooke", "mu": "1 mm"}], r'case\.effect\[0\]\.mu: got "1 mm", want a pressure'),
        ("colour", "red", r"case\.colour: got an unknown key, want one of attachment"),
        ("name", "bar", r"case\.name: got an unknown key"),
        ("frames", {"first": 0, "last": 20, "every": 0}, r"case\.frames\.every: got 0"),
    ):
        with pytest.raises(fr.InputError, match=message):
            fr.make_case(table | {key: value}, tmp_path / "bar")
    lost = fr.make_case(table, tmp_path)
    with pytest.raises(fr.InputError, match=r'case\.muscle\.surface: got "bar.vtp", which is not at'):
        lost.key  # noqa: B018


def test_what_is_no_table_is_no_case() -> None:
    for table in (3, ["title"], {3: "title"}):
        with pytest.raises(fr.InputError, match=r"case: got .*, want keys and tables as in a case\.toml"):
            fr.make_case(table)  # type: ignore[arg-type]
