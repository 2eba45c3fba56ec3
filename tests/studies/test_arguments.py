"""Arguments of the calls from Python: what they do not want is refused by its name before anything is done."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import small

import fem_reference as fr
from fem_reference.assessment.error_bars import ErrorBars
from fem_reference.foundations.mesh import Polylines
from fem_reference.runs.store import Outcome, Run
from fem_reference.studies import arguments

FIBRES = Polylines(np.array([[5.0, 5, 1], [5, 5, 39]]), np.array([0, 2]))


@pytest.mark.slow
def test_what_cannot_be_compared_is_refused_by_name(tmp_path) -> None:
    case = fr.load_case(small.write(tmp_path / "bar"), {"frames.every": 10})
    run = fr.solve(case, "pbd", store=str(tmp_path / "runs"))  # a store may be text
    reference = replace(run, name="reference", fibres=FIBRES, fibre_positions=np.zeros((3, 2, 3)))
    with pytest.raises(fr.InputError, match='candidates: got the name "pbd" twice'):
        fr.compare(case, reference, [run, run])
    other = replace(run, positions=run.positions[:, :5])
    with pytest.raises(fr.InputError, match=r'candidate "pbd": got 5 vertices, want the \d+ vertices of the reference'):
        fr.compare(case, reference, [other])


@pytest.mark.slow
def test_runs_of_another_case_are_refused(tmp_path) -> None:
    folder = small.write(tmp_path / "bar")
    case = fr.load_case(folder, {"frames.every": 10})
    other = fr.load_case(folder, {"frames.every": 10, "bone[1].motion.keyframes[1].angle": "0.3 rad"})
    run = fr.solve(case, "pbd", store=tmp_path / "runs")
    of_other = replace(fr.solve(other, "pbd", store=tmp_path / "runs"), name="other")
    inside = {"name": "reference", "fibres": FIBRES, "fibre_positions": np.zeros((3, 2, 3))}
    reference, strange = replace(run, **inside), replace(of_other, **inside)
    assert fr.compare(case, reference, [run]).word
    with pytest.raises(
        fr.InputError, match=r'candidate "other": got a run of another case \("bar"\), want a run of "bar" with all'
    ):
        fr.compare(case, reference, [of_other])
    with pytest.raises(fr.InputError, match='reference "reference": got a run of another case'):
        fr.compare(case, strange, [run])
    with pytest.raises(fr.InputError, match='reference "reference": got a run of another case'):
        fr.error_bars(case, strange)
    # What somebody else's program wrote says of no case; it is checked when it is read.
    assert fr.compare(case, reference, [replace(of_other, origin={})]).word


@pytest.mark.slow
def test_calls_with_what_they_do_not_want_are_refused(tmp_path) -> None:
    case = fr.load_case(small.write(tmp_path / "bar"), {"frames.every": 10})
    run = fr.solve(case, "pbd", store=tmp_path / "runs")
    (tmp_path / "file").write_text("")
    calls = {
        'settings nonsense: got no solver, want the name of their solver, such as solver="fenicsx"': (
            lambda: fr.solve(case, nonsense=3)
        ),
        "solver: got int 3, want the name of a solver": lambda: fr.solve(case, 3),
        "case: got str 'bar', want a Case": lambda: fr.solve("bar"),
        "progress: got int 3, want a function that takes a line": lambda: fr.solve(case, "pbd", progress=3),
        "store: got int 3, want a path": lambda: fr.solve(case, "pbd", store=3),
        "store: got .*, while .*file is a file, want a folder": lambda: fr.solve(
            case, "pbd", store=tmp_path / "file" / "x"
        ),
        "case: got int 3, want a path": lambda: fr.load_case(3),
        "changes: got list": lambda: fr.load_case("hip_flexion", ["frames.last"]),
        r'motion: got .*, want either "axis" and "centre" \(a rotation\) or "direction"': (
            lambda: fr.load_case(tmp_path / "bar", {"bone[1].motion.axis": None})
        ),
        "changes: got dict": lambda: fr.load_case("hip_flexion", {3: 4}),
        "reference: got NoneType None, want a Run": lambda: fr.compare(case, None),
        "candidates: got Run": lambda: fr.compare(case, run, run),
        "candidate: got int 3": lambda: fr.compare(case, run, [3]),
        "error_bars: got int 3, want ErrorBars": lambda: fr.compare(case, run, [], error_bars=3),
        "form: got 'abaqus', want one of open, febio": lambda: fr.export_case(case, tmp_path / "new", "abaqus"),
        "comparison: got Run": lambda: fr.write_report(run, tmp_path / "new"),
        "comparison: got int 3": lambda: fr.export_runs(3, tmp_path / "new"),
        "body: got Run": lambda: fr.solve_body(run),
        'effect: got "3", want one of': lambda: fr.make_effect(3),
    }
    for message, call in calls.items():
        with pytest.raises(fr.InputError, match=message):
            call()


def test_a_folder_may_be_new_at_any_depth_but_not_below_a_file(tmp_path: Path) -> None:
    assert arguments.free_folder(tmp_path, "store") == tmp_path
    assert arguments.free_folder(str(tmp_path / "a" / "b"), "store") == tmp_path / "a" / "b"
    assert list(tmp_path.iterdir()) == []
    (tmp_path / "file").touch()
    for folder in (tmp_path / "file", tmp_path / "file" / "a" / "b"):
        with pytest.raises(fr.InputError, match=r"^store: got .*, while .*file is a file, want a folder"):
            arguments.free_folder(folder, "store")


def test_what_may_be_left_out_may_be_left_out() -> None:
    arguments.check_changes(None)
    arguments.check_changes({})
    arguments.check_solver(None, {})
    arguments.check_solver("pbd", {"damping": 0.1})
    arguments.check_error_bars(None, fr.load_case("rod"))


def test_error_bars_are_of_the_frames_of_the_case() -> None:
    case = fr.load_case("rod")
    arguments.check_error_bars(bars(case.numbers), case)
    with pytest.raises(fr.InputError, match=r"error_bars: got bars of frames \(0, 5\), want bars of frames \(0,\)"):
        arguments.check_error_bars(bars((0, 5)), case)


def bars(numbers: tuple[int, ...]) -> ErrorBars:
    """No error bars, of the frames ``numbers``."""
    return ErrorBars(numbers, (2.0, 4.0), 2.0, ())


def test_a_run_says_what_it_carries() -> None:
    """A run in memory that says of no case still has to carry what a case is measured on."""
    with pytest.raises(fr.InputError, match=r'candidate "one": got a run of lines, surface, want a run of field'):
        arguments.check_run(Run("one", "test", Outcome("converged", ""), (0,)), fr.load_case("rod"), "candidate")


def test_a_solution_is_of_the_body_that_was_solved() -> None:
    block = fr.box((1, 1, 1), (10.0, 10.0, 10.0), "tetrahedron")
    body = fr.Body(block, (fr.make_effect("neo_hooke", mu=0.01),), (), frames=(0.0, 1.0))
    run = Run("one", "fenicsx", Outcome("converged", ""), (0,), body=body)
    assert arguments.is_of_body(run, body)
    assert not arguments.is_of_body(replace(run, body=None), body)
    with pytest.raises(fr.InputError, match="reference: got a solution of another body"):
        arguments.is_of_body(run, replace(body))
    with pytest.raises(fr.InputError, match='muscle: got "x", want none'):
        fr.error_bars(body, run, muscle="x")


@pytest.mark.parametrize(
    ("what", "message"),
    [
        ({"case": "bar"}, "case: got str 'bar', want a Case"),
        ({"fit": "effect[0].mu"}, r"fit: got str 'effect\[0\].mu', want a list of keys"),
        ({"fit": [0]}, r"fit: got .*, want a list of keys"),
        ({"data": 3}, "data: got int 3, want a path"),
    ],
)
def test_what_a_fit_does_not_want_is_refused_by_name(tmp_path, what: dict[str, object], message: str) -> None:
    given = {"case": fr.load_case(small.write(tmp_path / "bar")), "data": "data.csv", "fit": ["effect[0].mu"]} | what
    with pytest.raises(fr.InputError, match=message):
        fr.calibrate(**given)
