"""An implicit muscle of a few Gaussians that move with the bones: the goal of section 7.1 of the report.

The surface at rest is fitted by Gaussians with four parameters each (``geometry.gaussian_surface``). At each frame number

- the centres, and a few points of each attachment that move with its bone, move as rigidly as possible relative to their neighbours
  (eq. 5.10 on a graph of tens of nodes);
- centres are pushed away from bones that the surface has entered, and vertices that are still inside are moved out;
- each radius shrinks by the square root of the stretch along the muscle around its centre, as stretched fibres become thin; all
  radii are scaled together until the enclosed volume is the rest volume.

A vertex moves with the Gaussians that form the surface around it, and is then moved to the level of the implicit function that it
had at rest, so the error of the fit does not change. Attached vertices are exact.
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
# The number of rounds in which centres are pushed out of bones, and in which radii are scaled.
_PUSHES, _SCALINGS = 4, 3


class RbfSettings(Record):
    """``gaussians``: their number; each has four parameters. ``iterations``: local and global steps for each frame number.
    ``volume``: preserve the volume by changing the radii. ``contact``: avoid bones; by default off.
    """

    gaussians: Annotated[int, Field(ge=2), Trade((10, 30, 100))]
    iterations: Annotated[int, Field(gt=0), Trade((3, 10, 30))] = 10
    volume: bool = True
    contact: bool = False


@dataclass(frozen=True, eq=False)
class Cloud:
    """Nodes (k, 3) that move as rigidly as possible with their neighbours in ``cells``: first the ``free`` centres (their number),
    then the points of attachments, whose positions are given. ``system``: the global step.
    """

    nodes: Floats
    free: int
    cells: VertexCells
    system: GlobalStep

    @staticmethod
    def of(centres: Floats, given: Floats) -> "Cloud":
        """The cloud of free ``centres`` (m, 3) and ``given`` points (k - m, 3), each with its nearest neighbours."""
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
        """The sum (k, 3, 3) over the edges at each node of the outer product of the present edge and the edge at rest."""
        one, other = np.repeat(np.arange(len(now)), np.diff(self.cells.starts)), self.cells.neighbours
        found = np.zeros((len(now), 3, 3))
        np.add.at(found, one, (now[one] - now[other])[:, :, None] * (self.nodes[one] - self.nodes[other])[:, None])
        return found

    def rotations(self, now: Floats) -> Floats:
        """The rotation (k, 3, 3) around each node."""
        return fit_rotations(now, self.cells)

    def relax(self, now: Floats, iterations: int) -> Floats:
        """Nodes (k, 3) after local and global steps from ``now``."""
        for _ in range(iterations):
            now = self.system.place(now, self.rotations(now))
        return now

    def stretch(self, now: Floats, along: Floats) -> Floats:
        """The stretch (k,) around each node along directions (k, 3) at rest."""
        spread = self.gradients(self.nodes)
        small = 1e-3 * np.trace(spread, axis1=1, axis2=2)[:, None, None] * np.eye(3)
        gradients = (self.gradients(now) + self.rotations(now) @ small) @ np.linalg.inv(spread + small)
        return np.asarray(np.linalg.norm(np.einsum("kij,kj->ki", gradients, along), axis=1))


class RbfMuscle(MovingSurface):
    """The muscle, moved from each frame number to the next."""

    advice = "a slower motion, more iterations, or contact = false, may help"

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
        self.cloud.relax(self.nodes, 1)  # compiles the code here, outside the time of the first frame

    def move(self, number: int) -> None:
        """Move the muscle to frame ``number``."""
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
        """Vertices (n, 3) carried by the Gaussians, each of which moves rigidly."""
        turns, count = self.cloud.rotations(nodes), self.cloud.free
        shifts = nodes[:count] - np.einsum("mij,mj->mi", turns[:count], self.fitted.centres)
        turned = np.einsum("nij,nj->ni", np.tensordot(self.shares, turns[:count], 1), self.setup.surface.points)
        return np.asarray(turned + self.shares @ shifts)

    def _pushes(self, points: Floats, number: int) -> Floats:
        """The displacement (n, 3) [mm] of each vertex out of the bone that contains it."""
        found, free = np.zeros_like(points), np.flatnonzero(self.setup.free)
        for bone in self.setup.bones:
            pose = bone.pose(number)
            sampled = bone.shape.sample(apply(np.linalg.inv(pose), points[free]))
            found[free] -= np.minimum(sampled.distance, 0)[:, None] * sampled.gradient @ pose[:3, :3].T
        return found

    def _settled(self, moved: GaussianSurface, points: Floats, number: int) -> Floats:
        """Vertices (n, 3) on their levels and outside bones, attached vertices at their bones, with the rest volume."""
        scale = 1.0
        for _ in range(_SCALINGS if self.settings.volume else 1):
            points = GaussianSurface(moved.centres, scale * moved.radii).project(points, self.level)
            bony = points.copy()
            carry(bony, self.setup, number)
            points += self.beside[:, None] * (bony - points)[self.nearest]
            carry(points, self.setup, number)  # exactly, even if the surface of the Gaussians is far away
            scale *= float(np.cbrt(self.volume / enclosed_volume(points, self.setup.surface.triangles)))
        if self.settings.volume:  # free vertices correct the remaining error, along the gradient of the volume
            six, gradient = volume(points, self.setup.surface.triangles)
            gradient[self.setup.attached_vertices] = 0
            points += gradient * (6 * self.volume - six) / float((gradient**2).sum())
        if self.settings.contact:
            points += self._pushes(points, number)
        return points

    def ending(self) -> Outcome:
        """Converged: a fixed number of steps finds every state."""
        return Outcome("converged", f"{self.settings.gaussians} Gaussians, {4 * self.settings.gaussians} parameters")


def solve(setup: Setup, settings: RbfSettings, sink: Sink) -> Outcome:
    """Compute the muscle at every frame number."""
    if not setup.attached:
        raise InputError("rbf_muscle", "a muscle without attachments", "attachments whose bones move it")
    return follow(RbfMuscle(setup, settings), setup, sink)


_TABLE = TableRow("Implicit RBF", "rbf_muscle", {"gaussians": 100, "contact": True})
SOLVES = (MuscleSolver(settings=RbfSettings, solve=solve, example={"gaussians": 10}, table=(_TABLE,)),)
