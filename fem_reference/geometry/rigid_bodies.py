"""Signed distance to bones of simple shapes, in closed form, and the protocol that the shapes of all bones implement.

Coordinates are those of the bone in its rest pose. Distances are negative inside. Gradients are unit vectors out of the bone, along
the normal at the nearest point of the surface; curvatures are second derivatives. On ridges, where two parts of the surface are
equally near, one of them is used. Infinite curvatures (on a sharp edge, at a centre or on an axis) are replaced with zero.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import ClassVar, NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from fem_reference.foundations.errors import InputError
from fem_reference.foundations.mesh import Floats

Vector = tuple[float, float, float]


class Sampled(NamedTuple):
    """Signed ``distance`` (n,) [mm] of n points, its ``gradient`` (n, 3), and its ``curvature`` (n, 3, 3) [1/mm]."""

    distance: Floats
    gradient: Floats
    curvature: Floats


class Obstacle(Protocol):
    """The shape of a bone: a signed distance, which changes along a path by at most ``steepest`` times the path's length."""

    @property
    def steepest(self) -> float:
        """An upper bound on the length of the gradient of the distance."""

    @property
    def half_thickness(self) -> float:
        """The maximum depth [mm] of a point inside the bone."""

    def clearance(self, within: float) -> Callable[[Floats], Floats]:
        """Return a function of points (n, 3) [mm]. It gives a lower bound (n,) [mm] on the length of any path from each point to a
        place whose distance to the bone is at most ``within`` [mm].
        """

    def sample(self, points: Floats) -> Sampled:
        """Distance and its first two derivatives at ``points`` (n, 3) [mm], in the bone's rest pose; NaN for NaN coordinates."""

    def distances(self, points: Floats) -> Floats:
        """The distance (n,) [mm] of :meth:`sample`, without the derivatives."""


class Exact:
    """Base class of bones whose signed distance has a closed form and is exact everywhere."""

    steepest: ClassVar[float] = 1.0

    def clearance(self: Obstacle, within: float) -> Callable[[Floats], Floats]:
        """Return a function of points: their distance minus ``within`` [mm]."""
        return lambda points: self.sample(points).distance - within

    def distances(self: Obstacle, points: Floats) -> Floats:
        """Distance (n,) [mm] of ``points`` (n, 3)."""
        return self.sample(points).distance


@dataclass(frozen=True)
class HalfSpace(Exact):
    """A half-space behind the plane through ``point`` [mm] with the outward ``normal``, which may have any length."""

    half_thickness: ClassVar[float] = np.inf
    point: Vector
    normal: Vector

    def __post_init__(self) -> None:
        if not np.linalg.norm(self.normal) > 0:
            raise InputError("half space: normal", self.normal, "a direction")

    def sample(self, points: Floats) -> Sampled:
        """Distance ``(x - point) . normal`` and its derivatives."""
        normal = np.asarray(self.normal, float) / np.linalg.norm(self.normal)
        return Sampled((points - self.point) @ normal, np.tile(normal, (len(points), 1)), np.zeros((len(points), 3, 3)))


@dataclass(frozen=True)
class Sphere(Exact):
    """A sphere of ``radius`` [mm] about ``centre`` [mm]."""

    centre: Vector
    radius: float

    def __post_init__(self) -> None:
        _check_length("sphere: radius", self.radius)

    @property
    def half_thickness(self) -> float:
        """The radius [mm]."""
        return self.radius

    def sample(self, points: Floats) -> Sampled:
        """Distance ``|x - centre| - radius`` and its derivatives."""
        length, away, squares = _length(points - self.centre)
        return Sampled(length - self.radius, away, _over(np.eye(3) - squares, length))


@dataclass(frozen=True)
class _Rod(Exact):
    """A shape of ``radius`` [mm] about the segment from ``start`` to ``end`` [mm]."""

    start: Vector
    end: Vector
    radius: float

    def __post_init__(self) -> None:
        kind = type(self).__name__.lower()
        _check_length(f"{kind}: radius", self.radius)
        if not np.linalg.norm(np.subtract(self.end, self.start)) > 0:
            raise InputError(f"{kind}: end", self.end, "a point other than the start")


@dataclass(frozen=True)
class Capsule(_Rod):
    """A capsule: all points within ``radius`` of the segment from ``start`` to ``end`` [mm]."""

    @property
    def half_thickness(self) -> float:
        """The radius [mm]."""
        return self.radius

    def sample(self, points: Floats) -> Sampled:
        """Distance to the segment minus the radius, and its derivatives."""
        axis, extent = _axis(self.start, self.end)
        along = (points - self.start) @ axis
        length, away, squares = _length(points - self.start - np.clip(along, 0, extent)[:, None] * axis)
        beside = ((along > 0) & (along < extent))[:, None, None]
        bent = np.eye(3) - squares - np.where(beside, np.outer(axis, axis), 0.0)
        return Sampled(length - self.radius, away, _over(bent, length))


@dataclass(frozen=True)
class Box(Exact):
    """A box of outer ``size`` [mm] along the axes, about ``centre``, with edges and corners of the radius ``rounding`` [mm]."""

    centre: Vector
    size: Vector
    rounding: float

    def __post_init__(self) -> None:
        for length in self.size:
            _check_length("box: size", length)
        if not 0 <= self.rounding <= min(self.size) / 2:
            raise InputError("box: rounding", self.rounding, "from 0 to half of the shortest edge")

    @property
    def half_thickness(self) -> float:
        """Half the shortest edge [mm]."""
        return min(self.size) / 2

    def sample(self, points: Floats) -> Sampled:
        """Distance to a box that is smaller by the rounding on each side, minus the rounding, and its derivatives."""
        away = points - self.centre
        sign = np.where(away < 0, -1.0, 1.0)
        beyond = np.abs(away) - (np.asarray(self.size) / 2 - self.rounding)
        distance, gradient, curvature = _orthant(beyond)
        turned = curvature * sign[:, :, None] * sign[:, None, :]
        return Sampled(distance - self.rounding, gradient * sign, turned)


@dataclass(frozen=True)
class Cylinder(_Rod):
    """A cylinder of ``radius`` [mm] about the segment from ``start`` to ``end`` [mm], with flat ends and sharp rims."""

    @property
    def half_thickness(self) -> float:
        """The smaller of the radius and half the length [mm]."""
        return float(min(self.radius, np.linalg.norm(np.subtract(self.end, self.start)) / 2))

    def sample(self, points: Floats) -> Sampled:
        """Distance, and its derivatives, to a rectangle in the half-plane of distance from the axis and position along it."""
        axis, extent = _axis(self.start, self.end)
        away = points - (np.asarray(self.start, float) + self.end) / 2
        along = away @ axis
        from_axis, outward, squares = _length(away - along[:, None] * axis)
        beyond = np.column_stack([from_axis - self.radius, np.abs(along) - extent / 2])
        distance, slope, bend = _orthant(beyond)
        frame = np.stack([outward, np.where(along < 0, -1.0, 1.0)[:, None] * axis], axis=1)
        round_about = np.eye(3) - squares - np.outer(axis, axis)
        curvature = np.einsum("nab,nai,nbj->nij", bend, frame, frame)
        curvature += _over(slope[:, 0, None, None] * round_about, from_axis)
        return Sampled(distance, np.einsum("na,nai->ni", slope, frame), curvature)


# The shapes, by their names in case files.
CLOSED_FORMS: dict[str, type[HalfSpace | Box | Sphere | Capsule | Cylinder]] = {
    "half_space": HalfSpace,
    "box": Box,
    "sphere": Sphere,
    "capsule": Capsule,
    "cylinder": Cylinder,
}


def _orthant(beyond: Floats) -> Sampled:
    """Distance of points ``beyond`` (n, d) to the orthant of negative coordinates, and its derivatives (n, d) and (n, d, d)."""
    outside = beyond > 0
    length, away, squares = _length(np.where(outside, beyond, 0.0))
    nearest = np.arange(beyond.shape[1]) == beyond.argmax(axis=1)[:, None]
    distance = length + np.minimum(beyond.max(axis=1), 0)
    within = ~outside.any(axis=1)
    bent = _over(np.eye(beyond.shape[1]) * outside[:, :, None] - squares, length)
    return Sampled(distance, np.where(within[:, None], nearest, away), np.where(within[:, None, None], 0, bent))


def _length(vectors: Floats) -> tuple[Floats, Floats, Floats]:
    """Return lengths (n,) of ``vectors`` (n, d), unit vectors (n, d) (an axis for a zero vector), and outer products (n, d, d)."""
    length = np.linalg.norm(vectors, axis=1)
    some = np.eye(vectors.shape[1])[-1]
    unit = np.where((length == 0)[:, None], some, vectors / np.where(length == 0, 1, length)[:, None])
    return length, unit, unit[:, :, None] * unit[:, None, :]


def _over(tensors: Floats, length: Floats) -> Floats:
    """Divide ``tensors`` (n, d, d) by ``length`` (n,); zero where the length is zero."""
    return np.asarray(tensors * np.divide(1, length, out=np.zeros_like(length), where=length != 0)[:, None, None])


def _axis(start: Vector, end: Vector) -> tuple[NDArray[np.float64], float]:
    """Return the unit vector from ``start`` to ``end`` and the distance between them."""
    direction = np.subtract(end, start, dtype=float)
    extent = float(np.linalg.norm(direction))
    return direction / extent, extent


def _check_length(place: str, length: float) -> None:
    if not 0 < length < np.inf:
        raise InputError(place, length, "a length above 0 mm")
