"""An implicit muscle surface, represented by a few Gaussians that follow the bones: the goal of section 7.1 of the report.

The surface at rest is approximated by Gaussians with four parameters each (``geometry.gaussian_surface``). At each frame number

- a few points of each attachment move with its bone, and the centres of the Gaussians are positioned so that, in a graph of these
  points and centres, each node moves as rigidly as possible with its neighbours (eq. 5.10 with tens of nodes);
- centres are pushed away from bones that the surface has entered, and vertices that are still inside a bone are moved out;
- each radius is divided by the square root of the stretch along the muscle near its centre, as stretched fibres become thinner;
  then a common factor on all radii restores the volume at rest.

A vertex moves with the Gaussians that form the surface around it. It is then moved to the level of the implicit function that it
had at rest, so the error of the fit does not change. Attached vertices move exactly with their bones.
"""

from dataclasses import dataclass
from typing import Annotated

import numpy as np
from pydantic import Field
from scipy.sparse import csr_array
from scipy.spatial import cKDTree

from fem_reference.foundations.errors import InputError
from fem_reference.foundations.mesh import Floats, enclosed_volume
from fem_reference.foundations.motion import apply
from fem_reference.foundations.records import Record
from fem_reference.geometry.distance import farthest_points
from fem_reference.geometry.gaussian_surface import GaussianSurface, fit
from fem_reference.problems.setup import Setup
from fem_reference.runs.store import Outcome, Sink
from fem_reference.solvers.arap import GlobalStep
from fem_reference.solvers.arap_kernels import VertexCells, fit_rotations
from fem_reference.solvers.common.frame_loop import MovingSurface, carry, follow
from fem_reference.solvers.common.protocol import MuscleSolver, TableRow, Trade
from fem_reference.solvers.pbd_kernels import volume

# The number of neighbours of a node, and the number of nodes in an attachment.
_AROUND, _HANDLES = 8, 12
# The number of rounds that push centres out of bones, and the number of rounds that scale radii.
_PUSHES, _SCALINGS = 4, 3


class RbfSettings(Record):
    """Settings of the implicit surface.

    ``gaussians``: the number of Gaussians, each with four parameters. ``iterations``: the number of local and global steps at each
    frame number. ``volume``: preserve the enclosed volume by scaling the radii. ``contact``: push the muscle out of bones.
    """

    gaussians: Annotated[int, Field(ge=2), Trade((10, 30, 100))]
    iterations: Annotated[int, Field(gt=0), Trade((3, 10, 30))] = 10
    volume: bool = True
    contact: bool = False


@dataclass(frozen=True, eq=False)
class Cloud:
    """A graph of ``nodes`` (k, 3) [mm], given at rest, each of which moves as rigidly as possible with its neighbours.

    The first ``free`` nodes are centres of Gaussians. The remaining nodes are points of attachments with prescribed positions.
    ``cells``: the neighbours of each node. ``system``: the global step of ARAP.
    """

    nodes: Floats
    free: int
    cells: VertexCells
    system: GlobalStep

    @staticmethod
    def of(centres: Floats, given: Floats) -> "Cloud":
        """The graph of free ``centres`` (m, 3) and prescribed points ``given`` (k - m, 3), each connected to its neighbours.

        Raises InputError if some centres are not connected to any attachment.
        """
        nodes, free = np.concatenate([centres, given]), len(centres)
        count = len(nodes)
        _, near = cKDTree(nodes).query(nodes, k=min(_AROUND + 1, count))
        near = near[:, 1:]
        ends = np.repeat(np.arange(count), near.shape[1]), near.ravel()
        either = csr_array((np.ones(near.size), ends), shape=(count, count))
        either = csr_array(either + either.T)
        starts, neighbours = either.indptr.astype(np.int64), either.indices.astype(np.int64)
        cells = VertexCells(nodes, starts, neighbours, np.ones(len(neighbours)))
        system = GlobalStep.of(cells, np.arange(free, count), "remove")
        if len(system.loose):
            raise InputError("gaussians", f"{free}, some not connected to any attachment", "more Gaussians, or fewer")
        return Cloud(nodes, free, cells, system)

    def gradients(self, now: Floats) -> Floats:
        """The sum (k, 3, 3), for each node, of the outer products of its edges at the positions ``now`` with those at rest."""
        one, other = np.repeat(np.arange(len(now)), np.diff(self.cells.starts)), self.cells.neighbours
        found = np.zeros((len(now), 3, 3))
        np.add.at(found, one, (now[one] - now[other])[:, :, None] * (self.nodes[one] - self.nodes[other])[:, None])
        return found

    def rotations(self, now: Floats) -> Floats:
        """The rotations (k, 3, 3) of the cells of the nodes at the positions ``now`` (k, 3)."""
        return fit_rotations(now, self.cells)

    def relax(self, now: Floats, iterations: int) -> Floats:
        """Positions (k, 3) [mm] of the nodes after local and global steps that start from the positions ``now`` (k, 3)."""
        for _ in range(iterations):
            now = self.system.place(now, self.rotations(now))
        return now

    def stretch(self, now: Floats, along: Floats) -> Floats:
        """The stretch (k,) near each node in the directions ``along`` (k, 3) at rest, for nodes at the positions ``now`` (k, 3)."""
        spread = self.gradients(self.nodes)
        small = 1e-3 * np.trace(spread, axis1=1, axis2=2)[:, None, None] * np.eye(3)
        gradients = (self.gradients(now) + self.rotations(now) @ small) @ np.linalg.inv(spread + small)
        return np.asarray(np.linalg.norm(np.einsum("kij,kj->ki", gradients, along), axis=1))


class RbfMuscle(MovingSurface):
    """The muscle as an implicit surface, advanced from each frame number to the next."""

    advice = "a slower motion, more iterations or contact = false may help"

    def __init__(self, setup: Setup, settings: RbfSettings) -> None:
        super().__init__(setup)
        rest, vertices = setup.surface, setup.attached_vertices
        self.settings, self.fitted = settings, fit(rest, settings.gaussians)
        self.level, _, self.shares = self.fitted.level(rest.points)
        parts = [entry.vertices for entry in setup.attached]
        self.handles = [part[farthest_points(rest.points[part], _HANDLES)] for part in parts]
        self.cloud = Cloud.of(self.fitted.centres, rest.points[np.concatenate(self.handles)])
        away, nearest = cKDTree(rest.points[vertices]).query(rest.points)
        self.nearest, self.beside = vertices[nearest], np.exp(-((away / np.median(self.fitted.radii)) ** 2))
        first, last = (rest.points[setup.attached[i].vertices].mean(axis=0) for i in (0, -1))
        direction = (last - first) / max(float(np.linalg.norm(last - first)), np.finfo(float).tiny)
        self.along = np.broadcast_to(direction, self.cloud.nodes.shape)  # from the first attachment towards the last
        self.volume = enclosed_volume(rest.points, rest.triangles)
        self.nodes = self.cloud.nodes
        self.cost["unknowns"] = 4.0 * settings.gaussians
        self.cloud.relax(self.nodes, 1)  # compiles the code, so that this time is not part of the first frame

    def move(self, number: int) -> None:
        """Advance the muscle to frame ``number``."""
        count, setup, rest = self.cloud.free, self.setup, self.fitted
        poses = zip(setup.attached, self.handles, strict=True)
        given = [apply(entry.bone.pose(number), setup.surface.points[handles]) for entry, handles in poses]
        nodes = self.cloud.relax(np.concatenate([self.nodes[:count], *given]), self.settings.iterations)
        points = self._carried(nodes)
        for _ in range(_PUSHES if self.settings.contact else 0):
            push = self._pushes(points, number)
            hit = np.maximum(self.shares.T @ np.any(push, axis=1), 1.0)
            shift = (self.shares.T @ push) / hit[:, None]
            points, nodes[:count] = points + self.shares @ shift, nodes[:count] + shift
        radii = rest.radii / np.sqrt(self.cloud.stretch(nodes, self.along)[:count])
        self.points, self.nodes = self._settled(GaussianSurface(nodes[:count], radii), points, number), nodes

    def _carried(self, nodes: Floats) -> Floats:
        """Positions (n, 3) [mm] of vertices that move with the Gaussians around them, given the positions ``nodes`` (k, 3)."""
        turns, count = self.cloud.rotations(nodes), self.cloud.free
        shifts = nodes[:count] - np.einsum("mij,mj->mi", turns[:count], self.fitted.centres)
        turned = np.einsum("nij,nj->ni", np.tensordot(self.shares, turns[:count], 1), self.setup.surface.points)
        return np.asarray(turned + self.shares @ shifts)

    def _pushes(self, points: Floats, number: int) -> Floats:
        """The displacements (n, 3) [mm] that move vertices at ``points`` (n, 3) out of bones; 0 for a vertex outside all bones."""
        found, free = np.zeros_like(points), np.flatnonzero(self.setup.free)
        for bone in self.setup.bones:
            pose = bone.pose(number)
            sampled = bone.shape.sample(apply(np.linalg.inv(pose), points[free]))
            found[free] -= np.minimum(sampled.distance, 0)[:, None] * sampled.gradient @ pose[:3, :3].T
        return found

    def _settled(self, moved: GaussianSurface, points: Floats, number: int) -> Floats:
        """Positions (n, 3) [mm] of vertices that start from ``points`` (n, 3) and move to their levels of the implicit function.

        Attached vertices follow their bones. Depending on the settings, the volume is that at rest, and vertices are outside bones.
        """
        scale = 1.0
        for _ in range(_SCALINGS if self.settings.volume else 1):
            points = GaussianSurface(moved.centres, scale * moved.radii).project(points, self.level)
            bony = points.copy()
            carry(bony, self.setup, number)
            points += self.beside[:, None] * (bony - points)[self.nearest]
            carry(points, self.setup, number)  # attached vertices are exact, even if the implicit surface is far away
            scale *= float(np.cbrt(self.volume / enclosed_volume(points, self.setup.surface.triangles)))
        if self.settings.volume:  # moving free vertices along the gradient of the volume corrects the remaining error
            six, gradient = volume(points, self.setup.surface.triangles)
            gradient[self.setup.attached_vertices] = 0
            points += gradient * (6 * self.volume - six) / float((gradient**2).sum())
        if self.settings.contact:
            points += self._pushes(points, number)
        return points

    def ending(self) -> Outcome:
        """The outcome, always *converged*, as each state takes a fixed number of steps."""
        return Outcome("converged", f"{self.settings.gaussians} Gaussians, {4 * self.settings.gaussians} parameters")


def solve(setup: Setup, settings: RbfSettings, sink: Sink) -> Outcome:
    """Compute the muscle at every frame number. Raises InputError if the muscle has no attachments."""
    if not setup.attached:
        raise InputError("rbf_muscle", "a muscle without attachments", "attachments whose bones move it")
    return follow(RbfMuscle(setup, settings), setup, sink)


_TABLE = TableRow("Implicit RBF", "rbf_muscle", {"gaussians": 100, "contact": True})
SOLVES = (MuscleSolver(settings=RbfSettings, solve=solve, example={"gaussians": 10}, table=(_TABLE,)),)
