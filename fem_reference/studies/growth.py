"""How the cost of solvers grows with size, on bodies of our own making: an ellipsoid between two round bones, and a spindle.

The reference is measured against its unknowns in one load step; candidates of Table 5.1, with its settings, in an iteration
against triangles, those of tetrahedra against these. Times of candidates are processor time, those of the reference by phase as
its outcome has them. Memory is what a run takes beyond what the process had before.
"""

import ctypes
import gc
import math
import time
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from scipy.spatial import ConvexHull

from fem_reference import solvers
from fem_reference.assessment.growth import Growth, growth
from fem_reference.assessment.solver_table import solver_kinds
from fem_reference.foundations.errors import MissingSoftware
from fem_reference.foundations.mesh import Floats, Ints, Polylines, Surface, TetMesh, boundary
from fem_reference.foundations.motion import RigidMotion, Rotation
from fem_reference.foundations.records import Record
from fem_reference.foundations.usage import forget_peak_memory, peak_memory
from fem_reference.geometry import tessellation
from fem_reference.geometry.rigid_bodies import Sphere
from fem_reference.problems.muscle import Problem
from fem_reference.problems.setup import AttachedVertices, RigidBody, Setup
from fem_reference.runs.store import Frame
from fem_reference.scenes.case import Candidate
from fem_reference.solvers import fenicsx
from fem_reference.studies.benchmark import timing

Progress = Callable[[str], None]

# Semi-axes of the ellipsoid, whose long one is along z, and the radius of the bones beyond its ends [mm].
SHORT, LONG, BONE = 10.0, 40.0, 15.0
# What is attached: beyond this share of the half length. How far the upper bone turns in a frame [rad].
ATTACHED, TURN = 0.8, 0.01
# How often an icosahedron is subdivided; rings and slices of spindles of tetrahedra, and of those of the reference.
SUBDIVISIONS = (2, 3, 4, 5, 6)
SPINDLES = ((1, 6), (2, 9), (2, 18), (3, 24), (4, 36))
BODIES = ((1, 4), (1, 10), (2, 16), (3, 24), (4, 36))
ELEMENT = "P2/P1"
# Iterations that are timed, and the repeats of which the fastest counts.
ITERATIONS, REPEATS = 4, 2
# Phases of the reference, as its outcome has them.
PHASES = ("assembly", "factorisation", "krylov")


@dataclass(frozen=True)
class Point:
    """What a solver needs at a ``size``: by cost, seconds and MB."""

    size: float
    costs: dict[str, float]


def measure(progress: Progress) -> tuple[Growth, ...]:
    """All that is measured, of the reference where FEniCSx is installed."""
    grown = list[Growth]()
    for candidate in (each for row in solver_kinds() for each in row.candidate):
        grown += of_candidate(candidate, progress)
    return (*of_reference(progress), *grown)


def fitted(solver: str, points: list[Point], counted: str) -> list[Growth]:
    """The growth of every cost of ``points`` that is above zero at three sizes or more."""
    costs = dict.fromkeys(name for point in points for name in point.costs)
    sizes = [point.size for point in points]
    made = (growth(solver, name, sizes, [point.costs[name] for point in points], counted) for name in costs)
    return [one for one in made if one is not None]


def of_reference(progress: Progress, sizes: tuple[tuple[int, int], ...] = BODIES) -> list[Growth]:
    """Of the reference in one load step, by phase; nothing where FEniCSx is not installed."""
    settings, points = fenicsx.BodySettings(element=ELEMENT, first_step=1.0), []
    try:
        fenicsx.require(settings)
    except MissingSoftware as error:
        progress(f"growth: the reference is left out, {error}")
        return []
    with fenicsx.session() as own:
        bodies = (replace(timing.fusiform(ELEMENT, *size), frames=(0.0, 1.0)) for size in ((1, 2), *sizes))
        begin = 0.0
        for body in bodies:
            cost = own.solve(body, settings).outcome.cost
            if not begin:  # the first, which is small, compiles and loads
                begin = cost["peak_memory_mb"]
                continue
            phases = {name: cost[f"seconds_{name}"] for name in PHASES}
            total = sum(cost[f"seconds_{name}"] for name in ("set_up", "solve", "stability"))
            points.append(Point(cost["unknowns"], phases | {"total": total, "memory": cost["peak_memory_mb"] - begin}))
            progress(f"growth: reference, {cost['unknowns']:.0f} unknowns: {total:.2f} s")
    return fitted("reference", points, "unknowns")


def of_candidate(candidate: Candidate, progress: Progress, most: int | None = None) -> list[Growth]:
    """Of a candidate in an iteration, and of its memory; with the first ``most`` sizes, by default all."""
    settings = solvers.settings(candidate, f"growth: {candidate.name}")
    counted = "tets" if candidate.solver == "mass_spring" else "triangles"
    made: list[Setup] = (
        [spindle(*size) for size in SPINDLES] if counted == "tets" else [ellipsoid(k) for k in SUBDIVISIONS]
    )
    points = []
    for setup in made[:most]:
        size = len(setup.rest.mesh.tets if setup.rest.mesh else setup.surface.triangles)
        points.append(Point(size, _costs(candidate.solver, settings, setup)))
        progress(f"growth: {candidate.name}, {size} {counted}: {points[-1].costs['iteration']:.2g} s")
    return fitted(candidate.name, points, counted)


def _costs(solver: str, settings: Record, setup: Setup) -> dict[str, float]:
    """Processor time of an iteration [s], and the memory [MB] that a run takes."""
    _spent(solver, settings, setup, 1)  # what is compiled is loaded
    _give_back()
    forget_peak_memory()
    before = peak_memory()
    _spent(solver, settings, setup, 1)
    memory = peak_memory() - before
    times = [[_spent(solver, settings, setup, count) for count in (1, 1 + ITERATIONS)] for _ in range(REPEATS)]
    once, more = np.min(times, axis=0)  # what disturbs a run makes it longer
    return {"iteration": float(more - once) / ITERATIONS, "memory": memory}


def _give_back() -> None:
    """Give memory that is free back to the system, which else would serve again and not be seen; the C library of Linux can."""
    gc.collect()
    with suppress(OSError, AttributeError):
        ctypes.CDLL(None).malloc_trim(0)


def _spent(solver: str, settings: Record, setup: Setup, iterations: int) -> float:
    """Processor time [s] of so many iterations; not a number where one failed."""
    first = setup.frames[0]

    def drop(frame: Frame) -> None:
        """Nobody looks at it."""

    begin = time.process_time()
    moved: Any = replace(setup, frames=(first, first + iterations))  # solvers of surfaces need no more of a problem
    ended = solvers.find(solver, "growth").solve(moved, settings, drop)
    return time.process_time() - begin if ended.status == "converged" else math.nan


def ellipsoid(subdivisions: int) -> Setup:
    """The ellipsoid of ``20 * 4^subdivisions`` triangles, both ends attached to bones, of which the upper one turns."""
    points, triangles = _icosphere(subdivisions)
    surface = Surface(points * [SHORT, SHORT, LONG], triangles)
    bones = _bones(LONG, surface.points)
    ends = _ends(points[:, 2])
    attached = tuple(AttachedVertices(bone.name, bone, end) for bone, end in zip(bones, ends, strict=True))
    return Setup(surface, bones, attached, (0, ITERATIONS), None)


def spindle(rings: int, slices: int) -> Problem:
    """The fusiform body of ``timing`` filled with tetrahedra, its ends attached to bones, of which the upper one turns."""
    cells = timing.fusiform("P2/P1", rings, slices).mesh
    half = timing.LENGTH / 2
    points = cells.points - [0.0, 0.0, half]
    facets = {name: cells.facets[name] for name in ("bottom", "top")}
    mesh = TetMesh(points, cells.cells, facets)
    outside, _ = boundary(mesh.tets)
    used, triangles = np.unique(outside, return_inverse=True)
    surface = Surface(points[used], triangles.reshape(-1, 3))
    bones = _bones(half, surface.points)
    ends = (np.flatnonzero(np.isclose(surface.points[:, 2], end)) for end in (-half, half))
    attached = tuple(AttachedVertices(*each) for each in zip(facets, bones, ends, strict=True))
    axis = Polylines(np.array([[0.0, 0.0, -half], [0.0, 0.0, half]]), np.array([0, 2]))
    return Problem(surface, bones, attached, (0, ITERATIONS), None, mesh, (), axis, {}, 0.0)


def _bones(half: float, beside: Floats) -> tuple[RigidBody, RigidBody]:
    """Balls beyond the ends at -half and half [mm], the upper one turning about the middle."""
    turning: RigidMotion = Rotation((1.0, 0.0, 0.0), (0.0, 0.0, 0.0), (0.0, 100.0), (0.0, 100 * TURN))
    balls = (Sphere((0.0, 0.0, side * (half + BONE)), BONE) for side in (-1, 1))
    made = [(ball, tessellation.tessellated(ball, beside, "growth")) for ball in balls]
    (lower, below), (upper, above) = made
    return RigidBody("lower", below, None, solid=lower), RigidBody("upper", above, turning, solid=upper)


def _ends(z: Floats) -> tuple[Ints, Ints]:
    return np.flatnonzero(z < -ATTACHED), np.flatnonzero(z > ATTACHED)


def _icosphere(subdivisions: int) -> tuple[Floats, Ints]:
    """The unit sphere from an icosahedron with vertices at its poles, outward."""
    latitude, around = math.atan(0.5), 2 * np.pi * np.arange(5) / 5
    rows = [
        np.stack([np.cos(around + turn), np.sin(around + turn), np.full(5, side * math.tan(latitude))], axis=1)
        for turn, side in ((0.0, 1), (np.pi / 5, -1))
    ]
    points = np.concatenate([[[0.0, 0.0, 1.0]], *(row * math.cos(latitude) for row in rows), [[0.0, 0.0, -1.0]]])
    hull = ConvexHull(points)
    triangles = np.array(hull.simplices, np.int64)
    inward = np.linalg.det(points[triangles]) < 0
    triangles[inward] = triangles[inward][:, [0, 2, 1]]
    for _ in range(subdivisions):
        points, triangles = _subdivided(points, triangles)
    return points, triangles


def _subdivided(points: Floats, triangles: Ints) -> tuple[Floats, Ints]:
    """Every triangle cut in four at the middles of its edges, which move onto the unit sphere."""
    edges, which = np.unique(
        np.sort(triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1), axis=0, return_inverse=True
    )
    middles = points[edges].sum(axis=1)
    new = np.concatenate([points, middles / np.linalg.norm(middles, axis=1)[:, None]])
    (a, b, c), (ab, bc, ca) = triangles.T, (len(points) + which.reshape(-1, 3)).T
    parts = ((a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca))
    return new, np.concatenate([np.stack(part, axis=1) for part in parts])
