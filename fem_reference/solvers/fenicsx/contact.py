"""Contact of rigid bodies with material points of a body: pressure of the gap, with its tangent, added to what cells contribute.

Only points that may be near a body are asked for their distance to it: how far the others were when they were asked last, and how
far they moved since, says that they cannot be.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from dolfinx import fem
from mpi4py import MPI

from fem_reference.foundations.mesh import Floats, Ints
from fem_reference.foundations.motion import apply
from fem_reference.problems.contact import Contact, Nearby, Obstruction, nearest_on_path
from fem_reference.solvers.fenicsx.contact_points import ContactPoints


@dataclass(frozen=True, eq=False)
class Pressed:
    """What one obstruction does at the m of n points that are ``near``: ``gap`` (m,) [mm], negative inside, ``pressure`` (m,) [MPa
    per rest area], ``traction`` (m, 3) and its ``slope`` (m, 3, 3) [MPa/mm]; and in the obstruction's rest frame all points,
    ``local`` (n, 3) [mm]. No other point is within the smoothing.
    """

    near: Ints
    gap: Floats
    pressure: Floats
    traction: Floats
    slope: Floats
    local: Floats


class ContactForces:
    """What obstructions do to this rank's contact points."""

    def __init__(
        self,
        law: Contact,
        obstructions: tuple[Obstruction, ...],
        points: ContactPoints,
        unknowns: fem.Function,
        frame: float,
    ) -> None:
        """``frame``: where the body rests."""
        self.law, self.obstructions, self.points, self.unknowns, self.frame = law, obstructions, points, unknowns, frame
        count = len(points.areas)
        self.nearby = [Nearby(law, entry, count) for entry in obstructions]
        self.overlaps = [np.zeros(count) for _ in obstructions]
        self.update(frame)
        if law.relaxed:
            self.overlaps = [np.maximum(law.smoothing - one.gap, 0) for one in self.now]  # at first all points are near
            self.update(frame)
        self.settle()

    def update(self, frame: float) -> None:
        """What obstructions do with the unknowns as they are and the obstructions where they are at ``frame``."""
        self.frame = frame
        points = self.points.positions(self.unknowns.x.array)
        self.now = [self._pressed(i, points, frame) for i in range(len(self.obstructions))]

    def _pressed(self, i: int, points: Floats, frame: float) -> Pressed:
        """What an obstruction, where it is at ``frame``, does to ``points`` (n, 3) [mm]; they feel what overlaps at rest less."""
        pose, shape = self.obstructions[i].pose(frame), self.obstructions[i].shape
        turn = pose[:3, :3]
        local = (points - pose[:3, 3]) @ turn
        near = self.nearby[i].ask(local)
        sampled = shape.sample(local[near])
        self.nearby[i].note(near, local, sampled.distance)
        allowed = self.law.allowance(frame) * self.overlaps[i][near]
        pressure, change = self.law.pressure(sampled.distance + allowed)
        normal, curvature = sampled.gradient @ turn.T, turn @ sampled.curvature @ turn.T
        slope = change[:, None, None] * normal[:, :, None] * normal[:, None, :] + pressure[:, None, None] * curvature
        return Pressed(near, sampled.distance, pressure, pressure[:, None] * normal, slope, local)

    def tractions(self) -> Floats:
        """What all of them do together (n, 3) [MPa]."""
        found = np.zeros_like(self.points.rest)
        for one in self.now:
            found[one.near] += one.traction
        return found

    def predicted(self, frame: float, moves: Floats) -> Floats:
        """As ``tractions``, if the unknowns made ``moves`` and the obstructions went on to ``frame``, linearly in both."""
        points = self.points.positions(self.unknowns.x.array)
        displacement = self.points.positions(moves) - self.points.rest
        found = self.tractions()
        for entry, one in zip(self.obstructions, self.now, strict=True):
            step = entry.pose(frame) @ np.linalg.inv(entry.pose(self.frame))
            ahead = displacement[one.near] - (apply(step, points[one.near]) - points[one.near])
            found[one.near] += np.einsum("nij,nj->ni", one.slope, ahead)
        return found

    def add_residual(self, residual: Floats, tractions: Floats | None) -> None:
        """Add the weak form of ``tractions`` (n, 3), by default those at present, to ``residual`` over this rank's unknowns."""
        tractions = self.tractions() if tractions is None else tractions
        self.points.add_forces(residual, -self.points.areas[:, None] * tractions)

    def tangent(self) -> Iterator[tuple[Ints, Floats, Floats]]:
        """The slope of the residual, obstruction by obstruction: cells (p,) of the points in contact, the basis (p, k) that
        carries them, and the slope (p, 3, 3) of what is out of balance there.
        """
        for one in self.now:
            some = np.flatnonzero(one.slope.any(axis=(1, 2)))
            touched = one.near[some]
            areas = self.points.areas[touched, None, None]
            yield self.points.cells[touched], self.points.basis[touched], -areas * one.slope[some]

    def forces(self) -> dict[str, tuple[Floats, Floats]]:
        """By name of an obstruction, the force (3,) [N] that it exerts on this rank's points and its moment (3,) [N mm] about the
        origin.
        """
        points, found = self.points.positions(self.unknowns.x.array), {}
        for entry, one in zip(self.obstructions, self.now, strict=True):
            forces = self.points.areas[one.near, None] * one.traction
            found[entry.name] = forces.sum(axis=0), np.cross(points[one.near], forces).sum(axis=0)
        return found

    def scalars(self, comm: MPI.Comm) -> dict[str, float]:
        """The greatest ``contact_depth`` [mm] and largest ``contact_pressure`` [MPa] at a point, the rest area in contact,
        ``contact_area`` [mm2], and how deep the deepest point in contact was at rest, ``overlap_at_rest`` [mm].
        """
        touched = np.zeros(len(self.points.areas), bool)
        depth = pressure = overlap = 0.0
        for one, before in zip(self.now, self.overlaps, strict=True):
            touched[one.near[one.pressure > 0]] = True
            depth = max(depth, float(-one.gap.min(initial=0.0)))
            pressure = max(pressure, float(one.pressure.max(initial=0.0)))
            overlap = max(overlap, float(before.max(initial=0.0)) - self.law.smoothing)
        found = {
            "contact_depth": comm.allreduce(depth, MPI.MAX),
            "contact_pressure": comm.allreduce(pressure, MPI.MAX),
            "contact_area": comm.allreduce(float(self.points.areas[touched].sum()), MPI.SUM),
        }
        return found | ({"overlap_at_rest": comm.allreduce(max(overlap, 0.0), MPI.MAX)} if self.law.relaxed else {})

    def deepest(self, comm: MPI.Comm) -> str:
        """Where the deepest point is, and in which obstruction."""
        points = self.points.positions(self.unknowns.x.array)
        mine = [
            (float(-one.gap.min()), entry.name, points[one.near[int(np.argmin(one.gap))]].tolist())
            for entry, one in zip(self.obstructions, self.now, strict=True)
            if len(one.near)
        ]
        found = [one for rank in comm.allgather(mine) for one in rank]
        if not found:
            return "nowhere"
        depth, name, (x, y, z) = max(found)
        return f'{max(depth, 0.0):.2f} mm in "{name}" at ({x:.1f}, {y:.1f}, {z:.1f}) mm'

    def settle(self) -> None:
        """Take the present state as the one that the next step starts from."""
        self.settled, self.settled_at = self.now, self.frame
        for one in self.nearby:
            one.touched[:] = False

    def go_back(self) -> None:
        """Take up the settled state again, as the unknowns have."""
        self.now, self.frame = self.settled, self.settled_at

    def tunnelled(self, comm: MPI.Comm) -> str | None:
        """Where a point went through an obstruction since the last settled state: on its straight path through the obstruction's
        frame it was inside, deeper than at both ends, and it left on the other side. None where none did.
        """
        mine = [one for i in range(len(self.obstructions)) if (one := self._through(i))]
        found: list[tuple[float, str]] = [one for rank in comm.allgather(mine) for one in rank]
        return max(found)[1] if found else None

    def _through(self, i: int) -> tuple[float, str] | None:
        # A point that was not asked is in a ball without any of the obstruction, which it did not leave since the settled state.
        met = np.flatnonzero(self.nearby[i].touched)
        starts, ends = self.settled[i].local[met], self.now[i].local[met]
        before, now = (self.obstructions[i].shape.sample(places) for places in (starts, ends))
        displacements = ends - starts
        # A gap is not known far away: what points outward there is the direction back, and the direction on.
        outward = [
            np.where(one.gradient.any(axis=1)[:, None], one.gradient, sign * displacements)
            for one, sign in ((before, -1), (now, 1))
        ]
        turned = np.flatnonzero(np.einsum("ni,ni->n", *outward) < 0)
        on_path = nearest_on_path(self.obstructions[i], starts[turned], displacements[turned], self.law.smoothing)
        excess = np.minimum(np.minimum(before.distance, now.distance)[turned], 0) - on_path
        if not excess.max(initial=0.0) > self.law.smoothing:
            return None
        worst = int(np.argmax(excess))
        x, y, z = self.points.rest[met[turned[worst]]]
        where = f"the point that rests at ({x:.1f}, {y:.1f}, {z:.1f}) mm"
        return float(excess[worst]), f'{where} went through "{self.obstructions[i].name}"'
