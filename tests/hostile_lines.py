"""Scenes with joints, lines between bones, rods, Gaussians and decompositions into fibres, to be damaged at random."""

from dataclasses import replace
from functools import cache, partial
from pathlib import Path

import numpy as np
import small

from fem_reference.foundations.mesh import Polylines
from fem_reference.io import files
from fem_reference.problems import anatomy, muscle
from fem_reference.problems.muscle import MuscleProblem
from fem_reference.runs.store import Frame
from fem_reference.scenes import casefile
from fem_reference.scenes.case import SolverChoice
from fem_reference.scenes.muscle import MuscleCase
from fem_reference.solvers import find, settings

JOINT = """
[[joint]]
name = "hinge"
bone = "lid"
axis = [1, 0, 0]
centre = "5, 5, 30 mm"
"""
LINES = """
[[candidate]]
name = "points"
solver = "line_of_action"
via = [
    { at = 0.3, bone = "floor" },
    { at = 0.5, bone = "lid", joint = "hinge", within = ["5 deg", "40 deg"] },
    { at = 0.7, bone = "lid", joint = "hinge", curve = [
        { angle = "0 deg", position = "5, 5, 25 mm" },
        { angle = "12 deg", position = "5, 6, 26 mm" },
    ] },
]
hill = { max_force = "100 N", fibre_share = 0.6, pennation = "10 deg", activation = 0.5 }

[[candidate]]
name = "around"
solver = "line_of_action"
obstacle = [
    { bone = "floor", sphere = { centre = "8, 5, 12 mm", radius = "3 mm" } },
    { bone = "lid", ellipsoid = { centre = "5, 5, 30 mm", radii = ["4 mm", "3 mm", "5 mm"], turn = "0, 10, 0 deg" } },
    { bone = "floor", torus = { centre = "5, 5, 20 mm", axis = [0, 0, 1], radius = "6 mm", tube = "2 mm" } },
    { bone = "floor", cylinder = { start = "5, 9, 8 mm", end = "6, 9, 8 mm", radius = "2 mm" } },
]
hill = { max_force = "100 N", fibre_share = 0.6 }

[[candidate]]
name = "rods"
solver = "viper"
points = 4
iterations = 2
stretch = 1.0
bending = 0.1
volume = 1.0
bundle = 0.5

[[candidate]]
name = "gaussians"
solver = "rbf_muscle"
gaussians = 5
iterations = 2
"""
TEMPLATE = """
[fibres.kohout_kukacka]
count = 6
start = "origin"
end = "insertion"
contours = 8
template = "pennate"
pennation = "15 deg"
towards = [1, 0, 0]
"""
HEADS = """
[fibres.chmd]
count = 5
heads = [{ file = "first.vtp", unit = "mm" }, { file = "second.vtk", unit = "mm" }]
"""
_TRACED = '[fibres]\ntraced = { count = 4, start = "origin", end = "insertion" }\n'
_ITERATIONS = 40


def make_lines(folder: Path) -> None:
    """A bar with a joint and solvers of lines, rods and Gaussians."""
    place = small.write(folder) / "case.toml"
    place.write_text(place.read_text().replace("[[attachment]]", JOINT + "\n[[attachment]]", 1) + LINES)
    filled()


def make_template(folder: Path) -> None:
    """A bar with fibres of a template."""
    _with_fibres(folder, TEMPLATE)


def make_heads(folder: Path) -> None:
    """A bar with fibres between those of two heads."""
    _with_fibres(folder, HEADS)
    for name, at in (("first.vtp", 4.0), ("second.vtk", 6.0)):
        lines = [
            np.column_stack([np.full(9, at + x), np.full(9, 5 + y), np.linspace(1, 39, 9)])
            for x, y in ((0, 0), (1, 0), (0, 1), (1, 1))
        ]
        found = Polylines(np.concatenate(lines), np.arange(5) * 9)
        files.write_polylines(folder / name, found, found.points)


def _with_fibres(folder: Path, fibres: str) -> None:
    place = small.write(folder) / "case.toml"
    text = place.read_text()
    assert _TRACED in text
    place.write_text(text.replace(_TRACED, fibres.lstrip()))
    filled()


@cache
def filled() -> MuscleProblem:
    """The undamaged bar with its tetrahedra, made once."""
    import tempfile

    with tempfile.TemporaryDirectory() as folder:
        case = casefile.read_muscle(small.write(Path(folder) / "bar"))
        return muscle.build(case, muscle.setup(case))


def read_lines(folder: Path) -> None:
    """The solvers of a scene, in the tetrahedra of the undamaged one; what is converged is finite and of the frames wanted."""
    case = casefile.read_muscle(folder)
    rest, whole = muscle.setup(case), filled()
    problem = replace(whole, bones=rest.bones, attached=rest.attached, joints=rest.joints, frames=rest.frames[:2])
    if not np.array_equal(rest.surface.points, whole.surface.points) or problem.frames[-1] > 10**4:
        return
    for i, candidate in enumerate(case.candidate):
        solve(problem, candidate, f"candidate[{i}]")


def solve(problem: MuscleProblem, candidate: SolverChoice, place: str) -> None:
    """Solve with one of the fast solvers, where it has not too much to do."""
    solver, record = find(candidate.solver, place), settings(candidate, place)
    if candidate.solver not in ("line_of_action", "viper", "rbf_muscle"):
        return
    if solver.check_problem is not None:
        solver.check_problem(record, problem, place)
    if max([getattr(record, name, 0) for name in ("iterations", "points", "gaussians")]) > _ITERATIONS:
        return
    frames: list[Frame] = []
    outcome = solver.solve(problem, record, frames.append)
    if outcome.status == "converged":
        assert tuple(frame.number for frame in frames) == problem.frames
        for frame in frames:
            arrays = [array for array in (frame.surface, frame.fibres) if array is not None]
            assert all(np.isfinite(array).all() for array in arrays)
            assert np.isfinite(list(frame.scalars.values())).all(), frame.scalars


def read_fibres(folder: Path) -> None:
    """The fibres of a scene: finite, each with a length."""
    case = casefile.read_muscle(folder)
    rest = muscle.setup(case)
    lines, directions = anatomy.fibres_of(case, rest.surface, partial(_fill, case, rest))
    assert np.isfinite(lines.points).all()
    assert (lines.lengths() > 0).all(), "a fibre without length"
    given = np.repeat(np.arange(1), 1)
    found = directions(given, rest.surface.points.mean(axis=0)[None])
    assert np.isfinite(found).all()


def _fill(case: MuscleCase, rest: muscle.Setup, size: float) -> muscle.TetMesh:
    """The tetrahedra of the undamaged bar, where the damage is elsewhere."""
    whole = filled()
    if np.array_equal(rest.surface.points, whole.surface.points) and set(whole.mesh.facets) == {
        one.attachment for one in rest.attached
    }:
        return whole.mesh
    return muscle.filled(case, rest, size)
