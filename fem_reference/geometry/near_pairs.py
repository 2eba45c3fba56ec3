"""Pairs of triangles that may intersect, triangles near points, and connected parts, found by compiled code (``near_pairs.c``)."""

import ctypes
from functools import cache, lru_cache
from pathlib import Path

import numpy as np
import platformdirs

from fem_reference.foundations import native
from fem_reference.foundations.mesh import Floats, Ints, Surface, connected_parts
from fem_reference.geometry.boxes import within

# No -ffast-math: it reorders sums, and the bounds on their rounding errors would not hold. No vectorisation of straight-line code:
# gathering three coordinates into a vector costs more time than it saves.
_FLAGS = ("-O3", "-march=native", "-fno-tree-slp-vectorize")
_ROOM = 1000
_FARTHEST = 1e307  # [mm]


class _Triangles(ctypes.Structure):
    _fields_ = (("count", ctypes.c_int64), ("points", ctypes.c_void_p), ("corners", ctypes.c_void_p))

    @classmethod
    def of(cls, surface: Surface) -> "_Triangles":
        """Refer to the triangles of a ``surface``, which must outlive this object because no copy is made."""
        return cls(len(surface.triangles), surface.points.ctypes.data, surface.triangles.ctypes.data)


class _Sorted:
    """The triangles of a non-empty ``surface``, sorted into the cells of a grid."""

    def __init__(self, surface: Surface, code: ctypes.CDLL) -> None:
        self.code, self.grid = code, code.sorted(_Triangles.of(surface))
        if not self.grid:
            raise MemoryError("not enough memory for pairs of triangles")

    def __del__(self) -> None:
        if self.grid:
            self.code.forget(self.grid)


# Pairs with a bone are searched for in many frames, always in the bone's coordinates, so the bone's sorted triangles are cached.
_kept = lru_cache(maxsize=8)(_Sorted)


def near_pairs(one: Surface, other: Surface) -> Ints | None:
    """Find pairs (k, 2) of triangles of two surfaces, or of one surface with itself, that may intersect or touch. Each pair that
    does is found once, along with a few that do not. Pairs within one surface are left out if the triangles share an edge or touch
    only at a shared corner.

    Returns None without a compiler, or if a point is very far away or not finite. Further calls with the same ``other`` are faster.
    """
    code = _code()
    if code is None or not _moderate(one.points, other.points):
        return None
    pairs = np.zeros((0, 2), np.int64)
    if not (len(one.triangles) and len(other.triangles)):
        return pairs
    places, found = (_Sorted if one is other else _kept)(other, code), _ROOM
    while found > len(pairs):
        pairs = np.empty((found, 2), np.int64)
        triangles = _Triangles.of(one), _Triangles.of(other)
        found = code.near_pairs(*triangles, places.grid, one is other, len(pairs), pairs.ctypes.data)
    return pairs[:found]


def reached(surface: Surface, points: Floats, reach: Floats) -> Ints:
    """Indices (k,) of the triangles whose bounding boxes are within ``reach`` (n,) [mm] of one of ``points`` (n, 3) along each
    axis. Without a compiler, or if a point is very far away or not finite, some triangles that are farther away are included.
    """
    if not len(points):
        return np.zeros(0, np.int64)
    numbers, code = np.arange(len(points)), _code()
    corners = np.stack([points.T - reach, points.T + reach]).transpose(0, 2, 1)
    if code is None or not _moderate(surface.points, corners):
        return within(surface, corners[0].min(axis=0), corners[1].max(axis=0))
    # A triangle with two equal corners has the same bounding box as the segment between its distinct corners.
    boxes = _Sorted(Surface(corners.reshape(-1, 3), np.stack([numbers, numbers + len(points), numbers], axis=1)), code)
    found = np.empty(len(surface.triangles), np.int64)
    return found[: code.reached(_Triangles.of(surface), boxes.grid, found.ctypes.data)]


def _moderate(*places: Floats) -> bool:
    """True if all coordinates are finite and below ``_FARTHEST`` in magnitude, so that differences do not overflow."""
    return all(some.min(initial=0.0) > -_FARTHEST and some.max(initial=0.0) < _FARTHEST for some in places)


@lru_cache(maxsize=16)
def parts_of(surface: Surface) -> tuple[Ints, Ints]:
    """Return the first vertex (k,) of each connected part of a ``surface``, and for each vertex (n,) the first vertex of its part,
    where n - 1 is the highest vertex index in the triangles. Raises ValueError if a vertex index is negative.
    """
    if surface.triangles.min(initial=0) < 0:
        raise ValueError("a triangle has a negative vertex number")
    count, code = int(surface.triangles.max(initial=-1)) + 1, _code()
    found = np.empty(count, np.int64)
    if code is None:
        part = connected_parts(surface.triangles[:, :2].ravel(), surface.triangles[:, 1:].ravel(), count)
        found = np.unique(part, return_index=True)[1][part]
    else:
        code.parts(_Triangles.of(surface), count, found.ctypes.data)
    return np.flatnonzero(found == np.arange(count)), found


@cache
def _code() -> ctypes.CDLL | None:
    folder = platformdirs.user_cache_path("fem_reference") / "compiled"
    try:
        code = native.library(Path(__file__).with_suffix(".c"), _FLAGS, folder)
    except (OSError, RuntimeError):
        return None
    code.sorted.argtypes, code.sorted.restype = [_Triangles], ctypes.c_void_p
    code.forget.argtypes, code.forget.restype = [ctypes.c_void_p], None
    code.near_pairs.argtypes = [_Triangles, _Triangles, ctypes.c_void_p, ctypes.c_int, ctypes.c_int64, ctypes.c_void_p]
    code.reached.argtypes = [_Triangles, ctypes.c_void_p, ctypes.c_void_p]
    code.near_pairs.restype = code.reached.restype = ctypes.c_int64
    code.parts.argtypes, code.parts.restype = [_Triangles, ctypes.c_int64, ctypes.c_void_p], None
    return code
