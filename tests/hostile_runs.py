"""Candidates, baselines and stored runs that anybody may have written: made whole, and read."""

import json
from collections.abc import Callable
from contextlib import chdir
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import meshio
import numpy as np
import shapes

from fem_reference.assessment import baseline, cost_study, error_bars, regression
from fem_reference.assessment.measured import CurrentMeasures
from fem_reference.foundations.mesh import Polylines
from fem_reference.foundations.records import parse
from fem_reference.io import files
from fem_reference.problems.problem import AtRest
from fem_reference.problems.setup import Setup
from fem_reference.runs import results, states, store
from fem_reference.runs.states import NodalState
from fem_reference.runs.store import Frame, Outcome, Run
from fem_reference.runs.writer import Writer
from fem_reference.scenes import casefile
from fem_reference.scenes.case import HOME
from fem_reference.solvers import recorded
from fem_reference.studies.execution import Bench

BALL = shapes.sphere(1, 30.0)
FIBRE = Polylines(np.array([[0.0, 0, -15], [0, 0, 0], [0, 0, 15]]), np.array([0, 3]))
NUMBERS = (0, 10, 20)
SETUP = Setup(BALL, (), (), NUMBERS, None)
BALL_SCENE = SimpleNamespace(name="ball", key="0123456789abcdef0123", place="case.toml", numbers=NUMBERS)


def shipped(name: str) -> Callable[[Path], None]:
    def make(folder: Path) -> None:
        for file in (HOME / "cases" / name).iterdir():
            if file.is_file():
                (folder / file.name).write_bytes(file.read_bytes())

    return make


def moved(number: int) -> Any:
    """The ball, wandering."""
    return BALL.points + [number / 10, 0, 0]


def run(name: str, positions: Any) -> Run:
    """A run of the ball."""
    inside = np.stack([FIBRE.points + [number / 10, 0, 0] for number in NUMBERS])
    return Run(name, "test", Outcome("converged", "done"), NUMBERS, BALL, np.asarray(positions), FIBRE, inside)


REFERENCE = run("reference", [moved(number) for number in NUMBERS])


def make_sequence(folder: Path) -> None:
    for number in NUMBERS:
        files.write_surface(folder / f"frame_{number}.ply", BALL, moved(number))
    (folder / "candidate.toml").write_text(
        'name = "mine"\nversion = "1.2"\nunit = "mm"\nseconds_per_frame = 0.5\nthreads = 2\n'
    )


def make_index(folder: Path) -> None:
    (folder / "below").mkdir()
    for number in NUMBERS:
        files.write_surface(folder / "below" / f"frame_{number}.vtp", BALL, moved(number))
    files.write_pvd(folder / "frames.pvd", [(number, f"below/frame_{number}.vtp") for number in NUMBERS])


def make_series(data_format: str) -> Callable[[Path], None]:
    def make(folder: Path) -> None:
        # Meshio puts its .h5 where the process is.
        with chdir(folder), meshio.xdmf.TimeSeriesWriter(folder / "run.xdmf", data_format=data_format) as series:
            series.write_points_cells(BALL.points, [("triangle", BALL.triangles)])
            for number in NUMBERS:
                series.write_data(number, point_data={"displacement": moved(number) - BALL.points})

    return make


def read_sequence(folder: Path) -> None:
    """A candidate; where it is read, only what is where it was passes its baseline."""
    taken: list[Frame] = []
    settings = parse(recorded.RecordedSettings, {"folder": str(folder), "unit": "mm"}, "case.toml")
    recorded.choice(folder)
    recorded.solve(SETUP, settings, taken.append)
    candidate = run("mine", [frame.surface for frame in taken])
    assert np.isfinite(candidate.positions).all()
    folder = folder.parent
    past = CurrentMeasures.of(BALL_SCENE, SETUP, run("mine", REFERENCE.positions), REFERENCE)  # type: ignore[arg-type]
    baseline.update(folder / "ball.json", past)
    word = _checked(folder / "ball.json", candidate)
    away = np.abs(candidate.positions - REFERENCE.positions).max()
    assert word != "pass" or away <= 2 * baseline.MOVED, f"a false pass, {away} mm away"


def _checked(path: Path, candidate: Run) -> str:
    now = CurrentMeasures.of(BALL_SCENE, SETUP, candidate, REFERENCE)  # type: ignore[arg-type]
    return str(regression.check(baseline.read(path, BALL_SCENE, "mine"), now).word)  # type: ignore[arg-type]


def make_baseline(folder: Path) -> None:
    past = CurrentMeasures.of(BALL_SCENE, SETUP, run("mine", REFERENCE.positions), REFERENCE)  # type: ignore[arg-type]
    baseline.update(folder / "ball.json", past)


def read_baseline(folder: Path) -> None:
    """A baseline, by which a candidate that has no numbers in a frame never passes."""
    path, positions = folder / "ball.json", np.array(REFERENCE.positions)
    _checked(path, run("mine", positions))
    positions[1] = np.nan
    assert _checked(path, run("mine", positions)) != "pass", "a false pass of what is not a number"


# Stored runs


def make_run(folder: Path) -> None:
    identity = {
        "name": "reference",
        "solver": "test",
        "origin": {"case": "none", "versions": {"numpy": "2"}},
        "frames": NUMBERS,
    }
    writer = Writer(folder / "run", identity, AtRest(BALL, FIBRE, shapes.box((1, 1, 1), (5, 5, 5))))
    for number in NUMBERS:
        tets = writer.rest.mesh.points + number  # type: ignore[union-attr]
        state = NodalState(np.zeros((6, 10, 3)) + number, np.zeros((6, 4)), np.zeros((0, 0, 3)))
        writer.add(Frame(number, moved(number), FIBRE.points, tets, {"energy": 1.0 * number}, state=state))
    writer.close(Outcome("converged", "done", {"newton_iterations": 7.0}))


def read_run(folder: Path) -> None:
    """A stored run, with its states."""
    store.status(folder / "run")
    store.finished(folder / "run")
    found = store.load(folder / "run")
    found._repr_html_()
    recorded.solve(SETUP, recorded.RecordedSettings(folder=str(folder / "run"), unit="mm"), lambda _frame: None)
    mesh, fibre = states.read_rest(folder / "run")
    known = results.Results(mesh, (), states.StoredStates(folder / "run", found.numbers), fibre)
    for number in found.numbers:
        known.evaluate([[1.0, 1.0, 1.0]], number)


def make_field(folder: Path) -> None:
    shipped("rod")(folder)
    run = Bench(casefile.read(folder), folder / "runs")
    run.obtain("reference", run.scene.reference, "reference")


def read_field(folder: Path) -> None:
    """A stored run of a field."""
    (path,) = (folder / "runs").glob("scikit_fem-*")
    found = store.load(path)
    found._repr_html_()
    assert found.values.shape[0] == len(found.numbers)
    assert found.vertex_values.shape[1] == len(found.points)


def make_bars(folder: Path) -> None:
    one = error_bars.ErrorBar("deviation", "surface_deviation", "rms", "mm", np.array([0.0, 1, 2]), {"mesh": 1.0})
    error_bars.save(error_bars.ErrorBars(NUMBERS, (4.0, 8.0), 1.5, (one,)), folder, {"reference": "x"})


def read_bars(folder: Path) -> None:
    """Stored error bars."""
    error_bars.load(folder, {"reference": "x"})


def make_study(folder: Path) -> None:
    like = dict.fromkeys(cost_study.FEATURES, 1.0)
    case = cost_study.CaseStudy("ball", "A ball", "closed form", (), {"a.b": "mm"}, {"a.b": 0.1}, (), 320, 2.0, like)
    (folder / "study.json").write_text(json.dumps(cost_study.facts(case, {"machine": "x"})))


def read_study(folder: Path) -> None:
    """A stored study."""
    cost_study.load(folder / "study.json")
