"""Frame numbers (stops) at which load steps end, so that no step skips motion between the requested frames.

Between two stops no bone and no prescribed region rotates by more than a right angle, because a straight line between two poses
that are half a turn or more apart loses the sense of rotation. Apart from the motion that all have in common, none moves farther
than the size of the body. No point moves out and back: the length of its path exceeds 1.12 times the distance between the ends of
the path by at most a hundredth of the body's size.

Motions and paths of this package state the frames at which they change direction and the angles by which they rotate in between
(``turning``), so that these rules hold for all of them. Any other function of a frame number is sampled 1024 times over all frames,
at least 16 times between two frames, and more often where it moves far. Faster motion is not detected.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cache
from itertools import pairwise
from typing import Any

import numpy as np

from fem_reference.effects import Effect, Ramped
from fem_reference.foundations.errors import InputError
from fem_reference.foundations.mesh import Floats
from fem_reference.foundations.motion import Turning, apply

# The maximum rotation [rad] in a load step, the maximum rotation [rad] between samples, and the maximum travel between samples as a
# fraction of the size of the body.
TURN, _SAMPLED, _STRIDE = np.pi / 2, np.pi / 16, 0.5
# A quarter of a circle is 1.11 times as long as its chord. A path counts as returning if it is longer than ``_BENT`` times its
# chord plus ``_BACK`` times the size of the body.
_BENT, _BACK = 1.12, 0.01
_SAMPLES, _BETWEEN = 1024, 16  # the number of samples of an unknown motion, over all frames and between two
_POINTS = 32  # the number of sampled points of a region
_MOST = 20_000  # the maximum number of sampled frames
_SHORTEST = 1e-9  # a long motion counts as a jump if it takes less than this fraction of the range of frames


@dataclass(frozen=True)
class Moving:
    """Something that moves. ``place``: its name in messages; ``at``: a function from a frame number to the positions (p, 3) [mm] of
    its points; ``turning``: the frames and angles of its rotation, None if unknown; ``scale``: True for the amount of an effect.
    """

    place: str
    at: Callable[[float], Floats]
    turning: Turning | None
    scale: bool = False


def turning(path: object, points: Floats) -> Turning | None:
    """The frames between which a ``path`` of ``points`` (p, 3) is steady (a straight motion, or a rotation about an axis), and the
    angle of rotation [rad] at each of these frames; None if the path does not state them.
    """
    owner = getattr(path, "__self__", path)  # the object of a method
    if not type(owner).__module__.startswith("fem_reference."):
        return None
    motion: Any = getattr(owner, "motion", owner)  # a bone has a motion, which may be None
    known = getattr(motion, "turning", None)
    return ((), ()) if motion is None else known(points) if known else None


def moving_ramp(effect: Effect, size: float) -> Moving | None:
    """The amount of an ``effect`` as the motion of a point, by ``size`` [mm] for the maximum amount; None for a constant amount."""
    if type(effect).amount is Effect.amount:
        return None
    knots = effect.ramp if isinstance(effect, Ramped) and type(effect).amount is Ramped.amount else None
    most = max([0.0, *(knot.amount for knot in knots)]) if knots else 1.0
    along = np.array([[size / (most or 1.0), 0.0, 0.0]])
    known = None if knots is None else (tuple(knot.frame for knot in knots), (0.0,) * len(knots))
    return Moving(effect.title, lambda frame: effect.amount(frame) * along, known, scale=True)


def some(points: Floats) -> Floats:
    """An evenly spread sample of ``points`` (n, 3)."""
    chosen = np.unique(np.linspace(0, len(points) - 1, min(len(points), _POINTS)).astype(int))
    return np.asarray(points[chosen])


def stops(things: Sequence[Moving], frames: Sequence[float], size: float) -> tuple[float, ...]:
    """The frame numbers between the first and the last of ``frames`` at which a load step must end. ``things``: everything that
    moves; ``size`` [mm]: the size of the body. Raises InputError if a motion jumps, is not finite, or is too long to be sampled.
    """
    if len(frames) < 2 or not things:
        return ()
    things = [replace(thing, at=cache(thing.at)) for thing in things]
    looked = _Samples(things, np.unique(np.concatenate([_grid(thing, frames) for thing in things])), size)
    while len(wide := looked.wide()):
        looked = _Samples(things, np.unique(np.concatenate([looked.frames, wide])), size)
    found, at = list[float](), 0
    while (at := looked.farthest(at)) < len(looked.frames) - 1:
        found.append(float(looked.frames[at]))
    return tuple(found)


def skipped(things: Sequence[Moving], frames: Sequence[float], size: float) -> tuple[Moving, float, float] | None:
    """The first of ``things`` that moves too far from one of ``frames`` to the next, and these two frames; None if none does."""
    looked = _Samples(things, np.unique(np.concatenate([frames, *(_grid(thing, frames) for thing in things)])), size)
    for early, late in pairwise(np.searchsorted(looked.frames, frames).tolist()):
        for i, thing in enumerate(things):
            if looked.reach(i, early) < late:
                return thing, float(looked.frames[early]), float(looked.frames[late])
    return None


def posed(place: str, pose: Callable[[float], Floats], points: Floats) -> Moving:
    """The motion of the corners of the box around ``points`` (n, 3) [mm] with a rigid ``pose``. ``place``: its name in messages."""
    box = np.where(np.indices((2, 2, 2)).reshape(3, -1).T, points.max(axis=0), points.min(axis=0))
    return Moving(place, lambda frame: apply(pose(frame), box), turning(pose, box))


def _grid(thing: Moving, frames: Sequence[float]) -> Floats:
    """The frames at which a ``thing`` is sampled initially."""
    first, last = frames[0], frames[-1]
    if thing.turning is None:
        count = max(_BETWEEN, -(-_SAMPLES // (len(frames) - 1)))
        return np.concatenate([np.linspace(a, b, count + 1) for a, b in pairwise(frames)])
    knots, angles = (np.asarray(values, float) for values in thing.turning)
    ends = np.unique(np.clip([first, *knots, last], first, last))
    turned = np.abs(np.diff(np.interp(ends, knots, angles))) if len(knots) else np.zeros(len(ends) - 1)
    if not turned.sum() < _MOST * _SAMPLED:
        got, want = f"{turned.sum():.4g} rad of rotation", f"at most {_MOST * _SAMPLED:.0f} rad"
        raise InputError(f"{thing.place}: path", got, want)
    counts = np.maximum(np.ceil(turned / _SAMPLED - 1e-9), 1).astype(int)
    return np.concatenate([np.linspace(a, b, count + 1) for (a, b), count in zip(pairwise(ends), counts, strict=True)])


class _Samples:
    """Samples of ``things`` at ``frames`` (m,). For each thing there are positions (m, p, 3) [mm], and cumulative rotations (m,)
    [rad] and path lengths (m, p) [mm], the latter with and without the motion that all have in common.
    """

    def __init__(self, things: Sequence[Moving], frames: Floats, size: float) -> None:
        self.things, self.frames, self.size = things, frames, size
        with np.errstate(all="ignore"):  # NaN and infinity count as too far
            self.places = [_places(thing, frames) for thing in things]
            self.strides = [_steps(place) for place in self.places]
            bodies = [place for thing, place in zip(things, self.places, strict=True) if not thing.scale]
            alike = np.mean([place.mean(axis=1) for place in bodies], axis=0) if bodies else np.zeros((len(frames), 3))
            both = list(zip(things, self.places, strict=True))
            self.apart = [_steps(place if thing.scale else place - alike[:, None]) for thing, place in both]
            self.angles = [_turns(thing, frames, place) for thing, place in both]
            self.lengths, self.travels, self.turns = (
                [np.concatenate([np.zeros_like(one[:1]), np.cumsum(one, axis=0)]) for one in steps]
                for steps in (self.strides, self.apart, self.angles)
            )

    def wide(self) -> Floats:
        """The midpoints of the intervals in which a thing moves too far to be resolved. Raises InputError if a thing jumps."""
        spans, found = np.diff(self.frames), np.zeros(len(self.frames) - 1, bool)
        short = ~(spans > _SHORTEST * (self.frames[-1] - self.frames[0]))
        for apart, angles in zip(self.apart, self.angles, strict=True):
            far = ~(apart.max(axis=1) <= _STRIDE * self.size) | ~(angles <= 2 * _SAMPLED)
            if (far & short).any():
                raise self._jump(int(np.argmax(far & short)))
            found |= far
        if len(self.frames) + found.sum() > _MOST:
            raise self._jump(int(np.argmax(found)))
        return (self.frames[:-1] + spans / 2)[found]

    def _jump(self, i: int) -> InputError:
        """The InputError for the thing that moves farthest in the interval ``i``."""
        far = [float(strides[i].max()) for strides in self.strides]
        which = int(np.argmax(far))
        by = f"by frame {self.frames[i + 1]:g}"
        got = f"movement by up to {far[which]:.4g} mm and rotation by {self.angles[which][i]:.3g} rad {by}"
        return InputError(f"{self.things[which].place}: path at frame {self.frames[i]:g}", got, "a path without jumps")

    def farthest(self, at: int) -> int:
        """The index of the last sampled frame that one load step may reach from the sampled frame with the index ``at``."""
        return max(at + 1, min(self.reach(i, at) for i in range(len(self.things))))

    def reach(self, i: int, at: int) -> int:
        """The same as ``farthest``, but only for the thing with the index ``i``."""
        turns, places = self.turns[i], self.places[i] - self.places[i][at]
        travels, lengths = ((each[i] - each[i][at]) for each in (self.travels, self.lengths))
        last = int(np.searchsorted(turns, turns[at] + TURN + 1e-6, "right")) - 1
        last = min(last, int(np.searchsorted(travels.max(axis=1), self.size * (1 + 1e-9), "right")) - 1)
        on = slice(at + 1, last + 1)
        back = (lengths[on] > _BENT * np.linalg.norm(places[on], axis=2) + _BACK * self.size).any(axis=1)
        return at + int(np.argmax(back)) if back.any() else last


def _places(thing: Moving, frames: Floats) -> Floats:
    """The positions (m, p, 3) [mm] of the points of a ``thing`` at ``frames`` (m,). Raises InputError if they are not finite."""
    found = np.array([thing.at(float(frame)) for frame in frames], float)
    lost = np.flatnonzero(~np.isfinite(found).all(axis=(1, 2)))
    if len(lost):
        value = found[lost[0]][~np.isfinite(found[lost[0]])][0]
        raise InputError(f"{thing.place}: path at frame {frames[lost[0]]:g}", f"{value}", "finite displacements")
    return found


def _steps(places: Floats) -> Floats:
    """The distances (m - 1, p) that points move from each frame to the next. ``places`` (m, p, 3): their positions."""
    return np.asarray(np.linalg.norm(np.diff(places, axis=0), axis=2))


def _turns(thing: Moving, frames: Floats, places: Floats) -> Floats:
    """The rotations (m - 1,) [rad] of a ``thing`` between successive ``frames`` (m,): as the thing states them, or else the maximum
    rotation of the direction from the centroid to a point. ``places`` (m, p, 3): the positions of the points.
    """
    if thing.turning is not None:
        knots, angles = thing.turning
        return np.abs(np.diff(np.interp(frames, knots, angles))) if knots else np.zeros(len(frames) - 1)
    rays = places - places.mean(axis=1, keepdims=True)
    lengths = np.linalg.norm(rays, axis=2)
    known = lengths > 1e-3 * lengths[0].max(initial=0.0)
    units = rays / np.where(known, lengths, 1.0)[:, :, None]
    halves = np.clip(np.linalg.norm(np.diff(units, axis=0), axis=2) / 2, 0, 1)
    turned = np.where(known[1:] & known[:-1], 2 * np.arcsin(halves), 0.0)
    return np.asarray(turned.max(axis=1, initial=0.0))
