"""The report's program for position based dynamics, reimplemented so that it reproduces the recorded output.

The program (github.com/cervenkam/muscle-deformation-PBD) differs from the report's text, section 5.5.3 and Algorithm 1:

- edges: each edge is projected twice in a sweep, once as a half-edge of each of its triangles, in the order of the vertices at
  which half-edges start (text: one constraint)
- attached vertices: they have the same mass as all other vertices and are moved back after each step, so their part of a correction
  is lost (text: their w is 0, line 2)
- volume: its change is divided by 6 but its gradient is not, so a step removes a sixth of the error (text: eq. 5.18 to 5.21 omit
  the 6 in both)
- folds: a fold is opened if it is sharper than at rest, and never closed; it is unchanged if it is nearly flat, or if the
  correction would be small or very large (text: eq. 5.22 preserves each angle)
- sweeps: each step has one sweep over the constraints, after which collisions are detected (text: many sweeps, line 15, and
  collisions are detected first, line 13)
- time: each step of an iteration has the duration of the iteration (text: section 6.1 divides it), but time cancels without forces
- collisions: vertices collide with voxels (text: with triangles, section 6.1.1), in the frame of the bone at rest. Voxels that a
  flood fill from one corner does not reach are inside. A vertex that was inside before the step moves by the last motion of the
  bone, in every step, even after the bone has stopped; a vertex that enters is moved back in steps of one voxel; if two bones move
  a vertex, the later bone takes precedence. Voxels are aligned with the axes at rest, and a single voxel can decide where a vertex
  goes: if the scene of hip_flexion is rotated, positions of vertices differ by up to 57 mm (mean 4.5 mm; without voxels 1e-8 mm)

Frame number n is the state after iteration n.

The recorded squeezed box is reproduced in all 300 iterations, to the last digit in single precision. This requires the program's
order of arithmetic operations, so the projections of ``pbd`` cannot be used here. The squeezed box is chaotic: a relative
difference of 1e-15, at rest or from the order of a sum, grows to 3 mm at iteration 100. The recorded program was compiled by gcc
with the program's flags, among them -Ofast (gcc 12 on x86-64 reproduces it; with -O0, -O2, -O3, -march=native or -mfma the result
differs after at most 50 iterations). For the same reason the pose of a bone is the product of its motions, and the rest angle of
flat pairs has an error of 2e-8 rad.

This solver differs from the program in two respects. The scene defines the attached vertices, whereas the program attaches all
vertices in the voxels of a bone at rest. The direction of a fibre follows its points, whereas the program mixes points of several
fibres.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Annotated

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from fem_reference.foundations.mesh import Floats, Ints, Surface
from fem_reference.foundations.motion import apply
from fem_reference.foundations.records import Record
from fem_reference.problems.setup import Bone, Setup
from fem_reference.runs.store import Outcome, Sink
from fem_reference.solvers import program_kernels as kernels
from fem_reference.solvers.common.frame_loop import MovingSurface, carry, follow, timed
from fem_reference.solvers.common.protocol import MuscleSolver, TableRow, Trade
from fem_reference.solvers.pbd import PbdConstraints, along_fibres
from fem_reference.solvers.pbd_kernels import distances

# The time step [s], which cancels up to rounding.
STEP = 1e-3
# The number of decimal places to which the motion between two poses is rounded: 90 mm in 100 iterations is exactly 0.9 mm in each.
DIGITS = 12


class ProgramSettings(Record):
    """Settings of the report's program; every key is required except ``voxels`` and ``anisotropy``.

    ``sub_iterations``: the number of steps in each iteration, 3 in section 6.1 of the report. ``damping``: the fraction of each
    velocity that is lost in a step, 0.01 in the program. ``bending``: a factor on the correction of dihedral angles, 0.9 in the
    program. ``voxels``: the number of voxels along each side of a bone's bounding box, 64 in the program; without this key there is
    no contact. ``anisotropy``: the exponent a in the stiffness (1 - |cos|)^a of an edge, with the cosine of the angle between the
    edge and the nearest fibre; a = 1 in the program. Without this key the stiffness is 1, as in the program without fibres.
    """

    sub_iterations: Annotated[int, Field(gt=0), Trade((1, 3, 10))]
    damping: Annotated[float, Field(ge=0, le=1)]
    bending: Annotated[float, Field(ge=0, le=1)]
    voxels: Annotated[Annotated[int, Field(gt=0, le=256)] | None, Trade((32, 64, 128))] = None
    anisotropy: Annotated[float, Field(ge=0)] | None = None


@dataclass(frozen=True, eq=False)
class Voxels:
    """A bone as a box of k^3 voxels.

    ``inside`` (k, k, k): a mask of the voxels inside the bone. ``lower`` (3,) [mm]: the lower corner of the box. ``size`` (3,)
    [mm]: the size of a voxel.
    """

    inside: NDArray[np.bool_]
    lower: Floats
    size: Floats

    @classmethod
    def of(cls, surface: Surface, count: int) -> "Voxels":
        """The ``count``^3 voxels in the bounding box of a bone; in a direction in which the box is flat they are 1 mm thick."""
        points, border = np.array(surface.points), np.zeros((count,) * 3, np.bool_)
        size = np.ptp(points, axis=0) / count
        empty = cls(border, points.min(axis=0), np.where(size > 0, size, 1.0))
        kernels.mark(border, points, empty.places(points), np.array(surface.triangles))
        return replace(empty, inside=~kernels.flood(border))

    def places(self, points: Floats) -> Floats:
        """The positions (n, 3) [voxels] of ``points`` (n, 3) [mm], relative to the lower corner."""
        return (points - self.lower) * (1 / self.size)

    def points(self, places: Floats) -> Floats:
        """The points (n, 3) [mm] at the positions ``places`` (n, 3) [voxels], relative to the lower corner."""
        return places * self.size + self.lower


class VoxelBone:
    """A moving bone that consists of voxels.

    ``voxels``: the voxels of the bone at rest. ``pose`` (4, 4): the present pose, which is the product of all motions, as in the
    program, and differs from the ``given`` pose by rounding. ``last`` (4, 4): the last motion between two different poses.
    """

    def __init__(self, body: Bone, count: int, frame: int) -> None:
        self.body, self.voxels = body, Voxels.of(body.surface, count)
        self.given = self.pose = body.pose(frame)
        self.last = np.eye(4)

    def move(self, frame: int) -> None:
        """Move the bone to its pose at ``frame``."""
        given = self.body.pose(frame)
        if not np.array_equal(given, self.given):
            self.last = np.round(given @ np.linalg.inv(self.given), DIGITS)
            self.given, self.pose = given, self.last @ self.pose

    def move_out(self, reached: Floats, starts: Floats, goals: Floats) -> None:
        """Correct, in place, the positions ``reached`` (n, 3) [mm] of vertices that move from ``starts`` to ``goals`` (n, 3)."""
        back, voxels = np.linalg.inv(self.pose), self.voxels
        before, after = apply(back, starts), apply(back, goals)
        first, last = voxels.places(before), voxels.places(after)
        stuck = kernels.are_inside(voxels.inside, first)
        entered = kernels.are_inside(voxels.inside, last) & ~stuck
        reached[stuck] = apply(self.pose, apply(self.last, before[stuck]))
        displacements = (before - after)[entered] * (1 / voxels.size)
        ends, too_far = kernels.march_out(voxels.inside, last[entered], displacements)
        reached[entered] = apply(self.pose, np.where(too_far[:, None], before[entered], voxels.points(ends)))


def half_edges_of(triangles: Ints) -> Ints:
    """The half-edges (3 m, 2) of ``triangles`` (m, 3), ordered by their start vertex and then by triangle."""
    sides = np.stack([triangles, np.roll(triangles, -1, axis=1)], axis=2).reshape(-1, 2)
    return np.asarray(sides[np.argsort(sides[:, 0], kind="stable")])


def hinges_of(points: Floats, triangles: Ints) -> tuple[Ints, Floats]:
    """The hinges (e, 4) of a closed surface and their dihedral angles (e,) [rad].

    There is one hinge for each edge; hinges are in the order of the later of their two triangles. A hinge lists both ends of the
    edge, the opposite vertex in the earlier triangle, and the opposite vertex in the later triangle.
    """
    opposite, starts, ends = (np.roll(triangles, -corner, axis=1).ravel() for corner in range(3))
    sides = np.lexsort((np.maximum(starts, ends), np.minimum(starts, ends))).reshape(-1, 2)
    earlier, later = sides[np.argsort(sides[:, 1])].T
    hinges = np.column_stack([starts[later], ends[later], opposite[earlier], opposite[later]])
    pairs = np.column_stack([earlier, later]) // 3
    return hinges, kernels.angles_of(kernels.normals_of(points, triangles), pairs)


def constraints_of(setup: Setup, settings: ProgramSettings) -> PbdConstraints:
    """The constraints of the surface at rest. All vertices have the same mass."""
    points, triangles = np.array(setup.surface.points), np.array(setup.surface.triangles)
    edges, (hinges, angles) = half_edges_of(triangles), hinges_of(points, triangles)
    share = np.ones(len(edges))
    if settings.anisotropy is not None:
        fibres = setup.rest.fibres
        assert fibres is not None  # with these settings the solver gets fibres
        share = (1 - along_fibres(points, edges, fibres)) ** settings.anisotropy
    return PbdConstraints(
        inverse_masses=np.ones(len(points)),
        edges=edges,
        lengths=distances(points, edges),
        share=share,
        triangles=triangles,
        six_volumes=kernels.six_volumes(points, triangles)[0],
        hinges=hinges,
        angles=angles,
    )


def solve(setup: Setup, settings: ProgramSettings, sink: Sink) -> Outcome:
    """Iterate from rest at the first of ``setup.frames`` to the last; each requested frame goes to ``sink``."""
    return follow(timed(ProgramSurface, setup, settings), setup, sink)


class ProgramSurface(MovingSurface):
    """A surface with its constraints, the ``velocity`` (n, 3) [mm/s] of its vertices, and ``bones`` that consist of voxels."""

    def __init__(self, setup: Setup, settings: ProgramSettings) -> None:
        super().__init__(setup)
        self.settings, self.constraints = settings, constraints_of(setup, settings)
        self.velocity, self.bones = np.zeros_like(self.points), list[VoxelBone]()
        if settings.voxels is not None:
            self.bones = [VoxelBone(body, settings.voxels, setup.frames[0]) for body in setup.bones]
        self.cost["projections"] = 0.0

    def move(self, number: int) -> None:
        """Run one iteration, up to frame ``number``."""
        carry(self.points, self.setup, number)
        for bone in self.bones:
            bone.move(number)
        points, attached = self.points, self.setup.attached_vertices
        for _ in range(self.settings.sub_iterations):
            goals = (1 - self.settings.damping) * self.velocity * STEP + points
            project(goals, self.constraints, self.settings.bending)
            reached = collided(points, goals, self.bones)
            reached[attached] = points[attached]
            points, self.velocity = reached, (reached - points) * (1 / STEP)
        self.points = points
        self.cost["projections"] += self.constraints.count * self.settings.sub_iterations


def project(points: Floats, at: PbdConstraints, bending: float) -> None:
    """Sweep once over all constraints, which moves ``points`` (n, 3) [mm] in place."""
    kernels.project_edges(points, at.edges, at.lengths, at.share)
    kernels.project_volume(points, at.triangles, at.six_volumes)
    kernels.project_folds(points, at.hinges, at.angles, bending)


def collided(starts: Floats, goals: Floats, bones: Sequence[VoxelBone]) -> Floats:
    """The positions (n, 3) [mm] of vertices that move from ``starts`` to ``goals`` (n, 3) [mm] and may collide with ``bones``."""
    reached = goals.copy()
    for bone in bones:
        bone.move_out(reached, starts, goals)
    return reached


_EXAMPLE = {"sub_iterations": 3, "damping": 0.01, "bending": 0.9, "voxels": 64, "anisotropy": 1.0}

# The settings of the report's program.
_TABLE = TableRow("PBD", "pbd_program", {"sub_iterations": 3, "damping": 0.01, "bending": 0.9, "voxels": 64})
SOLVES = (
    MuscleSolver(
        settings=ProgramSettings,
        solve=solve,
        example=_EXAMPLE,
        depends_on=("order", "size"),
        table=(_TABLE,),
        fibres=lambda settings: settings.anisotropy is not None,
    ),
)
