"""Lower bounds on the distance from a point within which a tricubic spline on a grid stays above a level."""

from dataclasses import dataclass

import numpy as np
import scipy
from numpy.typing import NDArray

from fem_reference.foundations.mesh import Floats

# The matrix that converts the four B-spline coefficients of a cubic in a cell to its four Bernstein coefficients (rows).
_BERNSTEIN = np.array([[1, 4, 1, 0], [0, 4, 2, 0], [0, 2, 4, 0], [0, 1, 4, 1]]) / 6
_CHUNK = 20_000  # the number of cells per chunk


@dataclass(frozen=True, eq=False)
class Clearance:
    """Clearance of points, tabulated at the nodes of a grid. ``away`` (i, j, k): the distance [mm] from each node to the nearest
    cell in which the spline may be at or below the level. ``origin``: the position of the first node; ``spacing`` [mm]: the
    distance between nodes. Outside the grid the spline is above the level.
    """

    away: Floats
    origin: Floats
    spacing: float

    def __call__(self, points: Floats) -> Floats:
        """Lower bound (n,) on the clearance [mm] of ``points`` (n, 3): 0 or less if none is certain, NaN for NaN coordinates."""
        at = (points - self.origin) / self.spacing
        known = np.isfinite(at).all(axis=1)
        at = np.where(known[:, None], at, 0.0)
        within = np.clip(at, 0, np.array(self.away.shape) - 1)
        nodes = np.rint(within).astype(np.int64)
        found = self.away[tuple(nodes.T)] - self.spacing * np.linalg.norm(within - nodes, axis=1)
        beyond = self.spacing * np.linalg.norm(at - within, axis=1)
        # The grid is convex, so the segment from the point to the nearest point of the grid makes an angle of at least 90 degrees
        # with any segment from that nearest point into the grid.
        found = np.where(beyond > 0, np.hypot(beyond, np.maximum(found, 0)), found)
        return np.where(known, found, np.nan)


def of_spline(coefficients: Floats, origin: Floats, spacing: float, level: float) -> Clearance:
    """Clearance of the spline with B-spline ``coefficients`` (i, j, k), which is defined from the second to the last but one node
    along each axis. ``origin``: the position of the first node; ``spacing`` [mm]: the distance between nodes.
    """
    low = _may_be_low(coefficients, level)
    nodes = np.zeros(coefficients.shape, bool)
    for corner in np.ndindex(2, 2, 2):
        nodes[tuple(slice(1 + i, 1 + i + count) for i, count in zip(corner, low.shape, strict=True))] |= low
    away = (
        scipy.ndimage.distance_transform_edt(~nodes, sampling=spacing) if nodes.any() else np.full(nodes.shape, np.inf)
    )
    return Clearance(np.asarray(away), np.asarray(origin, float), spacing)


def _may_be_low(coefficients: Floats, level: float) -> NDArray[np.bool_]:
    """Mask of the cells, three fewer than ``coefficients`` along each axis, in which a spline may be at or below ``level``.

    In a cell, the smallest of the 64 coefficients is a lower bound on the spline, and the smallest Bernstein coefficient is a
    tighter bound. The largest coefficient is an upper bound, so if it is at or below the level, no further check is needed.
    """
    found = _least_of_four(coefficients) <= level
    cells = np.argwhere(found & (-_least_of_four(-coefficients) > level))
    for first in range(0, len(cells), _CHUNK):
        i, j, k = cells[first : first + _CHUNK].T
        around = np.lib.stride_tricks.sliding_window_view(coefficients, (4, 4, 4))[i, j, k]
        least = (_BERNSTEIN @ (_BERNSTEIN @ (around @ _BERNSTEIN.T)).reshape(-1, 4, 16)).min(axis=(1, 2))
        found[i, j, k] = least <= level
    return found


def _least_of_four(values: NDArray[np.float64]) -> NDArray[np.float64]:
    """Minimum of each block of four values along each axis; the result is shorter than ``values`` by three along each axis."""
    return np.asarray(scipy.ndimage.minimum_filter(values, size=4)[(slice(2, -1),) * values.ndim])
