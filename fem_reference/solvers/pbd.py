"""Position based dynamics of the muscle surface: the report's Algorithm 1 (section 5.5.3), without collision.

Frame number n is the state after iteration n. In an iteration the bones take their pose and stay; then every
sub-iteration is a whole step of the algorithm. No force acts from outside, so the time step cancels: what is kept of a
velocity is the way a vertex goes in one sub-iteration, ``dt v``, and no time step is asked for. The result depends on
the order of the vertices, as it does in the report: constraints are projected one after the other.
"""

import time
from dataclasses import dataclass
from typing import Annotated

import numpy as np
from pydantic import Field

from fem_reference.mesh import TET_FACES, Floats, Ints
from fem_reference.motion import apply
from fem_reference.problem import Setup
from fem_reference.records import Record
from fem_reference.runs import Frame, Outcome, Sink
from fem_reference.solvers.pbd_kernels import (
    dihedrals,
    distances,
    project_dihedrals,
    project_distances,
    project_volume,
    volume,
)

Stiffness = Annotated[float, Field(ge=0, le=1)]

# A body spread this many times as wide as at rest, or as what the bones hold of it, is lost.
_LOST = 10.0


class Settings(Record):
    """How the algorithm is run; every key is required.

    ``sub_iterations``: steps of the algorithm in each iteration, 3 in report 6.1. ``solver_iterations``: sweeps over
    all constraints in each step (line 15). ``damping``: share of every velocity that is lost in a step (line 8), 0 for
    none. ``stretch``, ``volume``, ``bending``: stiffness of edge lengths, enclosed volume and dihedral angles, the
    share of its error that one projection of a constraint takes away, from 0 (constraint off) to 1.
    """

    sub_iterations: Annotated[int, Field(gt=0)]
    solver_iterations: Annotated[int, Field(gt=0)]
    damping: Annotated[float, Field(ge=0, lt=1)]
    stretch: Stiffness
    volume: Stiffness
    bending: Stiffness


@dataclass(frozen=True, eq=False)
class Constraints:
    """What the surface keeps of its rest state.

    ``lengths`` (e,) [mm] of ``edges`` (e, 2); ``six_volumes`` [mm3], six times the volume inside ``triangles`` (m, 3);
    ``angles`` (e,) [rad] of ``hinges`` (e, 4), the two triangles at each edge. ``inverse_masses`` (n,): 0 for a vertex
    that a bone holds, 1 for every other.
    """

    inverse_masses: Floats
    edges: Ints
    lengths: Floats
    triangles: Ints
    six_volumes: float
    hinges: Ints
    angles: Floats

    @classmethod
    def at_rest(cls, points: Floats, triangles: Ints, held: Ints) -> "Constraints":
        """The constraints of a closed surface whose vertices ``held`` (k,) are held."""
        points, triangles = np.array(points), np.array(triangles)  # the compiled functions know writable arrays only
        inverse_masses = np.ones(len(points))
        inverse_masses[held] = 0
        hinges = hinges_of(triangles)
        edges = np.ascontiguousarray(hinges[:, :2])
        return cls(
            inverse_masses=inverse_masses,
            edges=edges,
            lengths=distances(points, edges),
            triangles=triangles,
            six_volumes=volume(points, triangles)[0],
            hinges=hinges,
            angles=dihedrals(points, hinges),
        )


def hinges_of(triangles: Ints) -> Ints:
    """Each edge of a closed surface once, in the order of its vertices: its ends, the vertices opposite it; (e, 4)."""
    edges = np.sort(triangles[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)
    opposite = triangles[:, [2, 0, 1]].ravel()
    order = np.lexsort((edges[:, 1], edges[:, 0]))
    return np.column_stack([edges[order][::2], opposite[order].reshape(-1, 2)])


def solve(setup: Setup, settings: Settings, sink: Sink) -> Outcome:
    """Iterate from rest at the first of ``setup.frames`` to the last of them; each frame wanted goes into ``sink``."""
    seconds_compile = _compile(settings)
    held = np.concatenate([np.zeros(0, np.int64), *(entry.vertices for entry in setup.held)])
    constraints = Constraints.at_rest(setup.surface.points, setup.surface.triangles, held)
    points, way = np.array(setup.surface.points), np.zeros(setup.surface.points.shape)
    first, last = setup.frames[0], setup.frames[-1]
    sink(Frame(first, points.copy()))
    cost = {"seconds_solve": 0.0, "seconds_compile": seconds_compile, "iterations": 0, "threads": 1}
    for iteration in range(first + 1, last + 1):
        begin = time.perf_counter()
        for entry in setup.held:
            points[entry.vertices] = apply(entry.bone.pose(iteration), setup.surface.points[entry.vertices])
        for _ in range(settings.sub_iterations):
            points, way = advance(points, way, constraints, settings)
        cost["seconds_solve"] += time.perf_counter() - begin
        cost["iterations"] += 1
        cost["seconds_per_iteration"] = cost["seconds_solve"] / cost["iterations"]
        if trouble := _trouble(points, setup.surface.points, held):
            advice = "a slower motion, more sub_iterations or a lower stiffness may help"
            return Outcome("diverged", f"frame {iteration}: {trouble}; {advice}", cost)
        if iteration in setup.frames:
            sink(Frame(iteration, points.copy()))
    return Outcome("converged", f"{last - first} iterations of {settings.sub_iterations} steps", cost)


def advance(points: Floats, way: Floats, constraints: Constraints, settings: Settings) -> tuple[Floats, Floats]:
    """Positions (n, 3) [mm] and ``way`` = dt v (n, 3) [mm] after one step of Algorithm 1, lines 8 to 20."""
    moved = points + (1 - settings.damping) * way
    at = constraints
    for _ in range(settings.solver_iterations):
        project_distances(moved, at.inverse_masses, at.edges, at.lengths, settings.stretch)
        project_volume(moved, at.inverse_masses, at.triangles, at.six_volumes, settings.volume)
        project_dihedrals(moved, at.inverse_masses, at.hinges, at.angles, settings.bending)
    return moved, moved - points


def _compile(settings: Settings) -> float:
    """Run every compiled function once, on a tetrahedron; seconds."""
    begin = time.perf_counter()
    points = np.vstack([np.zeros(3), np.eye(3)])
    advance(points, np.zeros((4, 3)), Constraints.at_rest(points, TET_FACES, np.zeros(0, np.int64)), settings)
    return time.perf_counter() - begin


def _trouble(points: Floats, rest: Floats, held: Ints) -> str:
    """What is wrong with positions as a whole, empty if nothing is."""
    lost = np.flatnonzero(~np.isfinite(points).all(axis=1))
    if len(lost):
        return f"the position of {len(lost)} vertices is not a number (vertex {lost[0]} for one)"
    wide, at_rest, between = _spread(points), _spread(rest), _spread(points[held])
    if wide > _LOST * max(at_rest, between):
        return f"the surface is spread over {wide:.3g} mm, at rest {at_rest:.3g} mm"
    return ""


def _spread(points: Floats) -> float:
    """Diagonal of the box around points [mm], 0 without any."""
    return float(np.linalg.norm(np.ptp(points, axis=0))) if len(points) else 0.0
