"""A small comparison that tests of pages share, made by hand so that they stand alone."""

import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from fem_reference.assessment.comparison import Comparison
from fem_reference.assessment.error_bars import ErrorBar, ErrorBars, Of
from fem_reference.assessment.judge import Verdict
from fem_reference.foundations.mesh import Polylines, Surface
from fem_reference.metrics import Measure, MeasurementContext
from fem_reference.problems.setup import Bone, Setup
from fem_reference.report import comparison_page, gallery
from fem_reference.runs.store import Outcome, Run
from fem_reference.scenes import casefile

NUMBERS = (0, 10, 20, 30, 40)
NAN = float("nan")
CASE = """
title = "A ball that is pressed"
proves = "The page says what was measured."
[muscle]
surface = "ball.txt"
unit = "mm"
tet_size = "2 mm"
[[bone]]
name = "plate"
surface = "plate.txt"
unit = "mm"
[bone.motion]
axis = [0, 0, 1]
centre = "0, 0, 0 mm"
keyframes = [{frame = 0, angle = "0 rad"}, {frame = 40, angle = "1 rad"}]
[[attachment]]
name = "foot"
bone = "plate"
within = "1 mm"
[[effect]]
name = "neo_hooke"
mu = "10 kPa"
[fibres]
traced = {count = 2, start = "foot", end = "foot"}
[frames]
first = 0
last = 40
every = 10
[reference]
solver = "fenicsx"
[[expect]]
of = "reference"
metric = "volume"
statistic = "deviation"
frame = "any"
truth = "0 %"
within = "0.5 %"
kind = "property"
because = "It is <nearly> incompressible & closed."
[negative_control]
key = "effect[0].mu"
value = "1 kPa"
because = "softer"
"""


def ball() -> Surface:
    """A closed surface of 66 points with half axes 30, 20, 10 along x, y, z [mm]."""
    corners = np.array([[1, 0, 0], [0, 1, 0], [-1, 0, 0], [0, -1, 0], [0, 0, 1], [0, 0, -1]], float)
    triangles = np.array([[i, (i + 1) % 4, 4] for i in range(4)] + [[(i + 1) % 4, i, 5] for i in range(4)])
    points = [tuple(corner) for corner in corners]
    for _ in range(2):
        finer = []
        for triangle in triangles:
            middles = []
            for i, j in ((0, 1), (1, 2), (2, 0)):
                middle = np.add(points[triangle[i]], points[triangle[j]])
                middle = tuple(np.round(middle / np.linalg.norm(middle), 12))
                if middle not in points:
                    points.append(middle)
                middles.append(points.index(middle))
            (a, b, c), (d, e, f) = triangle, middles
            finer += [[a, d, f], [d, b, e], [f, e, c], [d, e, f]]
        triangles = np.array(finer)
    return Surface(np.array(points) * [30, 20, 10], triangles)


def measured(run: Run, other: np.ndarray) -> tuple[Measure, ...]:
    """Measures in the manner of the metrics, made by hand so that these tests stand alone."""
    distances = np.linalg.norm(run.positions - other, axis=2)
    where = tuple(f"vertex {i}" for i in np.argmax(np.nan_to_num(distances), axis=1))
    found = (
        Measure("volume", "deviation", "%", distances.mean(axis=1) / 7),
        Measure("volume", "deviation_volume", "mm3", distances.mean(axis=1) * 700),
        Measure("fibre_length", "mean", "mm", -distances.mean(axis=1)),
        Measure("fibre_length", "max", "mm", distances.mean(axis=1) * 2, where),
        Measure("surface_deviation", "rms", "mm", np.sqrt((distances**2).mean(axis=1))),
        Measure("surface_deviation", "p95", "mm", np.quantile(distances, 0.95, axis=1)),
        Measure("surface_deviation", "max", "mm", distances.max(axis=1), where),
        Measure("surface_deviation", "hausdorff", "mm", distances.max(axis=1) / 2, where),
    )
    return tuple(replace(one, numbers=run.numbers) for one in found)


def a_run(name: str, solver: str, positions: np.ndarray, status: str = "converged", **more) -> Run:
    cost = {"seconds": 12.0, "seconds_solve": 8.0, "iterations": 40}
    return Run(name, solver, Outcome(status, f"{name} has ended", cost), NUMBERS, ball(), positions, **more)


def small_comparison(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Comparison:
    """A reference that moves along x, ``quick`` 1 mm a frame beside it, ``torn`` whose last frame is not a number."""
    monkeypatch.setattr(gallery, "program", lambda _job, _folder: [sys.executable, "-c", "raise SystemExit(3)"])
    (tmp_path / "press").mkdir()
    for name, text in (("case.toml", CASE), ("ball.txt", "ball"), ("plate.txt", "plate")):
        (tmp_path / "press" / name).write_text(text)
    scene = casefile.read(tmp_path / "press")
    rest, steps = ball(), np.arange(5.0)[:, None, None]
    moved = rest.points + steps * [2.0, 0, 0]
    torn = moved + steps * [0, 0.5, 0]
    torn[-1, 7] = NAN
    origin = {"versions": {"dolfinx": "0.11.0"}, "mesh": {"tets": 234.0}}
    reference = a_run(
        "reference", "fenicsx", moved, scalars={"min_det_F_points": 1 - steps[:, 0, 0] / 8}, origin=origin
    )
    quick, torn = a_run("quick", "pbd", moved + steps * [0, 0, 1.0]), a_run("torn", "recorded", torn, "diverged")
    plate = Bone("plate", Surface(rest.points - [0, 0, 25], rest.triangles), scene.bone[0].motion.poses())
    return Comparison(
        scene=scene,
        setup=Setup(rest, (plate,), (), NUMBERS, None),
        reference=reference,
        candidates=(quick, torn),
        context=MeasurementContext.of(
            reference, Polylines([[0, 0, 0], [5, 0, 0], [0, 1, 0], [5, 1, 0]], [0, 2, 4]), ()
        ),
        deviations={run.name: measured(run, moved) for run in (quick, torn)},
        changes={run.name: measured(run, rest.points) for run in (reference, quick, torn)},
        extension_error=Measure("fibre_length", "extension_error", "mm", np.arange(5) / 8, ("fibre 1",) * 5, NUMBERS),
        verdicts=(Verdict("pass", scene.expect[0], 0.25, 0.0, 0.5, "%", 20),),
    )


def html(comparison: Comparison) -> str:
    """The page of a comparison as text."""
    return comparison_page.page(comparison).html()


def alone(comparison: Comparison) -> Comparison:
    return replace(comparison, candidates=(), deviations={}, changes={"reference": comparison.changes["reference"]})


def with_bars(comparison: Comparison) -> Comparison:
    """A tenth of each greatest value of "quick", not known in the last frame, of the reference and of deviations from it."""
    bars = [
        ErrorBar(of, one.metric, one.statistic, one.unit, known, {"tetrahedra": 0.5, "load steps": NAN}, 3 * known)
        for of in ("change", "deviation")
        for one in comparison.deviations["quick"]
        for known in [np.append(np.abs(one.values[:-1]) / 10, NAN)]
    ]
    known = ErrorBars(NUMBERS, (2.0, 4.0), 1.5, tuple(bars))
    reference = comparison.changes | {"reference": _known(comparison.changes["reference"], known, "change")}
    deviations = {name: _known(found, known, "deviation") for name, found in comparison.deviations.items()}
    return replace(comparison, changes=reference, deviations=deviations, error_bars=known)


def _known(measures: tuple[Measure, ...], bars: ErrorBars, of: Of) -> tuple[Measure, ...]:
    found = [(one, bars.find(of, one.metric, one.statistic)) for one in measures]
    return tuple(replace(one, error_bars=None if bar is None else bar.values) for one, bar in found)
