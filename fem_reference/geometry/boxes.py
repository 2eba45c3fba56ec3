"""Axis-aligned bounding boxes of triangles and points, and a search for the boxes of two sets that may touch."""

from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np
from numpy.typing import NDArray

from fem_reference.foundations.mesh import Floats, Ints, Surface

# The number of cells of the search grid along the longest edge of the common region of two sets.
_CELLS = 16


@dataclass(frozen=True, eq=False)
class Boxes:
    """n boxes from the corners ``low`` (3, n) [mm] to the corners ``high`` (3, n) [mm]."""

    low: Floats
    high: Floats

    @cached_property
    def largest(self) -> Floats:
        """The extent (3, 1) [mm] of the largest box along each axis, plus the round-off of differences of coordinates."""
        rounding = 4 * np.finfo(float).eps * max(float(np.abs(side).max()) for side in (self.low, self.high))
        return np.asarray((self.high - self.low).max(axis=1, keepdims=True) + rounding)

    @cached_property
    def corners(self) -> tuple[Floats, Floats]:
        """The lowest and the highest coordinates (3, 1) [mm] of all low corners."""
        return self.low.min(axis=1, keepdims=True), self.low.max(axis=1, keepdims=True)


@lru_cache(maxsize=16)
def boxes_of(surface: Surface) -> Boxes:
    """The boxes around the triangles of a ``surface``."""
    columns = np.ascontiguousarray(surface.points.T)
    a, b, c = (np.take(columns, corner, axis=1) for corner in surface.triangles.T)
    return Boxes(np.minimum(np.minimum(a, b), c), np.maximum(np.maximum(a, b), c))


@lru_cache(maxsize=16)
def bounds(surface: Surface) -> tuple[Floats, Floats]:
    """The lowest and the highest coordinates (3,) [mm] of the points of a ``surface``."""
    columns = np.ascontiguousarray(surface.points.T)  # numpy is ten times as fast along contiguous rows
    return columns.min(axis=1), columns.max(axis=1)


def around(points: Floats, reach: Floats) -> Boxes:
    """Boxes that extend by ``reach`` (n,) [mm] from ``points`` (n, 3) in all directions."""
    return Boxes(points.T - reach, points.T + reach)


def touching(one: Boxes, other: Boxes) -> tuple[Ints, Ints]:
    """The indices (k,) and (l,) of the boxes of each set that may touch a box of the other: every box that does, and few others."""
    others = reached(one, other)
    return _near(other, others, one), others


def reached(one: Boxes, other: Boxes) -> Ints:
    """The indices (k,) of the boxes of ``other`` that may touch a box of ``one``: every box that does, and few others."""
    return _near(one, np.arange(one.low.shape[1]), other)


def _near(one: Boxes, some: Ints, other: Boxes) -> Ints:
    """The boxes (k,) of ``other`` with the low corner in a grid cell that ``some`` of ``one``, enlarged by the largest, reach."""
    if not (len(some) and other.low.size):
        return np.zeros(0, np.int64)
    begin, end = np.take(one.low, some, axis=1) - other.largest, np.take(one.high, some, axis=1)
    low = np.maximum(begin.min(axis=1, keepdims=True), other.corners[0])
    high = np.minimum(end.max(axis=1, keepdims=True), other.corners[1])
    found, edge = _within(other.low, other.low, low, high), float((high - low).max()) / _CELLS
    if not (len(found) and edge > 0):
        return found
    shape = np.floor((high - low) / edge).astype(np.int64) + 1

    def cells(places: Floats, some: Ints) -> Ints:
        return np.clip((np.take(places, some, axis=1) - low) / edge, 0, shape - 1).astype(np.int64)

    reaching = _within(begin, end, low, high)
    covered = _covered(cells(begin, reaching), cells(end, reaching), shape[:, 0])
    return np.asarray(found[covered[tuple(cells(other.low, found))]])


def _within(begin: Floats, end: Floats, low: Floats, high: Floats) -> Ints:
    """The boxes (k,) from ``begin`` to ``end`` that reach into the box from ``low`` to ``high``."""
    found = np.ones(begin.shape[1], bool)
    for axis in range(3):
        found &= (end[axis] >= low[axis]) & (begin[axis] <= high[axis])
    return np.flatnonzero(found)


def _covered(begin: Ints, end: Ints, shape: Ints) -> NDArray[np.bool_]:
    """Mask of the cells of a grid of ``shape`` that lie in any range from ``begin`` to ``end`` (3, n), both included."""
    sides, shape = (begin, end + 1), shape + 1
    steps = np.zeros(int(shape.prod()))
    for corner in np.ndindex(2, 2, 2):
        at = np.ravel_multi_index([sides[i][axis] for axis, i in enumerate(corner)], tuple(shape))
        steps += (-1) ** sum(corner) * np.bincount(at, minlength=len(steps))
    return np.asarray(steps.reshape(shape).cumsum(axis=0).cumsum(axis=1).cumsum(axis=2) > 0.5)
