"""Runs are named by all that determines them, and taken up where they were made before."""

import logging
from pathlib import Path

import pytest
import small

from fem_reference.foundations.errors import InputError
from fem_reference.scenes import casefile
from fem_reference.scenes.case import SolverChoice
from fem_reference.solvers import recorded
from fem_reference.studies import making
from fem_reference.studies.execution import Bench

pytestmark = pytest.mark.slow


def bench(folder: Path, **changes) -> Bench:
    return Bench(casefile.read(small.write(folder / "bar"), changes=changes or None), folder / "runs")


def key_of(made: Bench) -> str:
    return made.key("fenicsx", made.settings(made.scene.reference, "reference"))


def test_the_key_names_what_determines_a_run(tmp_path) -> None:
    base = key_of(bench(tmp_path))
    assert key_of(bench(tmp_path)) == base
    different = [
        {"effect[0].mu": "11 kPa"},
        {"frames.every": 10},
        {"muscle.tet_size": "5 mm"},
        {"reference.first_step": 4},
    ]
    assert len({base, *(key_of(bench(tmp_path, **changes)) for changes in different)}) == 5
    # What only judges, names or concerns the machine does not: such runs are shared.
    for changes in ({"title": "another"}, {"expect[0].within": "1 %"}, {"candidate[0].damping": 0.5}):
        assert key_of(bench(tmp_path, **changes)) == base
    assert key_of(Bench(bench(tmp_path).scene, tmp_path, ranks=1)) == base


def test_a_copied_case_finds_what_was_solved_before(tmp_path, caplog) -> None:
    caplog.set_level(logging.INFO, logger="fem_reference")
    one = casefile.read(small.write(tmp_path / "bar"))
    other = casefile.read(small.write(tmp_path / "copy"))
    runs = [Bench(scene, tmp_path / "runs").obtain("pbd", scene.candidate[0], "candidate[0]") for scene in (one, other)]
    assert one.name != other.name
    assert runs[0].folder == runs[1].folder
    assert "solved before, taken from" in caplog.text


def test_a_run_made_with_other_packages_is_made_again(tmp_path, monkeypatch, caplog) -> None:
    caplog.set_level(logging.INFO, logger="fem_reference")
    made = bench(tmp_path)
    made.obtain("pbd", made.scene.candidate[0], "candidate[0]")
    now = making.versions()
    monkeypatch.setattr(making, "versions", lambda: now | {"numba": "0"})
    made.obtain("pbd", made.scene.candidate[0], "candidate[0]")
    assert "solved before, but with another version of numba" in caplog.text
    # What is not installed here cannot be compared: stored runs are judged where no solver is.
    monkeypatch.setattr(making, "versions", lambda: {"numpy": now["numpy"]})
    caplog.clear()
    made.obtain("pbd", made.scene.candidate[0], "candidate[0]")
    assert "solved before, taken from" in caplog.text


def test_frames_are_read_before_anything_is_meshed_or_solved(tmp_path, monkeypatch) -> None:
    made = bench(tmp_path)
    monkeypatch.setattr(made, "reference", lambda: pytest.fail("solved before all input was read"))
    monkeypatch.setattr(made, "problem", lambda: pytest.fail("meshed before all input was read"))
    monkeypatch.setattr(made, "_problem", made.problem)
    (tmp_path / "frames").mkdir()
    own = recorded.choice(tmp_path / "frames", "mm", "--candidate")
    with pytest.raises(InputError, match="frames"):
        made.runs([(made.scene.candidate[0], "candidate[0]"), (own, "--candidate")])
    with pytest.raises(InputError, match="frames"):
        made.check([(own, "--candidate")])


def test_an_element_that_does_not_suit_the_effects_is_named(tmp_path) -> None:
    scene = casefile.read_muscle(small.write(tmp_path / "bar"))
    bench = Bench(scene, tmp_path / "runs")
    for element, want in (("Q2/Q1", "P1/P1, P2/P0, P2/P1"), ("P1", "P1/P1, P2/P0, P2/P1")):
        with pytest.raises(
            InputError, match=rf'case.toml: reference.element: got "{element}", want an element for .*: {want}'
        ):
            bench.settings(SolverChoice(solver="fenicsx", element=element), "reference")


def test_a_run_says_which_effects_its_solver_simulated(tmp_path) -> None:
    made = bench(tmp_path)
    reference, pbd = made.scene.reference, made.scene.candidate[0]
    printed = {one.solver: made.origin(one.solver, made.settings(one, "here"))["effects"] for one in (reference, pbd)}
    assert list(printed["fenicsx"]) == ["NeoHooke", "Incompressible"]
    assert printed["pbd"] == "none"
