"""Position based dynamics of the muscle surface, by Algorithm 1 of the report (section 5.5.3).

Frame number n is the state after iteration n. In an iteration the bones first move to their pose; then each sub-iteration is a
complete step of the algorithm. There are no external forces, so the time step cancels and is not a setting. Instead of velocities
v, the displacements ``dt v`` of vertices in one sub-iteration are stored. As in the report, the result depends on the order of the
vertices, because constraints are projected one after the other. Collisions are detected again in each sweep, whereas the report's
algorithm detects them once per step, in line 13.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Annotated

import numpy as np
from pydantic import Field

from fem_reference.foundations.mesh import Floats, Ints, Polylines, diagonal
from fem_reference.foundations.records import Record
from fem_reference.foundations.units import Length
from fem_reference.problems.setup import Setup
from fem_reference.runs.store import Outcome, Sink
from fem_reference.solvers import pbd_kernels as kernels
from fem_reference.solvers.collision_kernels import CollidingBone, colliding_bones, move_out
from fem_reference.solvers.common.frame_loop import MovingSurface, carry, follow, timed
from fem_reference.solvers.common.protocol import MuscleSolver, TableRow, Trade

Stiffness = Annotated[float, Field(ge=0, le=1)]
# Segments count as equally near if their distances differ by at most this fraction of the size of the muscle.
_AS_NEAR = 1e-9


class PbdCollision(Record):
    """Contact of bones with free vertices.

    ``gap`` [mm]: the minimum distance between a vertex and a bone; for a vertex that is closer at rest, the minimum is its distance
    at rest. ``stiffness``: the fraction of the missing distance that one projection restores.
    """

    gap: Annotated[Length, Field(ge=0)]
    stiffness: Stiffness


class PbdSettings(Record):
    """Settings of the report's Algorithm 1, with its line numbers; every key is required except ``anisotropy`` and ``collision``.

    ``sub_iterations``: the number of steps of the algorithm in each iteration, 3 in section 6.1 of the report.
    ``solver_iterations``: the number of sweeps over all constraints in each step (line 15). ``damping``: the fraction of each
    velocity that is lost in a step (line 8). ``stretch``, ``volume``, ``bending``: the stiffness of edge lengths, of the volume and
    of dihedral angles, that is, the fraction of an error that one projection removes, from 0 (constraint off) to 1.

    ``anisotropy``: the factor a in the stiffness ``stretch (1 - a |cos|)`` of an edge, with the cosine of its angle to the nearest
    fibre at rest; a = 1 in the report's program with fibres. ``collision``: contact with bones (lines 12 to 14).
    """

    sub_iterations: Annotated[int, Field(gt=0), Trade((1, 3, 10))]
    solver_iterations: Annotated[int, Field(gt=0), Trade((1, 3, 10, 30))]
    damping: Annotated[float, Field(ge=0, lt=1)]
    stretch: Stiffness
    volume: Stiffness
    bending: Stiffness
    anisotropy: Stiffness | None = None
    collision: PbdCollision | None = None


@dataclass(frozen=True, eq=False)
class PbdConstraints:
    """The constraints that pull a surface towards its rest state.

    ``edges`` (e, 2) with their ``lengths`` at rest (e,) [mm] and ``share`` (e,), a factor on the stiffness of each edge.
    ``triangles`` (m, 3) with ``six_volumes`` [mm3], six times the volume inside at rest. ``hinges`` (e, 4), the pairs of triangles
    at each edge, with their dihedral ``angles`` at rest (e,) [rad]. ``inverse_masses`` (n,): 0 for attached vertices, otherwise 1.
    """

    inverse_masses: Floats
    edges: Ints
    lengths: Floats
    share: Floats
    triangles: Ints
    six_volumes: float
    hinges: Ints
    angles: Floats

    @property
    def count(self) -> int:
        """The number of constraints."""
        return len(self.edges) + len(self.hinges) + 1

    @classmethod
    def at_rest(cls, points: Floats, triangles: Ints, attached: Ints) -> "PbdConstraints":
        """The constraints of a closed surface with ``attached`` vertices (k,), in which all edges have the same stiffness."""
        points, triangles = np.array(points), np.array(triangles)  # compiled functions need writable arrays
        inverse_masses = np.ones(len(points))
        inverse_masses[attached] = 0
        hinges = hinges_of(triangles)
        edges = np.ascontiguousarray(hinges[:, :2])
        return cls(
            inverse_masses=inverse_masses,
            edges=edges,
            lengths=kernels.distances(points, edges),
            share=np.ones(len(edges)),
            triangles=triangles,
            six_volumes=kernels.volume(points, triangles)[0],
            hinges=hinges,
            angles=kernels.dihedrals(points, hinges),
        )


def hinges_of(triangles: Ints) -> Ints:
    """The hinges (e, 4) of a closed surface: both ends of each edge, then the two vertices opposite; sorted by the ends."""
    edges = np.sort(triangles[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)
    opposite = triangles[:, [2, 0, 1]].ravel()
    order = np.lexsort((edges[:, 1], edges[:, 0]))
    return np.column_stack([edges[order][::2], opposite[order].reshape(-1, 2)])


def along_fibres(points: Floats, edges: Ints, fibres: Polylines) -> Floats:
    """``|cos|`` (e,) of the angle between each of ``edges`` (e, 2) and the fibre segment nearest to the midpoint of the edge.

    If several segments are equally near up to rounding, as at a kink, the first is used, even in a rotated scene.
    """
    starts = np.setdiff1d(np.arange(len(fibres.points) - 1), fibres.offsets[1:] - 1)
    starts = starts[np.any(fibres.points[starts + 1] != fibres.points[starts], axis=1)]
    within = _AS_NEAR * diagonal(points)
    middles = points[edges].mean(axis=1)
    nearest = starts[kernels.nearest_segments(middles, fibres.points[starts], fibres.points[starts + 1], within)]
    edge, fibre = points[edges[:, 1]] - points[edges[:, 0]], fibres.points[nearest + 1] - fibres.points[nearest]
    lengths = np.linalg.norm(edge, axis=1) * np.linalg.norm(fibre, axis=1)
    return np.asarray(np.minimum(np.abs(np.einsum("ed,ed->e", edge, fibre)) / lengths, 1))


def solve(setup: Setup, settings: PbdSettings, sink: Sink) -> Outcome:
    """Iterate from rest at the first of ``setup.frames`` to the last; each requested frame goes to ``sink``."""
    return follow(timed(PbdSurface, setup, settings), setup, sink)


class PbdSurface(MovingSurface):
    """A surface with its constraints, the last ``displacement`` (n, 3) [mm] of its vertices, and ``bones`` that it may touch."""

    def __init__(self, setup: Setup, settings: PbdSettings) -> None:
        super().__init__(setup)
        self.settings, self.constraints = settings, constraints_of(setup, settings)
        self.displacement, self.bones = np.zeros_like(self.points), list[CollidingBone]()
        if settings.collision is not None:
            places = setup.surface.points, setup.attached_vertices
            self.bones = colliding_bones(setup.bones, *places, settings.collision.gap)
        self.cost["projections"] = 0.0

    def move(self, number: int) -> None:
        """Run one iteration, up to frame ``number``."""
        carry(self.points, self.setup, number)
        for bone in self.bones:
            bone.move(number)
        now, chosen = (self.points, self.displacement), self.settings
        for _ in range(chosen.sub_iterations):
            now = advance(*now, self.constraints, chosen, self.bones)
        self.points, self.displacement = now
        self.cost["projections"] += self.constraints.count * chosen.solver_iterations * chosen.sub_iterations


def constraints_of(setup: Setup, settings: PbdSettings) -> PbdConstraints:
    """The constraints of the surface at rest. With ``anisotropy``, edges along fibres are softer."""
    surface = setup.surface
    found = PbdConstraints.at_rest(surface.points, surface.triangles, setup.attached_vertices)
    if settings.anisotropy is None:
        return found
    fibres = setup.rest.fibres
    assert fibres is not None  # with these settings the solver gets fibres
    return replace(found, share=1 - settings.anisotropy * along_fibres(surface.points, found.edges, fibres))


def sweep(points: Floats, at: PbdConstraints, stretch: float, volume: float, bending: float) -> None:
    """Project all constraints once, which moves ``points`` (n, 3) [mm] in place.

    ``stretch``, ``volume``, ``bending``: the stiffness of each kind of constraint.
    """
    kernels.project_distances(points, at.inverse_masses, at.edges, at.lengths, stretch * at.share)
    kernels.project_volume(points, at.inverse_masses, at.triangles, at.six_volumes, volume)
    kernels.project_dihedrals(points, at.inverse_masses, at.hinges, at.angles, bending)


def advance(
    points: Floats,
    displacement: Floats,
    constraints: PbdConstraints,
    settings: PbdSettings,
    bones: Sequence[CollidingBone] = (),
) -> tuple[Floats, Floats]:
    """Positions (n, 3) [mm] and displacements dt v (n, 3) [mm] after one step, lines 8 to 20 of Algorithm 1."""
    moved = points + (1 - settings.damping) * displacement
    for _ in range(settings.solver_iterations):
        sweep(moved, constraints, settings.stretch, settings.volume, settings.bending)
        if settings.collision is not None:
            move_out(moved, bones, settings.collision.stiffness)
    return moved, moved - points


_EXAMPLE = {"sub_iterations": 3, "solver_iterations": 2, "damping": 0.1, "stretch": 1.0, "volume": 1.0, "bending": 0.5}

# The algorithm in the report's text with the settings of the report's program.
_TABLE = TableRow(
    "PBD",
    "pbd",
    {"sub_iterations": 3, "solver_iterations": 1, "damping": 0.01, "stretch": 1.0, "volume": 1.0, "bending": 0.9}
    | {"collision": {"gap": "0 mm", "stiffness": 1.0}},
)
SOLVES = (
    MuscleSolver(
        settings=PbdSettings,
        solve=solve,
        example=_EXAMPLE,
        depends_on=("order",),
        table=(_TABLE,),
        fibres=lambda settings: settings.anisotropy is not None,
    ),
)
