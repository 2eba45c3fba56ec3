"""Pairs of triangles that may intersect, found by compiled loops (``near_pairs.c``)."""

import ctypes
from functools import cache
from pathlib import Path

import numpy as np
import platformdirs

from fem_reference.foundations import native
from fem_reference.foundations.mesh import Ints, Surface

# Never sums in another order: what is certain of rounded sums would not be.
_FLAGS = ("-O3", "-march=native")
_ROOM = 1000


class _Triangles(ctypes.Structure):
    _fields_ = (("count", ctypes.c_int64), ("points", ctypes.c_void_p), ("corners", ctypes.c_void_p))

    @classmethod
    def of(cls, surface: Surface) -> "_Triangles":
        """The triangles of a ``surface``, which must outlive them."""
        return cls(len(surface.triangles), surface.points.ctypes.data, surface.triangles.ctypes.data)


def near_pairs(one: Surface, other: Surface) -> Ints | None:
    """Pairs (k, 2) of triangles of two surfaces that may intersect or touch, or of one with itself, each pair
    once: all that do, and few that do not. Of one surface those that share an edge, or touch at a common corner only, are left
    out. None where no compiler is, or a point is not finite.
    """
    code = _code()
    if code is None or not all(np.isfinite(surface.points).all() for surface in (one, other)):
        return None
    found, pairs = (_ROOM if len(one.triangles) and len(other.triangles) else 0), np.zeros((0, 2), np.int64)
    while found > len(pairs):
        pairs = np.empty((found, 2), np.int64)
        found = code(_Triangles.of(one), _Triangles.of(other), one is other, len(pairs), pairs.ctypes.data)
        if found < 0:
            raise MemoryError("pairs of triangles")
    return pairs[:found]


@cache
def _code() -> "ctypes._NamedFuncPointer | None":
    folder = platformdirs.user_cache_path("fem_reference") / "compiled"
    try:
        code = native.library(Path(__file__).with_suffix(".c"), _FLAGS, folder).near_pairs
    except (OSError, RuntimeError):
        return None
    code.argtypes = [_Triangles, _Triangles, ctypes.c_int, ctypes.c_int64, ctypes.c_void_p]
    code.restype = ctypes.c_int64
    return code
