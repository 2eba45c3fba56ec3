"""The report's own program for position based dynamics, reimplemented so that it reproduces the recorded output.

The program (github.com/cervenkam/muscle-deformation-PBD) differs from the report's text, section 5.5.3 and Algorithm 1:

- edges: each is projected twice in a sweep, as a half-edge of either triangle, vertex by vertex (text: one constraint)
- attached vertices weigh as much as all others and are moved back after each step, so their share of a correction is lost
  (text: their w is 0, line 2)
- volume: its change is divided by 6 but its gradient is not, which removes a sixth of the error in a step (text:
  eq. 5.18 to 5.21 drop the 6 in both)
- folds: opened if they are sharper than at rest, never closed, and not changed if they are nearly flat or the correction would be
  small or very large (text: eq. 5.22 keeps every angle)
- one sweep over the constraints in each step; only then are collisions found (text: many sweeps, line 15; found first,
  line 13)
- time: each step of an iteration lasts as long as all steps together should (text: section 6.1 divides it), but without forces time
  cancels
- collisions: of vertices with voxels (text: section 6.1.1 has triangles), in the bone's frame at rest. Voxels that a flood fill
  from one corner does not reach are inside. A vertex that was inside before moves by the bone's last motion, step after step, even
  after the bone has come to rest; a vertex that enters is moved back in steps of one voxel; if two bones move a vertex, the later
  bone takes precedence. Voxels are aligned with the axes at rest, and a single voxel decides where a vertex goes: if the scene is
  rotated, vertices of the case hip_flexion differ by up to 57 mm (mean 4.5 mm; without voxels 1e-8 mm)

Frame number n is the state after iteration n.

The recorded squeezed box is reproduced in all 300 iterations, to the last digit of its single precision. This requires the order
of arithmetic of the program, so no projection is shared with ``pbd``: the squeezed box is chaotic, and a difference of 1e-15, at
rest or from the order of a sum, grows to 3 mm at iteration 100. The recorded program was compiled by gcc with its own flags, among
them -Ofast (gcc 12 on x86-64 reproduces it; with -O0, -O2, -O3, -march=native or -mfma the result differs by iteration 50). For the
same reason a bone's pose is the product of its motions, and the rest angle of flat pairs has an error of 2e-8 rad.

Two things differ from the program: the scene defines the attached vertices (in the program, all vertices in the voxels of a bone at
rest), and a fibre's direction follows its own points (in the program, points of several fibres).
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

# The time step [s]; it cancels, up to rounding.
STEP = 1e-3
# Decimal places to which the motion between two poses is rounded, so that 90 mm in 100 iterations is exactly 0.9 mm in each.
DIGITS = 12


class ProgramSettings(Record):
    """Settings of the program; every key is required except the keys that add an effect.

    ``sub_iterations``: steps in each iteration, 3 in section 6.1 of the report. ``damping``: the fraction of every velocity that
    is lost in a step, 0.01 in the program. ``bending``: a factor on the correction of a dihedral angle, 0.9 in the program.
    ``voxels``: their number along each side of a bone's bounding box, 64 in the program; without this key there is no contact.
    ``anisotropy`` a: the stiffness of an edge is (1 - |cos|)^a, with the cosine of its angle to the nearest fibre; a = 1 in the
    program. Without this key the stiffness is 1, as in the program without fibres.
    """

    sub_iterations: Annotated[int, Field(gt=0), Trade((1, 3, 10))]
    damping: Annotated[float, Field(ge=0, le=1)]
    bending: Annotated[float, Field(ge=0, le=1)]
    voxels: Annotated[Annotated[int, Field(gt=0, le=256)] | None, Trade((32, 64, 128))] = None
    anisotropy: Annotated[float, Field(ge=0)] | None = None


@dataclass(frozen=True, eq=False)
class Voxels:
    """A box of k^3 voxels: the mask ``inside`` (k, k, k) of a bone, the ``lower`` corner (3,), and a voxel's ``size`` (3,) [mm]."""

    inside: NDArray[np.bool_]
    lower: Floats
    size: Floats

    @classmethod
    def of(cls, surface: Surface, count: int) -> "Voxels":
        """The ``count``^3 voxels in the box around a bone; if the box is flat they are 1 mm thick."""
        points, border = np.array(surface.points), np.zeros((count,) * 3, np.bool_)
        size = np.ptp(points, axis=0) / count
        empty = cls(border, points.min(axis=0), np.where(size > 0, size, 1.0))
        kernels.mark(border, points, empty.places(points), np.array(surface.triangles))
        return replace(empty, inside=~kernels.flood(border))

    def places(self, points: Floats) -> Floats:
        """Points (n, 3) [mm] as positions in units of voxels from the lower corner."""
        return (points - self.lower) * (1 / self.size)

    def points(self, places: Floats) -> Floats:
        """Positions ``places`` (n, 3) in units of voxels from the lower corner as points [mm]."""
        return places * self.size + self.lower


class VoxelBone:
    """The ``voxels`` of a bone in its rest pose, its present ``pose``, and its ``last`` motion that was not zero; both 4 x 4.

    The pose is the product of all motions, as in the program; it differs from the ``given`` pose by rounding.
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
        """Correct, in place, the positions ``reached`` (n, 3) [mm] of vertices on their way from ``starts`` to ``goals`` (n, 3)."""
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
    """The sides of all triangles, (3 m, 2), ordered by the vertices at which they start, then by triangles."""
    sides = np.stack([triangles, np.roll(triangles, -1, axis=1)], axis=2).reshape(-1, 2)
    return np.asarray(sides[np.argsort(sides[:, 0], kind="stable")])


def hinges_of(points: Floats, triangles: Ints) -> tuple[Ints, Floats]:
    """The hinges (e, 4) of a closed surface and their angles (e,) [rad], one per edge, in the order of its later triangle.

    A hinge: both ends of the edge, then the vertices opposite the edge in the earlier and in the later of its triangles.
    """
    opposite, starts, ends = (np.roll(triangles, -corner, axis=1).ravel() for corner in range(3))
    sides = np.lexsort((np.maximum(starts, ends), np.minimum(starts, ends))).reshape(-1, 2)
    earlier, later = sides[np.argsort(sides[:, 1])].T
    hinges = np.column_stack([starts[later], ends[later], opposite[earlier], opposite[later]])
    pairs = np.column_stack([earlier, later]) // 3
    return hinges, kernels.angles_of(kernels.normals_of(points, triangles), pairs)


def constraints_of(setup: Setup, settings: ProgramSettings) -> PbdConstraints:
    """The constraints of the surface at rest; every vertex weighs the same."""
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
    """Iterate from rest at the first of ``setup.frames`` to the last of them; each requested frame goes into ``sink``."""
    return follow(timed(ProgramSurface, setup, settings), setup, sink)


class ProgramSurface(MovingSurface):
    """A surface with its constraints, the ``velocity`` (n, 3) [mm/s] of its vertices, and bones of voxels."""

    def __init__(self, setup: Setup, settings: ProgramSettings) -> None:
        super().__init__(setup)
        self.settings, self.constraints = settings, constraints_of(setup, settings)
        self.velocity, self.bones = np.zeros_like(self.points), list[VoxelBone]()
        if settings.voxels is not None:
            self.bones = [VoxelBone(body, settings.voxels, setup.frames[0]) for body in setup.bones]
        self.cost["projections"] = 0.0

    def move(self, number: int) -> None:
        """Run one iteration."""
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
    """One sweep over the constraints, which moves ``points`` (n, 3) [mm] in place."""
    kernels.project_edges(points, at.edges, at.lengths, at.share)
    kernels.project_volume(points, at.triangles, at.six_volumes)
    kernels.project_folds(points, at.hinges, at.angles, bending)


def collided(starts: Floats, goals: Floats, bones: Sequence[VoxelBone]) -> Floats:
    """The positions (n, 3) [mm] that vertices on their way from ``starts`` to ``goals`` (n, 3) reach among ``bones``."""
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
