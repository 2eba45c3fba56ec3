"""Lines between bones through via-points, some of which depend on the angle of a joint. Report section 5.1, Figure 5.2."""

from dataclasses import dataclass
from functools import lru_cache
from itertools import pairwise
from typing import Annotated, Self

import numpy as np
import scipy
from pydantic import Field, model_validator

from fem_reference.foundations.errors import InputError
from fem_reference.foundations.mesh import Floats, Ints
from fem_reference.foundations.motion import apply
from fem_reference.foundations.records import Record, join
from fem_reference.foundations.units import Angle, Point
from fem_reference.problems.muscle import MuscleProblem
from fem_reference.problems.setup import Bone, Joint

# An angle that is outside a range by less than this [rad] counts as inside, up to rounding.
_ROUNDING = 1e-9


class CurvePoint(Record):
    """A point of a curve: the ``position`` on a bone, in coordinates of the rest state, at an ``angle`` of a joint."""

    angle: Angle
    position: Point


class Via(Record):
    """A via-point of each fibre. It moves with a ``bone``.

    ``at``: the position of the point at rest, as a fraction of the fibre's length. ``joint``: a joint whose angle affects the
    point. ``within``: the minimum and maximum angle at which lines pass through the point; at other angles they skip it. ``curve``:
    positions of the point on the bone at some angles, the same positions for all fibres. Between these angles it moves along
    Catmull-Rom splines, with the slopes of parabolas through neighbouring positions; beyond them it stays at the first or last
    position. With ``curve``, ``at`` only determines the order of the points.
    """

    at: Annotated[float, Field(gt=0, lt=1)]
    bone: str
    joint: str | None = None
    within: tuple[Angle, Angle] | None = None
    curve: tuple[CurvePoint, ...] = ()

    @model_validator(mode="after")
    def _check(self) -> Self:
        if (self.joint is None) == (self.within is not None or bool(self.curve)):
            raise ValueError('"joint" together with "within" or "curve", and only then')
        if self.within is not None and not self.within[0] < self.within[1]:
            raise ValueError('"within" from an angle to a larger angle')
        angles = [point.angle for point in self.curve]
        if len(angles) == 1 or angles != sorted(set(angles)):
            raise ValueError('"curve" of at least two points, in order of increasing angle')
        return self


@dataclass(frozen=True)
class Guided:
    """A via-point ``via`` that depends on the angle of a ``joint``."""

    via: Via
    joint: Joint

    def passed(self, number: int) -> bool:
        """True if lines pass through the point at frame ``number``."""
        low, high = (-np.inf, np.inf) if self.via.within is None else self.via.within
        return bool(low - _ROUNDING <= self.joint.angle_of(number) <= high + _ROUNDING)

    def position(self, number: int) -> Floats:
        """The point (3,) [mm] on the ``curve`` of the via-point at frame ``number``, in coordinates of the rest state."""
        angles = [point.angle for point in self.via.curve]
        places = np.array([point.position for point in self.via.curve])
        angle = np.clip(self.joint.angle_of(number), angles[0], angles[-1])
        return np.asarray(
            scipy.interpolate.CubicHermiteSpline(angles, places, np.gradient(places, angles, axis=0))(angle)
        )


@dataclass(frozen=True, eq=False)
class Passed:
    """The fixed points through which k lines pass at a frame. They divide each line into q parts.

    ``points`` (k, q + 1, 3) [mm]: positions. ``on`` (k, q + 1): the index of the bone of each point. Parts are numbered from 0, one
    line after the other. Point j of the fibres is on part ``part[j]``, at the fraction ``share[j]`` of the length of this part.
    """

    points: Floats
    on: Ints
    part: Ints
    share: Floats


@dataclass(frozen=True, eq=False)
class Lines:
    """A line for each of k fibres, with p + 1 fixed points.

    ``fixed`` (k, p + 1, 3) [mm]: positions of the fixed points at rest. ``on`` (k, p + 1): the index, in ``bones``, of the bone
    with which each point moves. ``sizes`` (k,): the number of points of each fibre. ``places`` (p + 1,): the positions of the fixed
    points as fractions of the fibre's length. ``guided``: the via-points that depend on a joint, by index.
    """

    bones: tuple[Bone, ...]
    fixed: Floats
    on: Ints
    sizes: Ints
    places: tuple[float, ...]
    guided: dict[int, Guided]

    def at(self, number: int) -> Passed:
        """The fixed points through which the lines pass at frame ``number``."""
        resting, moved = np.array(self.fixed), np.array(self.fixed)
        for j, one in self.guided.items():
            if one.via.curve:
                resting[:, j] = one.position(number)
        for i in np.unique(self.on):
            moved[self.on == i] = apply(self.bones[i].pose(number), resting[self.on == i])
        kept = [j for j in range(len(self.places)) if j not in self.guided or self.guided[j].passed(number)]
        part, share = _layout(tuple(self.sizes.tolist()), tuple(self.places[j] for j in kept))
        return Passed(moved[:, kept], self.on[:, kept], part, share)


def lines_of(problem: MuscleProblem, vias: tuple[Via, ...], spread: int, place: str) -> Lines:
    """The lines of a muscle through the via-points ``vias``, or through a number ``spread`` of evenly spaced via-points.

    Raises InputError, with a key inside ``place``, if a bone or joint does not exist or the fibres have too few points.
    """
    fibres, sizes, count = problem.fibres, np.diff(problem.fibres.offsets), len(vias) + spread
    if sizes.min() < count + 2:  # checked first, as ``spread`` may be too large for memory
        got = f"fibre {sizes.argmin()} of {sizes.min()} points"
        want = f"fibres of at least {count + 2} points for {count} via-points"
        raise InputError(join(place, "via_count" if spread else "via"), got, want)
    evenly = (np.arange(spread) + 0.5) / max(spread, 1)
    places = (0.0, *(via.at for via in vias), *evenly.tolist(), 1.0)
    named = [index(problem.bones, via.bone, join(place, f"via[{i}].bone")) for i, via in enumerate(vias)]
    fixed = np.array([along(fibres.points[low:high], list(places)) for low, high in pairwise(fibres.offsets)])
    ends = [nearest_bones(problem, fixed[:, end], place) for end in (0, -1)]
    nearer = [ends[int(at > 0.5)] for at in evenly]
    on = np.column_stack([ends[0], *(np.full(len(fibres), via) for via in named), *nearer, ends[1]])
    guided = {
        i + 1: Guided(via, problem.joints[index(problem.joints, via.joint, join(place, f"via[{i}].joint"))])
        for i, via in enumerate(vias)
        if via.joint is not None
    }
    return Lines(problem.bones, fixed, on, sizes, places, guided)


def along(points: Floats, places: list[float]) -> Floats:
    """The points (k, 3) on the polyline ``points`` (n, 3) at the fractions ``places`` (k,) of its length."""
    travelled = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1))])
    wanted = np.array(places) * travelled[-1]
    return np.column_stack([np.interp(wanted, travelled, axis) for axis in points.T])


@lru_cache(maxsize=64)
def _layout(sizes: tuple[int, ...], places: tuple[float, ...]) -> tuple[Ints, Floats]:
    """The ``part`` and ``share`` of :class:`Passed` for fibres of ``sizes`` points with fixed points at fractions ``places``."""
    part, share = zip(*(_spread(size, list(places)) for size in sizes), strict=True)
    return np.concatenate([found + i * (len(places) - 1) for i, found in enumerate(part)]), np.concatenate(share)


def _spread(count: int, places: list[float]) -> tuple[Ints, Floats]:
    """The ``part`` and ``share`` of :class:`Passed` for a line of ``count`` points, which are evenly spaced in each part."""
    at = np.rint(np.array(places) * (count - 1)).astype(np.int64)
    steps = np.arange(len(at))
    at = np.maximum.accumulate(at - steps) + steps  # each index is larger than the one before
    at = np.minimum(at, count - 1 - steps[::-1])
    part = np.clip(np.searchsorted(at, np.arange(count), side="right") - 1, 0, len(at) - 2)
    return part, (np.arange(count) - at[part]) / np.diff(at)[part]


def nearest_bones(problem: MuscleProblem, points: Floats, place: str) -> Ints:
    """The index (n,) of the bone whose attachment has the vertex nearest to each of ``points`` (n, 3) [mm]. Raises InputError at
    ``place`` if the muscle has no attachments.
    """
    if not problem.attached:
        raise InputError(place, "a muscle without attachments", "attachments to which lines are fixed")
    ends = [problem.surface.points[attached.vertices] for attached in problem.attached]
    away = [np.linalg.norm(points[:, None] - end, axis=2).min(axis=1) for end in ends]
    found = [index(problem.bones, attached.bone.name, place) for attached in problem.attached]
    return np.array(found)[np.argmin(away, axis=0)]


def index(named: tuple[Bone, ...] | tuple[Joint, ...], name: str, place: str) -> int:
    """The index of the bone or joint with this ``name``. Raises InputError at ``place`` if there is none."""
    names = [one.name for one in named]
    if name not in names:
        want = f"one of {', '.join(names)}" if names else "a joint, but the case has none"
        raise InputError(place, f'"{name}"', want)
    return names.index(name)
