"""Rigid bodies that push on material points of a body: pressure of the gap, with its tangent, added to what DOLFINx assembles."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from dolfinx import fem, la
from dolfinx.fem.petsc import NonlinearProblem, assign
from mpi4py import MPI
from petsc4py import PETSc

from fem_reference.contact import Contact, Obstruction, nearest_on_way
from fem_reference.mesh import Floats
from fem_reference.motion import apply
from fem_reference.solvers.fenicsx.pushed_points import PushedPoints


@dataclass(frozen=True, eq=False)
class Push:
    """What one obstruction does at n points: ``gap`` (n,) [mm], negative inside, ``pressure`` (n,) [MPa per rest area],
    ``traction`` (n, 3) and its ``slope`` (n, 3, 3) [MPa/mm]; in the obstruction's rest frame the points, ``local`` (n, 3) [mm],
    and the gradients of the gap, ``outward`` (n, 3).
    """

    gap: Floats
    pressure: Floats
    traction: Floats
    slope: Floats
    local: Floats
    outward: Floats


def push(law: Contact, obstruction: Obstruction, points: Floats, frame: float, allowed: Floats) -> Push:
    """What ``obstruction`` does, where it is at ``frame``, to ``points`` (n, 3) [mm] that feel ``allowed`` (n,) less depth."""
    pose = obstruction.pose(frame)
    turn = pose[:3, :3]
    local = (points - pose[:3, 3]) @ turn
    sampled = obstruction.shape.sample(local)
    pressure, change = law.pressure(sampled.distance + allowed)
    normal, curvature = sampled.gradient @ turn.T, turn @ sampled.curvature @ turn.T
    slope = change[:, None, None] * normal[:, :, None] * normal[:, None, :] + pressure[:, None, None] * curvature
    return Push(sampled.distance, pressure, pressure[:, None] * normal, slope, local, sampled.gradient)


class Pushes:
    """What obstructions do to this rank's pushed points."""

    def __init__(
        self,
        law: Contact,
        obstructions: tuple[Obstruction, ...],
        points: PushedPoints,
        unknowns: fem.Function,
        frame: float,
    ) -> None:
        """``frame``: where the body rests."""
        self.law, self.obstructions, self.points, self.unknowns, self.frame = law, obstructions, points, unknowns, frame
        none = np.zeros(len(points.areas))
        at_rest = [push(law, entry, points.rest, frame, none) for entry in obstructions]
        self.overlaps = [np.maximum(law.smoothing - one.gap, 0) if law.relaxed else none for one in at_rest]
        self.now: list[Push] = []
        self.update(frame)
        self.settle()

    def update(self, frame: float) -> None:
        """What obstructions do with the unknowns as they are and the obstructions where they are at ``frame``."""
        self.frame, share = frame, self.law.allowance(frame)
        points = self.points.positions(self.unknowns.x.array)
        self.now = [
            push(self.law, entry, points, frame, share * overlap)
            for entry, overlap in zip(self.obstructions, self.overlaps, strict=True)
        ]

    def tractions(self) -> Floats:
        """What all of them do together (n, 3) [MPa]."""
        return np.asarray(np.sum([one.traction for one in self.now], axis=0))

    def predicted(self, frame: float, moves: Floats) -> Floats:
        """As ``tractions``, if the unknowns made ``moves`` and the obstructions went on to ``frame``, linearly in both."""
        points = self.points.positions(self.unknowns.x.array)
        way = np.einsum("nk,nki->ni", self.points.basis, moves[self.points.dofs])
        found = self.tractions()
        for entry, one in zip(self.obstructions, self.now, strict=True):
            step = entry.pose(frame) @ np.linalg.inv(entry.pose(self.frame))
            found += np.einsum("nij,nj->ni", one.slope, way - (apply(step, points) - points))
        return found

    def residual(self, tractions: Floats) -> Floats:
        """The weak form of ``tractions`` (n, 3) over this rank's unknowns, ghosts too."""
        pushed = np.flatnonzero(tractions.any(axis=1))
        forces = -self.points.areas[pushed, None] * tractions[pushed]
        found = np.zeros(len(self.unknowns.x.array))
        np.add.at(found, self.points.dofs[pushed], self.points.basis[pushed, :, None] * forces[:, None, :])
        return found

    def tangent(self) -> Iterator[tuple[Any, Any]]:
        """The slope of the residual, cell by cell that is pushed: the unknowns (3 k,) and the matrix (3 k, 3 k)."""
        slope = np.sum([one.slope for one in self.now], axis=0)
        pushed = np.flatnonzero(slope.any(axis=(1, 2)))
        cells, where = np.unique(self.points.cells[pushed], return_index=True)
        some = self.points.take(pushed)
        stiff = -some.areas[:, None, None] * slope[pushed]
        for cell, first in zip(cells, where, strict=True):
            mine = some.cells == cell
            basis = some.basis[mine]
            size = 3 * basis.shape[1]
            yield some.dofs[first].ravel(), np.einsum("na,nij,nb->aibj", basis, stiff[mine], basis).reshape(size, size)

    def forces(self) -> dict[str, tuple[Floats, Floats]]:
        """By name of an obstruction, the force (3,) [N] that it exerts on this rank's points and its moment (3,) [N mm] about the
        origin.
        """
        points, areas = self.points.positions(self.unknowns.x.array), self.points.areas[:, None]
        return {
            entry.name: ((areas * one.traction).sum(axis=0), np.cross(points, areas * one.traction).sum(axis=0))
            for entry, one in zip(self.obstructions, self.now, strict=True)
        }

    def scalars(self, comm: MPI.Comm) -> dict[str, float]:
        """The greatest ``contact_depth`` [mm] and largest ``contact_pressure`` [MPa] at a point, the rest area that is pushed,
        ``contact_area`` [mm2], and how deep the deepest point that is pushed was at rest, ``overlap_at_rest`` [mm].
        """
        pushed = np.zeros(len(self.points.areas), bool)
        depth = pressure = overlap = 0.0
        for one, before in zip(self.now, self.overlaps, strict=True):
            pushed |= one.pressure > 0
            depth = max(depth, float(-one.gap.min(initial=0.0)))
            pressure = max(pressure, float(one.pressure.max(initial=0.0)))
            overlap = max(overlap, float(before.max(initial=0.0)) - self.law.smoothing)
        found = {
            "contact_depth": comm.allreduce(depth, MPI.MAX),
            "contact_pressure": comm.allreduce(pressure, MPI.MAX),
            "contact_area": comm.allreduce(float(self.points.areas[pushed].sum()), MPI.SUM),
        }
        return found | ({"overlap_at_rest": comm.allreduce(max(overlap, 0.0), MPI.MAX)} if self.law.relaxed else {})

    def deepest(self, comm: MPI.Comm) -> str:
        """Where the deepest point is, and in which obstruction."""
        points = self.points.positions(self.unknowns.x.array)
        mine = [
            (float(-one.gap.min()), entry.name, points[int(np.argmin(one.gap))].tolist())
            for entry, one in zip(self.obstructions, self.now, strict=True)
            if len(points)
        ]
        found = [one for rank in comm.allgather(mine) for one in rank]
        if not found:
            return "nowhere"
        depth, name, (x, y, z) = max(found)
        return f'{max(depth, 0.0):.2f} mm in "{name}" at ({x:.1f}, {y:.1f}, {z:.1f}) mm'

    def settle(self) -> None:
        """Take the present state as the one that the next step starts from."""
        self.settled, self.settled_at = self.now, self.frame

    def go_back(self) -> None:
        """Take up the settled state again, as the unknowns have."""
        self.now, self.frame = self.settled, self.settled_at

    def tunnelled(self, comm: MPI.Comm) -> str | None:
        """Where a point went through an obstruction since the last settled state: on its straight way through the obstruction's
        frame it was inside, deeper than at both ends, and it left on the other side. None where none did.
        """
        mine = [one for i in range(len(self.obstructions)) if (one := self._through(i))]
        found: list[tuple[float, str]] = [one for rank in comm.allgather(mine) for one in rank]
        return max(found)[1] if found else None

    def _through(self, i: int) -> tuple[float, str] | None:
        before, now, entry = self.settled[i], self.now[i], self.obstructions[i]
        ways = now.local - before.local
        # A gap is not known far away: what points outward there is the way back, and the way on.
        outward = [
            np.where(one.outward.any(axis=1)[:, None], one.outward, sign * ways)
            for one, sign in ((before, -1), (now, 1))
        ]
        turned = np.flatnonzero(np.einsum("ni,ni->n", *outward) < 0)
        on_way = nearest_on_way(entry, before.local[turned], ways[turned], self.law.smoothing)
        excess = np.minimum(np.minimum(before.gap, now.gap)[turned], 0) - on_way
        if not excess.max(initial=0.0) > self.law.smoothing:
            return None
        worst = int(np.argmax(excess))
        x, y, z = self.points.rest[turned[worst]]
        return float(
            excess[worst]
        ), f'the point that rests at ({x:.1f}, {y:.1f}, {z:.1f}) mm went through "{entry.name}"'


class Watched:
    """Newton's method of ``problem`` with the residual and the tangent of ``pushes`` added to what DOLFINx assembles.

    An obstruction that jumps to where it is at the next frame would meet points that have not moved yet, push them with forces
    that are no measure of anything, and send the first iteration astray. So that one is linear: it starts from the settled
    pushes and goes along with the obstructions.
    """

    def __init__(self, problem: NonlinearProblem, pushes: Pushes, conditions: list[Any]) -> None:
        self.problem, self.pushes, self.conditions, self.frame = problem, pushes, conditions, pushes.frame
        self.fresh = False
        unknowns = pushes.unknowns
        space = unknowns.function_space
        self.owned = space.dofmap.index_map.size_local * space.dofmap.index_map_bs
        self.work = la.vector(space.dofmap.index_map, space.dofmap.index_map_bs)
        self.free = np.ones(len(unknowns.x.array), bool)
        for condition in conditions:
            self.free[condition.dof_indices()[0]] = False
        snes = problem.solver
        self.assemble, _, self.context = snes.getFunction()[1]
        snes.setFunction(self.residual, problem.b)
        matrix, preconditioner, (self.linearise, _, self.linear_context) = snes.getJacobian()
        snes.setJacobian(self.tangent, matrix, preconditioner)

    def go_to(self, frame: float) -> None:
        """What the next solve is for."""
        self.frame, self.fresh = frame, True

    def residual(self, snes: Any, x: Any, b: Any) -> None:
        """What is out of balance at ``x``."""
        assign(x, self.problem.u)
        self.problem.u.x.scatter_forward()
        self.assemble(snes, x, b, **self.context)
        within = np.array(b.array)
        if self.fresh:
            self.fresh = False
            moves = np.zeros(len(self.free))
            for condition in self.conditions:
                condition.set(moves, self.problem.u.x.array, 1.0)
            b.array[:] = within + self.gathered(self.pushes.predicted(self.frame, moves))
            if b.norm() > snes.atol:  # else nothing moves by itself, and only the new gaps tell
                return
        self.pushes.update(self.frame)
        b.array[:] = within + self.gathered(self.pushes.tractions())

    def gathered(self, tractions: Floats) -> Floats:
        """The weak form of ``tractions`` over this rank's own unknowns, with what other ranks add to it; 0 where prescribed."""
        return np.asarray(self.everywhere(tractions)[: self.owned] * self.free[: self.owned])

    def everywhere(self, tractions: Floats) -> Floats:
        """The weak form of ``tractions`` over this rank's unknowns, where it is prescribed too."""
        self.work.array[:] = self.pushes.residual(tractions)
        self.work.scatter_reverse(la.InsertMode.add)
        return np.asarray(self.work.array)

    def tangent(self, snes: Any, x: Any, matrix: Any, preconditioner: Any) -> None:
        """The slope of the residual; the pushes are those of the residual, which comes before it."""
        self.linearise(snes, x, matrix, preconditioner, **self.linear_context)
        for dofs, block in self.pushes.tangent():
            places = np.where(self.free[dofs], dofs, -1).astype(PETSc.IntType)  # PETSc leaves out what is negative
            matrix.setValuesLocal(places, places, block, addv=PETSc.InsertMode.ADD)
        matrix.assemble()
