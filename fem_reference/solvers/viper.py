"""VIPER: a muscle as a bundle of volume-preserving rods, simulated by position based dynamics.

The method is that of Angles et al. (2019), doi:10.1145/3340260. A rod consists of points, each with a radius, and of segments, each
with a frame. A rod resists stretch, shear, bending and twist (Kugelstadt and Schoemer 2016). Each segment keeps its volume, so the
radii shrink where the rod is stretched. Shape matching couples the rods of a bundle: it fits a rotation and a scale to each group
of neighbouring points, and the scale also applies to their radii. The surface of the muscle moves with the rods.

Here each fibre of the case is a rod. In the constraints on bending and twist, the bone nearest to each end of a rod acts like a
neighbouring segment. The solver is quasi-static and needs no masses. It advances by one frame number at a time: the initial guess
is the state at the previous frame number, moved by a blend of the motions of these two bones. A stiffness is a factor on the
corrections of a sweep, as in ``pbd``, so the result depends on ``iterations``. All rods have the same radius at rest, chosen so
that the rods together have the volume of the muscle. Only the rods keep their volume; the volume enclosed by the surface may
change.
"""

from typing import Annotated

import numpy as np
from pydantic import Field
from scipy.sparse import block_diag, csr_array
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation

from fem_reference.foundations.mesh import Floats, Ints, enclosed_volume
from fem_reference.foundations.motion import apply
from fem_reference.foundations.records import Record
from fem_reference.problems.muscle import MuscleProblem
from fem_reference.runs.store import Frame, Outcome, Sink
from fem_reference.solvers import viper_kernels as kernels
from fem_reference.solvers.collision_kernels import CollidingBone, colliding_bones, move_out
from fem_reference.solvers.common.frame_loop import MovingSurface, carry, follow
from fem_reference.solvers.common.lines import along, nearest_bones
from fem_reference.solvers.common.protocol import MuscleSolver, TableRow, Trade
from fem_reference.solvers.pbd import Stiffness

# The number of points in a group for shape matching (a point of a cross-section and those nearest to it), and the number of rod
# points that determine the motion of a vertex of the surface.
_AROUND, _CARRIERS = 6, 12


class ViperSettings(Record):
    """``points``: number of points of each rod. ``iterations``: sweeps over all constraints from each frame number to the next.
    ``stretch``, ``bending``, ``volume``, ``bundle`` (shape matching): stiffness of these constraints in a sweep, from 0 (off) to 1.
    ``contact``: if true, the distance of each rod point from bones is at least the rod radius (or its distance at rest, if that is
    less), and the surface is moved out of bones. The default is false.
    """

    points: Annotated[int, Field(ge=4, le=1000), Trade((4, 6, 12))]
    iterations: Annotated[int, Field(gt=0), Trade((5, 20, 80))]
    stretch: Stiffness
    bending: Stiffness
    volume: Stiffness
    bundle: Stiffness
    contact: bool = False


class Bundle:
    """Shape matching of the k rods of a bundle, each with p points.

    ``rest`` (k, p, 3) [mm]: points of the rods at rest. ``radius`` [mm]: radius of all rods at rest.

    A cross-section of the bundle contains one point of each rod. In a cross-section, each point and its nearest neighbours form a
    group. A rotation and a scale are fitted to the points, radii and frames of each group by least squares. The goal position of a
    point is the weighted mean over all groups that contain the point.
    """

    def __init__(self, rest: Floats, radius: float) -> None:
        self.rest, self.radius, self.middle = rest, radius, rest.mean(axis=(0, 1))
        self.sections = (rest - self.middle).swapaxes(0, 1)
        self.groups = np.array([shares(points, points, _AROUND).toarray() for points in self.sections])
        self.back = self.groups.swapaxes(1, 2) / self.groups.sum(axis=1)[..., None]
        self.means = self.groups @ self.sections
        sizes = self.groups @ (np.sum(self.sections**2, axis=2, keepdims=True) + 3 * radius**2)
        self.sizes = sizes[..., 0] - np.sum(self.means**2, axis=2)

    def goals(self, points: Floats, radii: Floats, frames: Floats) -> tuple[Floats, Floats]:
        """Goals (k, p, 3) of the points and goals (k, p) of the radii [mm].

        ``points`` (k, p, 3) and ``radii`` (k, p): present state [mm]. ``frames`` (k, p, 3, 3): present rotation at each point.
        """
        now = (points - self.middle).swapaxes(0, 1)
        parts = now[..., None] * self.sections[..., None, :]
        parts += (self.radius * radii.T)[..., None, None] * frames.swapaxes(0, 1)
        sums = self.groups @ np.concatenate([now, parts.reshape(*now.shape[:2], 9)], axis=2)
        means, spread = sums[..., :3], sums[..., 3:].reshape(*parts.shape)
        spread = spread - means[..., None] * self.means[..., None, :]
        u, _, v = np.linalg.svd(spread)
        u[..., 2] *= np.linalg.det(u @ v)[..., None]
        scales = np.sum(u @ v * spread, axis=(2, 3)) / self.sizes
        maps = scales[..., None, None] * (u @ v)
        shifts = means - np.einsum("pkij,pkj->pki", maps, self.means)
        found = self.back @ np.concatenate([maps.reshape(*now.shape[:2], 9), shifts, scales[..., None]], axis=2)
        wanted = np.einsum("pkij,pkj->pki", found[..., :9].reshape(*parts.shape), self.sections) + found[..., 9:12]
        return wanted.swapaxes(0, 1) + self.middle, self.radius * found[..., 12].T


class Rods(MovingSurface):
    """A muscle as k rods with p points each, and a surface that moves with them. ``rods`` (k, p, 3): present points [mm]."""

    advice = "a slower motion, more iterations or contact = false may help"

    def __init__(self, problem: MuscleProblem, settings: ViperSettings) -> None:
        super().__init__(problem)
        fibres, places = problem.fibres, np.linspace(0, 1, settings.points)
        lines = np.split(fibres.points, fibres.offsets[1:-1])
        rest = np.array([along(line, places.tolist()) for line in lines])
        self.problem, self.settings, self.rest, self.steps = problem, settings, rest, np.diff(rest, axis=1)
        inside = enclosed_volume(problem.surface.points, problem.surface.triangles)
        self.radius = float(np.sqrt(inside / np.pi / np.linalg.norm(self.steps, axis=2).sum()))
        self.bundle = Bundle(rest, self.radius)
        self.rods = problem.begin(rest.reshape(-1, 3)).reshape(rest.shape)
        self.radii = np.full(rest.shape[:2], self.radius)
        self.turns = np.tile([1.0, 0.0, 0.0, 0.0], (len(rest), settings.points + 1, 1))
        self.volumes = kernels.volumes(rest, self.radii)
        self.ends = [nearest_bones(problem, rest[:, end], "viper") for end in (0, -1)]
        self.last = problem.frames[0]
        self.fibres = problem.begin(fibres.points)
        self.of_surface = shares(problem.surface.points, rest.reshape(-1, 3), _CARRIERS)
        self.of_fibres = _along_rods(lines, settings.points)
        self.bones, self.skin_bones = list[CollidingBone](), list[CollidingBone]()
        if settings.contact:
            fixed = np.arange(rest[..., 0].size).reshape(rest.shape[:2])[:, [0, -1]].ravel()
            self.bones = colliding_bones(problem.bones, rest.reshape(-1, 3), fixed, self.radius)
            skin = problem.surface.points, problem.attached_vertices
            self.skin_bones = colliding_bones(problem.bones, *skin, 0.0)
        free = settings.points - 2
        self.cost["unknowns"] = float(len(rest) * (4 * free + 3 * (free + 1) + 2))

    def move(self, number: int) -> None:
        """Advance the rods, the surface and the fibres to frame ``number``."""
        self._begin(number)
        for bone in (*self.bones, *self.skin_bones):
            bone.move(number)
        for _ in range(self.settings.iterations):
            if np.isfinite(self.rods).all() and np.isfinite(self.radii).all():
                self._sweep()
        self._carry(number)

    def _begin(self, number: int) -> None:
        """Initial guess for frame ``number``: each rod moves by a blend of the motions of the two bones at its ends. The end points
        of the rod move exactly with these bones.
        """
        share, between = (np.linspace(0, 1, self.settings.points + i)[:, None] for i in (0, 1))
        first, last = (self._moved(ends, number) for ends in self.ends)
        self.rods = (1 - share) * first[0] + share * last[0]
        self.turns = kernels.unit((1 - between) * first[1] + between * last[1])
        for ends, i in zip(self.ends, (0, -1), strict=True):
            self.rods[:, i] = [apply(self.problem.bones[n].pose(number), self.rest[k, i]) for k, n in enumerate(ends)]
        self.last = number

    def _moved(self, ends: Ints, number: int) -> tuple[Floats, Floats]:
        """Points and rotations of the rods if each rod moved rigidly with one bone from the previous frame number to ``number``.

        ``ends`` (k,): the index of this bone for each rod.
        """
        points, turns = np.empty_like(self.rods), np.empty_like(self.turns)
        for n in np.unique(ends):
            bone = self.problem.bones[n]
            step = bone.pose(number) @ np.linalg.inv(bone.pose(self.last))
            quaternion = Rotation.from_matrix(step[:3, :3]).as_quat(canonical=True, scalar_first=True)
            points[ends == n] = apply(step, self.rods[ends == n].reshape(-1, 3)).reshape(-1, *points.shape[1:])
            turns[ends == n] = kernels.product(quaternion, self.turns[ends == n])
        return points, turns

    def _sweep(self) -> None:
        chosen = self.settings
        kernels.project_stretch(self.rods, self.turns, self.steps, chosen.stretch)
        kernels.project_bend(self.turns, chosen.bending)
        points, radii = self.bundle.goals(self.rods, self.radii, self._frames())
        self.rods[:, 1:-1] += chosen.bundle * (points - self.rods)[:, 1:-1]
        self.radii += chosen.bundle * (radii - self.radii)
        kernels.project_volume(self.rods, self.radii, self.volumes, chosen.volume)
        move_out(self.rods.reshape(-1, 3), self.bones, 1.0)

    def _frames(self) -> Floats:
        """Rotation (k, p, 3, 3) at each point, halfway between the rotations of the two adjacent segments."""
        before, after = self.turns[:, :-1], self.turns[:, 1:]
        sign = np.where(np.sum(before * after, axis=2, keepdims=True) < 0, -1.0, 1.0)
        return kernels.matrices(kernels.unit(before + sign * after))

    def _carry(self, number: int) -> None:
        """Move the surface and the fibres with the rods. Each point of a rod rotates and scales its surroundings."""
        maps = (self.radii / self.radius)[..., None, None] * self._frames()
        shifts = self.rods - np.einsum("kpij,kpj->kpi", maps, self.rest)
        parts = np.concatenate([maps.reshape(-1, 9), shifts.reshape(-1, 3)], axis=1)
        self.points = _carried(self.problem.surface.points, self.of_surface @ parts)
        self.fibres = _carried(self.problem.fibres.points, self.of_fibres @ parts)
        carry(self.points, self.problem, number)
        move_out(self.points, self.skin_bones, 1.0)

    def frame(self, number: int) -> Frame:
        """Surface and fibres at frame ``number``, and as scalars the minimum and maximum of V/V0 over all segments of rods."""
        ratio = kernels.volumes(self.rods, self.radii) / self.volumes
        scalars = {"rod_volume_min": float(ratio.min()), "rod_volume_max": float(ratio.max())}
        return Frame(number, self.points.copy(), self.fibres.copy(), scalars=scalars)

    def ending(self) -> Outcome:
        """The outcome, always "converged": the number of iterations is fixed, and there is no convergence criterion."""
        count, points = self.rest.shape[:2]
        return Outcome("converged", f"{count} rods with {points} points each and a rest radius of {self.radius:.3g} mm")


def shares(points: Floats, carriers: Floats, count: int) -> csr_array:
    """Sparse matrix (n, m) of the weights of m ``carriers`` (m, 3) at n ``points`` (n, 3); each row sums to 1.

    Only the ``count`` carriers nearest to a point have a weight. The weight decreases with the distance and reaches 0 at the
    distance of the next nearest carrier.
    """
    asked = min(count + 1, len(carriers))
    away, near = (found.reshape(len(points), asked) for found in cKDTree(carriers).query(points, k=asked))
    reach = away[:, -1:] * (1 if asked > count else 2) + np.finfo(float).tiny
    # The small constant gives equal weights to carriers that are all at the same distance; their weights would otherwise all be 0.
    weights = (1 - (away / reach) ** 2) ** 2 + 1e-12
    weights /= weights.sum(axis=1, keepdims=True)
    rows = np.repeat(np.arange(len(points)), asked)
    return csr_array((weights.ravel(), (rows, near.ravel())), shape=(len(points), len(carriers)))


def _along_rods(lines: list[Floats], count: int) -> csr_array:
    """Sparse matrix (n, k * count) of the weights of rod points at the n points of k fibres.

    ``lines``: points of each fibre. ``count``: number of points of each rod. A point of a fibre has linear weights for the two rod
    points between which it lies.
    """
    shares_of = []
    for line in lines:
        travelled = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(line, axis=0), axis=1))])
        places, ends = travelled / travelled[-1] * (count - 1), np.arange(count)
        shares_of.append(csr_array(np.column_stack([np.interp(places, ends, hat) for hat in np.eye(count)])))
    return csr_array(block_diag(shares_of))


def _carried(rest: Floats, parts: Floats) -> Floats:
    """Present positions (n, 3) [mm] of the points ``rest`` (n, 3) [mm].

    ``parts`` (n, 12): for each point the linear map (nine entries, row by row) and the translation (three entries) that move it.
    """
    return np.asarray(np.einsum("nij,nj->ni", parts[:, :9].reshape(-1, 3, 3), rest) + parts[:, 9:])


def solve(problem: MuscleProblem, settings: ViperSettings, sink: Sink) -> Outcome:
    """Solve a muscle with VIPER, advancing by one frame number at a time."""
    return follow(Rods(problem, settings), problem, sink)


_USUAL = {"points": 6, "iterations": 20, "stretch": 1.0, "bending": 0.1, "volume": 1.0, "bundle": 1.0}
_TABLE = TableRow("VIPER", "viper", _USUAL | {"contact": True})
SOLVES = (MuscleSolver(settings=ViperSettings, solve=solve, example=_USUAL, table=(_TABLE,), fibres=lambda _: True),)
