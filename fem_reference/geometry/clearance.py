"""The distance from a point, in any direction, within which a tricubic spline on a grid stays above a level."""

from dataclasses import dataclass

import numpy as np
import scipy
from numpy.typing import NDArray

from fem_reference.foundations.mesh import Floats

# Weights that give the four Bernstein coefficients of a cubic (rows) from the four B-spline coefficients of its cell.
_BERNSTEIN = np.array([[1, 4, 1, 0], [0, 4, 2, 0], [0, 2, 4, 0], [0, 1, 4, 1]]) / 6
_CHUNK = 20_000  # the number of cells per chunk


@dataclass(frozen=True, eq=False)
class Clearance:
    """``away`` (i, j, k): the distance [mm] from each node to the nearest cell in which the spline may fall to the level. The nodes
    are ``spacing`` [mm] apart, the first at ``origin``; outside the grid the spline stays above the level.
    """

    away: Floats
    origin: Floats
    spacing: float

    def __call__(self, points: Floats) -> Floats:
        """A lower bound (n,) on the clearance [mm] of ``points`` (n, 3), at most 0 if none is certain; NaN for NaN coordinates."""
        at = (points - self.origin) / self.spacing
        known = np.isfinite(at).all(axis=1)
        at = np.where(known[:, None], at, 0.0)
        within = np.clip(at, 0, np.array(self.away.shape) - 1)
        nodes = np.rint(within).astype(np.int64)
        found = self.away[tuple(nodes.T)] - self.spacing * np.linalg.norm(within - nodes, axis=1)
        beyond = self.spacing * np.linalg.norm(at - within, axis=1)
        # As the grid is convex, the segment to its nearest point is at 90 degrees or more to any segment from there into the grid.
        found = np.where(beyond > 0, np.hypot(beyond, np.maximum(found, 0)), found)
        return np.where(known, found, np.nan)


def of_spline(coefficients: Floats, origin: Floats, spacing: float, level: float) -> Clearance:
    """The clearance of a spline with ``coefficients`` (i, j, k) of B-splines, defined between the second nodes from either end."""
    low = _may_be_low(coefficients, level)
    nodes = np.zeros(coefficients.shape, bool)
    for corner in np.ndindex(2, 2, 2):
        nodes[tuple(slice(1 + i, 1 + i + count) for i, count in zip(corner, low.shape, strict=True))] |= low
    away = (
        scipy.ndimage.distance_transform_edt(~nodes, sampling=spacing) if nodes.any() else np.full(nodes.shape, np.inf)
    )
    return Clearance(np.asarray(away), np.asarray(origin, float), spacing)


def _may_be_low(coefficients: Floats, level: float) -> NDArray[np.bool_]:
    """Mask of the cells, three fewer along each axis, in which a spline may be at ``level`` or below. In a cell, the least
    of the 64 coefficients bounds the spline from below, and the least Bernstein coefficient does so more closely. The largest
    coefficient bounds it from above, so cells deep inside need no check.
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
    """The least of four consecutive values along each axis; the result is shorter by three along each."""
    return np.asarray(scipy.ndimage.minimum_filter(values, size=4)[(slice(2, -1),) * values.ndim])
