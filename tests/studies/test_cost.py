"""Points of a study: the worst frame speaks, and the truth is no point of its own study."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import shapes
import small
import studied

from fem_reference.assessment.cost_study import FEATURES, CaseStudy, facts
from fem_reference.assessment.error_bars import ErrorBar, ErrorBars
from fem_reference.foundations.errors import InputError
from fem_reference.foundations.mesh import Polylines
from fem_reference.metrics import MeasurementContext
from fem_reference.runs.store import Outcome, Run
from fem_reference.scenes import casefile
from fem_reference.scenes.case import SolverChoice
from fem_reference.studies import cost
from fem_reference.studies.variations import Trial

BALL = shapes.sphere(1, 10.0)
LINE = Polylines(np.array([[0.0, 0, -8], [0, 0, 8]]), np.array([0, 2]))
BOX = shapes.skin(shapes.box((2, 2, 2), (10, 10, 10)))
FIBRE = Polylines(np.array([[5.0, 5, 1], [5, 5, 9]]), np.array([0, 2]))


def run(folder: str, *shifts: float) -> Run:
    """The ball, displaced along x by ``shifts`` [mm] frame by frame."""
    moved = np.array(shifts)[:, None, None] * [1.0, 0, 0]
    numbers = tuple(range(len(shifts)))
    fibres = LINE.points + moved
    outcome = Outcome("converged", "", {})
    return Run("one", "fenicsx", outcome, numbers, BALL, BALL.points + moved, LINE, fibres, folder=Path(folder))


def test_the_bar_of_a_statistic_is_that_of_its_worst_frame() -> None:
    bars = [
        ErrorBar("deviation", "surface_deviation", name, "mm", np.array(values), {})
        for name, values in (("rms", [0.0, 0.4, 0.1]), ("max", [0.0, np.nan, np.nan]), ("p95", [0.3, 0.2, 0.1]))
    ]
    change = replace(bars[0], of="change", values=np.array([0.0, 9.0, 9.0]))
    found = cost.known(ErrorBars((0, 1, 2), (1.0, 2.0), 1.5, (*bars, change)))
    assert found["surface_deviation.rms"] == 0.4
    assert found["surface_deviation.p95"] == 0.3
    assert cost.known(None) == {}


def test_errors_are_those_of_the_worst_frame_and_none_of_the_truth_itself() -> None:
    truth = run("truth", 0, 1, 2, 3)
    context = MeasurementContext.of(truth, LINE, ())
    found = cost.errors(run("other", 0, -1, 2, 2.5), truth, context)
    assert found["surface_deviation.rms"] == pytest.approx(2.0, rel=1e-12)
    assert cost.errors(run("truth", 0, 1, 2, 3), truth, context) == {}


def grown(folder: str, *scales: float) -> Run:
    """A box that grows by ``scales`` about its corner, a frame each."""
    positions = np.array([scale * BOX.points for scale in scales])
    return Run(
        "run", "recorded", Outcome("converged", ""), tuple(range(len(scales))), BOX, positions, folder=Path(folder)
    )


def test_a_time_that_a_program_states_is_that_of_a_wanted_frame_as_of_any_other() -> None:
    """0.1 s a frame number, ten of which lie between two wanted frames, as of a solver that the clock times at 1 s for each."""
    frames = (BALL.points[None] + np.zeros((3, 1, 1)), (0, 10, 20))
    stated = {"seconds": 4.0, "seconds_solve": 2.0, "seconds_per_frame": 0.1}
    for given in (stated, {"seconds_solve": 2.0}):
        made = Run("mine", "command", Outcome("converged", "", given), frames[1], BALL, frames[0])
        assert cost.costs(made)["seconds_per_frame"] == pytest.approx(1.0)


def test_an_error_is_the_greatest_magnitude_of_either_sign() -> None:
    truth = grown("truth", 1.0, 2.0)
    context = MeasurementContext.of(replace(truth, fibres=FIBRE, fibre_positions=None), FIBRE, ())
    found = cost.errors(grown("mine", 1.0, 1.8), truth, context)
    assert found["volume.deviation"] == pytest.approx(100 * (1 - 0.9**3), rel=1e-9)  # 1.8 for 2, in % of the truth
    assert cost.errors(grown("truth", 1.0, 1.8), truth, context) == {}  # the truth has none


def test_a_setting_that_is_its_solvers_own_is_no_setting(tmp_path) -> None:
    scene = casefile.read_muscle(small.write(tmp_path / "bar"))
    choice = SolverChoice(solver="fenicsx", element="P2/P1", newton_iterations=7)
    assert cost.settings_of(Trial(scene, choice, "reference")) == {"newton_iterations": 7}


def test_a_file_of_no_study_is_named_and_a_folder_of_none_is(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=f'--out: got "{tmp_path}", which has no study'):
        cost.stored(tmp_path)
    (tmp_path / "study").mkdir()
    path = tmp_path / "study" / "study.json"
    path.write_text("[]")
    with pytest.raises(InputError, match=rf"{path}: got \[\], want a study written by the verb study"):
        cost.stored(tmp_path)


def test_a_command_with_an_edited_program_is_another_setting(tmp_path: Path) -> None:
    scene, seen = casefile.read_muscle(small.write(tmp_path / "bar")), []
    choice = SolverChoice(solver="command", command="python mine.py {scene} {out}", directory=str(tmp_path))
    for text in ("1", "2"):
        (tmp_path / "mine.py").write_text(text)
        seen.append(cost.settings_of(Trial(scene, choice, "mine")))
    assert seen[0]["command"] == seen[1]["command"]
    assert seen[0] != seen[1]


def test_studies_of_one_case_against_the_same_truth_are_one(tmp_path: Path) -> None:
    """The study of the case's own name counts where both have a point; one against another truth or an unknown one adds nothing."""

    def store(name: str, key: str | None, *points) -> None:
        of = CaseStudy("hip", "Hip", "its reference", points, {studied.ERROR: "mm"}, {}, (), 100, 1.0)
        path = tmp_path / name / "study.json"
        path.parent.mkdir(parents=True)
        table = facts(replace(of, features=dict.fromkeys(FEATURES, 1.0)), {}) | {"truth_key": key}
        path.write_text(json.dumps({name: value for name, value in table.items() if value is not None}))

    store("hip", "fenicsx-1", studied.point(3.0, 1.0))
    store("hip-a", "fenicsx-1", studied.point(3.5, 1.0), studied.point(1.0, 2.0, "relax"))
    store("hip-b", "fenicsx-2", studied.point(0.1, 2.0, "changed"))
    store("hip-c", None, studied.point(0.2, 2.0, "old"))
    (found,) = cost.stored(tmp_path)
    assert [(point.solver, point.errors[studied.ERROR]) for point in found.points] == [("pbd", 3.0), ("relax", 1.0)]
    for name in ("hip", "hip-a"):  # of before there were keys: nobody knows their truths to be one
        store(f"old/{name}", None, studied.point(3.0, 1.0, name))
    (found,) = cost.stored(tmp_path / "old")
    assert [point.solver for point in found.points] == ["hip"]
