"""VIPER: a muscle as a bundle of rods that have volume, bend and twist, by position based dynamics.

Angles et al. (2019), doi:10.1145/3340260: a rod has points, each with a radius, and segments, each with a frame. It resists stretch
and shear, bend and twist (Kugelstadt and Schoemer 2016), and its segments keep their volume: the radii shrink where the rod is
stretched. Shape matching ties the rods of a bundle; its scale also scales the radii. The surface moves with the rods.

Each fibre of the case is a rod. For bend and twist, the bones nearest to its ends act like neighbouring segments. There is neither
mass nor time: a frame number begins with the previous state, moved by a blend of the bones' motions. A stiffness is a factor on the
corrections of a sweep, as in ``pbd``, so the result depends on ``iterations``. All rods have the same radius at rest, chosen so
that they fill the muscle's volume. Only rods keep their volume; the volume inside the surface may change.
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

# The number of neighbours of a rod in its bundle, and the number of rod points with which a vertex moves.
_AROUND, _CARRIERS = 6, 12


class ViperSettings(Record):
    """``points``: the number per rod. ``iterations``: sweeps over all constraints for each frame number. ``stretch``, ``bending``,
    ``volume``, ``bundle``: the stiffness of each kind of constraint in a sweep, from 0 (off) to 1. ``contact`` (default off): rods
    keep at least their radius, or the distance at rest if less, away from bones, and the surface is moved out of bones.
    """

    points: Annotated[int, Field(ge=4, le=1000), Trade((4, 6, 12))]
    iterations: Annotated[int, Field(gt=0), Trade((5, 20, 80))]
    stretch: Stiffness
    bending: Stiffness
    volume: Stiffness
    bundle: Stiffness
    contact: bool = False


class Bundle:
    """Rods at ``rest`` (k, p, 3) [mm] of one ``radius``. A section has one point of each rod; neighbours in it form groups.

    Each group, a point and its neighbours, has a rotation and a scale, fitted to points, radii and frames by least squares; the
    goal of a point is the mean over its groups.
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
        """The goals (k, p, 3) of ``points`` and (k, p) of ``radii`` [mm], for the present ``frames`` (k, p, 3, 3)."""
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
    """A muscle as ``rods`` (k, p, 3) [mm], with which its surface moves."""

    advice = "a slower motion, more iterations, or contact = false, may help"

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
        """Move the rods to frame ``number``, and the surface and fibres with them."""
        self._begin(number)
        for bone in (*self.bones, *self.skin_bones):
            bone.move(number)
        for _ in range(self.settings.iterations):
            if np.isfinite(self.rods).all() and np.isfinite(self.radii).all():
                self._sweep()
        self._carry(number)

    def _begin(self, number: int) -> None:
        """Move rods by a blend of the motions of the bones at their ends, and the end points exactly with these bones."""
        share, between = (np.linspace(0, 1, self.settings.points + i)[:, None] for i in (0, 1))
        first, last = (self._moved(ends, number) for ends in self.ends)
        self.rods = (1 - share) * first[0] + share * last[0]
        self.turns = kernels.unit((1 - between) * first[1] + between * last[1])
        for ends, i in zip(self.ends, (0, -1), strict=True):
            self.rods[:, i] = [apply(self.problem.bones[n].pose(number), self.rest[k, i]) for k, n in enumerate(ends)]
        self.last = number

    def _moved(self, ends: Ints, number: int) -> tuple[Floats, Floats]:
        """Points and turns of rods that move from the last frame number with the bones at one of their ends, ``ends`` (k,)."""
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
        """The rotation (k, p, 3, 3) at each point, halfway between the rotations of its segments."""
        before, after = self.turns[:, :-1], self.turns[:, 1:]
        sign = np.where(np.sum(before * after, axis=2, keepdims=True) < 0, -1.0, 1.0)
        return kernels.matrices(kernels.unit(before + sign * after))

    def _carry(self, number: int) -> None:
        """Move surface and fibres with the rods; each point of a rod rotates and scales its surroundings."""
        maps = (self.radii / self.radius)[..., None, None] * self._frames()
        shifts = self.rods - np.einsum("kpij,kpj->kpi", maps, self.rest)
        parts = np.concatenate([maps.reshape(-1, 9), shifts.reshape(-1, 3)], axis=1)
        self.points = _carried(self.problem.surface.points, self.of_surface @ parts)
        self.fibres = _carried(self.problem.fibres.points, self.of_fibres @ parts)
        carry(self.points, self.problem, number)
        move_out(self.points, self.skin_bones, 1.0)

    def frame(self, number: int) -> Frame:
        """Surface and fibres; scalars: the minimum and maximum over all segments of the ratio of volume to volume at rest."""
        ratio = kernels.volumes(self.rods, self.radii) / self.volumes
        scalars = {"rod_volume_min": float(ratio.min()), "rod_volume_max": float(ratio.max())}
        return Frame(number, self.points.copy(), self.fibres.copy(), scalars=scalars)

    def ending(self) -> Outcome:
        """Converged, as no iteration fails."""
        count, points = self.rest.shape[:2]
        return Outcome("converged", f"{count} rods of {points} points, of {self.radius:.3g} mm radius at rest")


def shares(points: Floats, carriers: Floats, count: int) -> csr_array:
    """Weights (n, m) of the ``count`` nearest ``carriers`` (m, 3) at ``points`` (n, 3), which fall to 0 at the next nearest."""
    asked = min(count + 1, len(carriers))
    away, near = (found.reshape(len(points), asked) for found in cKDTree(carriers).query(points, k=asked))
    reach = away[:, -1:] * (1 if asked > count else 2) + np.finfo(float).tiny
    # If all are equally near, all get the same weight.
    weights = (1 - (away / reach) ** 2) ** 2 + 1e-12
    weights /= weights.sum(axis=1, keepdims=True)
    rows = np.repeat(np.arange(len(points)), asked)
    return csr_array((weights.ravel(), (rows, near.ravel())), shape=(len(points), len(carriers)))


def _along_rods(lines: list[Floats], count: int) -> csr_array:
    """Weights (n, k * count) of rod points at the points of ``lines``, nonzero for both ends of the segment with the point."""
    shares_of = []
    for line in lines:
        travelled = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(line, axis=0), axis=1))])
        places, ends = travelled / travelled[-1] * (count - 1), np.arange(count)
        shares_of.append(csr_array(np.column_stack([np.interp(places, ends, hat) for hat in np.eye(count)])))
    return csr_array(block_diag(shares_of))


def _carried(rest: Floats, parts: Floats) -> Floats:
    """Points at ``rest`` (n, 3) [mm], each moved by a linear map and a shift: its row of ``parts`` (n, 12)."""
    return np.asarray(np.einsum("nij,nj->ni", parts[:, :9].reshape(-1, 3, 3), rest) + parts[:, 9:])


def solve(problem: MuscleProblem, settings: ViperSettings, sink: Sink) -> Outcome:
    """Compute the rods at every frame number."""
    return follow(Rods(problem, settings), problem, sink)


_USUAL = {"points": 6, "iterations": 20, "stretch": 1.0, "bending": 0.1, "volume": 1.0, "bundle": 1.0}
_TABLE = TableRow("VIPER", "viper", _USUAL | {"contact": True})
SOLVES = (MuscleSolver(settings=ViperSettings, solve=solve, example=_USUAL, table=(_TABLE,), fibres=lambda _: True),)
