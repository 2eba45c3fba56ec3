"""Contact of bones with material points of a body: the pressure as a function of the gap, and its tangent.

Distances are computed only for points that may be near a bone (``broad_phase``), and only points under pressure enter the sums. A
load step that begins and ends without contact pressure is solved without contact.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from dolfinx import fem
from mpi4py import MPI

from fem_reference.foundations.mesh import Floats, Ints, place_of
from fem_reference.foundations.motion import apply
from fem_reference.geometry.rigid_bodies import Sampled
from fem_reference.geometry.signed_distance import FAR
from fem_reference.problems.contact import ContactBone, ContactLaw, nearest_on_path
from fem_reference.solvers.common.state_checks import Trouble
from fem_reference.solvers.fenicsx.broad_phase import Nearby, Patches
from fem_reference.solvers.fenicsx.contact_points import ContactPoints
from fem_reference.solvers.fenicsx.friction import Friction, Grip
from fem_reference.solvers.fenicsx.spent import Spent

# A point deeper in a bone than this fraction of half the bone's thickness counts as having gone through.
_GIVEN_WAY = 0.75
# The straight path of a point that slides round a rim cuts through the rim. The depth of this cut may be at most this fraction of
# half the thickness, and at most the smoothing.
_RIM = 0.25


@dataclass(frozen=True, eq=False)
class Pressed:
    """Contact with one bone. ``near`` (m,): points near the bone, including all within the smoothing; ``gap`` (m,) [mm]: their
    gaps, negative inside. ``pressed`` (k,): the points under pressure; ``pressure`` (k,) [MPa], per unit rest area; the
    ``traction`` (k, 3) [MPa] and its derivative ``slope`` (k, 3, 3) [MPa/mm], both with friction; ``grip``: the friction.
    """

    near: Ints
    gap: Floats
    pressed: Ints
    pressure: Floats
    traction: Floats
    slope: Floats
    grip: Grip | None = None


# The indices (n,) of points, which may repeat, and the tractions (n, 3) [MPa] at these points.
Tractions = tuple[Ints, Floats]
State = tuple[list[Pressed], float, Floats]


class ContactForces:
    """The contact of all bones with this rank's points."""

    def __init__(
        self,
        law: ContactLaw,
        bones: tuple[ContactBone, ...],
        points: ContactPoints,
        unknowns: fem.Function,
        frame: float,
        spent: Spent,
    ) -> None:
        """``frame``: the frame at which the body is at rest."""
        self.law, self.bones, self.points, self.unknowns, self.frame = law, bones, points, unknowns, frame
        self.comm, self.spent = unknowns.function_space.mesh.comm, spent
        self.overlaps = [np.zeros(len(points.areas)) for _ in bones]
        self.friction, self.dissipated = list[Friction](), 0.0
        self.look()
        self.update(frame)
        self.overlap = max((float(-one.gap.min(initial=0.0)) for one in self.now), default=0.0)  # maximum at rest
        if law.relaxed:
            for overlap, one in zip(self.overlaps, self.now, strict=True):
                overlap[one.near] = np.maximum(law.smoothing - one.gap, 0)
            self.update(frame)
        self.settle()

    def look(self) -> None:
        """Set up the search for points within reach of each bone, including points that overlap it or that it supports at rest."""
        patches, support = Patches(self.points), self.law.in_situ or 0.0
        reach = [self.law.smoothing + max(support, float(-one.min(initial=0.0))) for one in self.overlaps]
        self.nearby = [Nearby(bone.shape, far, patches) for bone, far in zip(self.bones, reach, strict=True)]

    def update(self, frame: float) -> None:
        """Compute the pressures at the current unknowns, with the bones in their poses at ``frame``."""
        with self.spent.on("contact"):
            self.frame, carried = frame, self.points.carried
            self.moved = self.unknowns.x.array[carried.dofs]
            self.now = [self._pressed(i, carried.rest + self.moved) for i in range(len(self.bones))]

    def _pressed(self, i: int, nodes: Floats) -> Pressed:
        """The contact with bone ``i``, for ``nodes`` (m, 3) [mm] that carry the points. Overlap at rest is subtracted."""
        pose = self.bones[i].pose(self.frame)
        turn, local = pose[:3, :3], partial(self._local, i, self.frame, self.moved)
        near, (gap, gradient, bend) = self.nearby[i].find((nodes - pose[:3, 3]) @ turn, local)
        allowed = self.law.allowance(self.frame) * self.overlaps[i][near]
        pressure, change = self.law.pressure(gap + allowed)
        some = np.flatnonzero(pressure)
        pressure, change, sampled = pressure[some], change[some], Sampled(gap[some], gradient[some], bend[some])
        normal, curvature = sampled.gradient @ turn.T, turn @ sampled.curvature @ turn.T
        slope = change[:, None, None] * normal[:, :, None] * normal[:, None, :] + pressure[:, None, None] * curvature
        found = Pressed(near, gap, near[some], pressure, pressure[:, None] * normal, slope)
        if not self.friction:
            return found
        gaps = sampled._replace(distance=sampled.distance + allowed[some])
        grip = self.friction[i].grip(found.pressed, local(found.pressed), gaps, partial(self._before, i))
        own = found.traction + grip.traction @ turn.T, slope + turn @ grip.slope @ turn.T
        return replace(found, traction=own[0], slope=own[1], grip=grip)

    def _held(self, i: int) -> Floats:
        """The positions (n, 3) [mm], in the frame of bone ``i``, of the points that the bone presses; NaN for all other points."""
        found, some = np.full(self.points.rest.shape, np.nan), self.now[i].pressed
        found[some] = self._local(i, self.frame, self.moved, some)
        return found

    def _before(self, i: int, which: Ints) -> tuple[Floats, Floats]:
        """The positions (k, 3) and gaps (k,) [mm] of points ``which`` (k,) in the settled state, in the frame of bone ``i``."""
        _, frame, moved = self.settled
        places = self._local(i, frame, moved, which)
        gap = self.bones[i].shape.sample(places).distance
        return places, gap + self.law.allowance(frame) * self.overlaps[i][which]

    def _local(self, i: int, frame: float, moved: Floats, some: Ints) -> Floats:
        """The positions (k, 3) [mm] of ``some`` points relative to bone ``i`` at ``frame``, with nodes displaced by ``moved``."""
        pose = self.bones[i].pose(frame)
        return np.asarray((self._places(moved, some) - pose[:3, 3]) @ pose[:3, :3])

    def _places(self, moved: Floats, some: Ints) -> Floats:
        """The positions (k, 3) [mm] of ``some`` points (k,), with the nodes displaced by ``moved`` (m, 3)."""
        return np.asarray(self.points.rest[some] + self.points.carried.shares[some] @ moved)

    def presses(self) -> bool:
        """True if a bone presses on a point, on any rank."""
        return bool(self.comm.allreduce(any(len(one.pressed) for one in self.now), MPI.LOR))

    def tractions(self) -> Tractions:
        """The points that bones press, and the tractions on them."""
        which = np.concatenate([np.zeros(0, np.int64), *(one.pressed for one in self.now)])
        return which, np.concatenate([np.zeros((0, 3)), *(one.traction for one in self.now)])

    def predicted(self, frame: float, moves: Floats) -> Tractions:
        """The ``tractions`` after changes ``moves`` of the unknowns and a motion of the bones to ``frame``, linearised in both."""
        which, found = self.tractions()
        ahead, carried = [np.zeros((0, 3))], self.points.carried
        for entry, one in zip(self.bones, self.now, strict=True):
            step = entry.pose(frame) @ np.linalg.inv(entry.pose(self.frame))
            points = self._places(self.moved, one.pressed)
            displacement = carried.shares[one.pressed] @ moves[carried.dofs]
            ahead.append(np.einsum("nij,nj->ni", one.slope, displacement - (apply(step, points) - points)))
        return which, found + np.concatenate(ahead)

    def add_residual(self, residual: Floats, tractions: Tractions | None) -> None:
        """Add the weak form of ``tractions``, by default the current ones, to ``residual`` over this rank's unknowns."""
        which, found = self.tractions() if tractions is None else tractions
        if len(which):
            self.points.add_forces(residual, -self.points.areas[which, None] * found, which)

    def tangent(self) -> Iterator[tuple[Ints, Floats, Floats]]:
        """For each bone, the derivative of the residual at pressed points: cells (p,), basis (p, k) and slopes (p, 3, 3)."""
        for one in self.now:
            if len(touched := one.pressed):
                areas = self.points.areas[touched, None, None]
                yield self.points.cells[touched], self.points.basis[touched], -areas * one.slope

    def forces(self) -> dict[str, tuple[Floats, Floats]]:
        """The force (3,) [N] of each bone on this rank's points and its moment (3,) [N mm] about the origin, by the bone's name. If
        the law names parts, there is one entry for each part and bone, with the names of both.
        """
        found = {}
        for entry, one in zip(self.bones, self.now, strict=True):
            forces = self.points.areas[one.pressed, None] * one.traction
            moments = np.cross(self._places(self.moved, one.pressed), forces)
            for part, first, last in self.law.parts or (("", 0, len(self.points.areas)),):
                own = (one.pressed >= first) & (one.pressed < last)
                found[f"{part} {entry.name}".lstrip()] = forces[own].sum(axis=0), moments[own].sum(axis=0)
        return found

    def scalars(self) -> dict[str, float]:
        """The maxima ``contact_depth`` [mm], ``contact_pressure`` [MPa] and ``PART.contact_pressure`` of each part; the rest area
        ``contact_area`` [mm2] and the number ``contact_points`` of points in contact; ``contact_points_near``, the number of points
        whose distance was computed; ``overlap_at_rest`` [mm], of the deepest point, whether the overlap is removed or not; and
        ``friction_work`` [N mm], dissipated since the start.
        """
        comm, touched, depth, pressure = self.comm, np.zeros(len(self.points.areas), bool), 0.0, 0.0
        for one in self.now:
            touched[one.pressed] = True
            depth = max(depth, float(-one.gap.min(initial=0.0)))
            pressure = max(pressure, float(one.pressure.max(initial=0.0)))
        greatest = {"contact_depth": depth, "contact_pressure": pressure}
        for part, first, last in self.law.parts:
            own = [one.pressure[(one.pressed >= first) & (one.pressed < last)] for one in self.now]
            greatest[f"{part}.contact_pressure"] = float(np.concatenate(own).max(initial=0.0))
        if self.law.relaxed or self.law.in_situ is not None:
            greatest["overlap_at_rest"] = self.overlap
        sums = {
            "contact_area": float(self.points.areas[touched].sum()),
            "contact_points": float(touched.sum()),
            "contact_points_near": float(sum(len(one.near) for one in self.now)),
        }
        sums |= {"friction_work": self.dissipated} if self.law.friction else {}
        found = {name: comm.allreduce(value, MPI.MAX) for name, value in greatest.items()}
        return found | {name: comm.allreduce(value, MPI.SUM) for name, value in sums.items()}

    def deepest(self) -> str:
        """The depth of the deepest point, the name of the bone and the position, as text."""
        mine = []
        for entry, one in zip(self.bones, self.now, strict=True):
            if len(one.near):
                depth, (at,) = float(-one.gap.min()), self._places(self.moved, one.near[[np.argmin(one.gap)]])
                mine.append((depth, f'{max(depth, 0.0):.2f} mm in "{entry.name}" at {place_of(at)}'))
        return self._worst(mine) or "nowhere"

    def settle(self) -> None:
        """Accept the current state as the start of the next step. Friction begins when no overlap at rest remains."""
        for friction, one in zip(self.friction, self.now, strict=False):
            if one.grip is not None:
                friction.settle(one.grip)
                self.dissipated += float(self.points.areas[one.pressed] @ one.grip.lost)
        if self.law.friction and not self.friction and self.law.allowance(self.frame) == 0:
            self.friction = [Friction(self.law, self._held(i)) for i in range(len(self.bones))]
        if self.friction:
            self.update(self.frame)
        self.settled = self.state
        for nearby in self.nearby:
            nearby.met[:] = False

    @property
    def state(self) -> State:
        """The contact with each bone, the frame, and the displacement of the nodes that carry points."""
        return self.now, self.frame, self.moved

    def restoring(self) -> Callable[[], None]:
        """The function that restores the current contact after the unknowns have been restored."""
        return partial(self.go_back, self.state)

    def go_back(self, state: State | None = None) -> None:
        """Restore an earlier ``state``, by default the settled one, after the unknowns have been restored."""
        self.now, self.frame, self.moved = state or self.settled

    def trouble(self, _: Floats, /) -> Trouble | None:
        """The trouble *diverged* if a point has gone through a bone since the last settled state, is pressed near the middle of a
        bone, or has come into contact, with friction, from too far away.
        """
        with self.spent.on("contact"):
            through = [one for i in range(len(self.bones)) if (one := self._through(i))]
            why = self._worst(through) or self._worst(self._yielded()) or self._worst(self._from_afar())
        return Trouble("diverged", why) if why else None

    def _yielded(self) -> list[tuple[float, str]]:
        """Bones with a point so deep that it could leave on any side: depth divided by half the thickness, and a message."""
        mine, allowed = list[tuple[float, str]](), self.law.allowance(self.frame)
        for entry, one, before in zip(self.bones, self.now, self.overlaps, strict=True):
            depth = float((-one.gap - allowed * before[one.near]).max(initial=0.0))
            half = entry.shape.half_thickness
            said = f'contact gives way: the surface is {depth:.2g} mm deep in "{entry.name}", whose middle is {half:.2g} mm deep'
            mine += [(depth / half, said)] if depth > _GIVEN_WAY * half else []
        return mine

    def _from_afar(self) -> list[tuple[float, str]]:
        """The bones with friction that points met from so far away that their slip is unknown: number of points, and a message."""
        mine = list[tuple[float, str]]()
        for i, friction in enumerate(self.friction):
            pressed = self.now[i].pressed
            new = pressed[np.isnan(friction.stuck[pressed, 0])]
            count = int((self._before(i, new)[1] >= FAR).sum())
            said = f'{count} points met "{self.bones[i].name}", with friction, from too far away within a load step'
            mine += [(float(count), said)] if count else []
        return mine

    def _worst(self, mine: list[tuple[float, str]]) -> str | None:
        """The message with the largest number on any rank; None if there is no message."""
        found: list[tuple[float, str]] = [one for rank in self.comm.allgather(mine) for one in rank]
        return max(found)[1] if found else None

    def _through(self, i: int) -> tuple[float, str] | None:
        """The excess depth [mm] of the point that went farthest through bone ``i`` since the last settled state, and a message;
        None without such a point. Its straight path in the bone's frame is deeper inside than both ends and leaves on the far side.
        """
        _, settled_at, settled = self.settled
        there, here = partial(self._local, i, settled_at, settled), partial(self._local, i, self.frame, self.moved)
        met, starts, ends = self.nearby[i].crossing(there, here)
        before, now = (self.bones[i].shape.sample(places) for places in (starts, ends))
        displacements = ends - starts
        # Far away the gap is unknown; outward is then taken as opposite to the displacement at the start, and along it at the end.
        outward = [
            np.where(one.gradient.any(axis=1)[:, None], one.gradient, sign * displacements)
            for one, sign in ((before, -1), (now, 1))
        ]
        turned = np.flatnonzero(np.einsum("ni,ni->n", *outward) < 0)
        felt = min(self.law.smoothing, _RIM * self.bones[i].shape.half_thickness)
        on_path = nearest_on_path(self.bones[i], starts[turned], displacements[turned], felt)
        excess = np.minimum(np.minimum(before.distance, now.distance)[turned], 0) - on_path
        if not excess.max(initial=0.0) > felt:
            return None
        worst = int(np.argmax(excess))
        where = f"the point whose rest position is {place_of(self.points.rest[met[turned[worst]]])}"
        return float(excess[worst]), f'{where} went through "{self.bones[i].name}"'
