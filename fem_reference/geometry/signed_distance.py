"""Signed distance to a bone with a triangulated surface, sampled once on a regular grid, inside which it is twice differentiable.

Tricubic B-splines interpolate between the nodes, so gradient and curvature are continuous, as Newton's method requires.
"""

import logging
import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any

import igl
import numpy as np
import scipy

from fem_reference.foundations.mesh import (
    Floats,
    Ints,
    Surface,
    check_closed,
    check_finite,
    fingerprint,
    read_only,
    triangle_areas,
)
from fem_reference.geometry.clearance import Clearance, of_spline
from fem_reference.geometry.distance import distances, inside
from fem_reference.geometry.kept_meshes import code, kept
from fem_reference.geometry.rigid_bodies import Sampled, Vector

# The distance [mm] returned outside a grid: greater than any real distance, but finite.
FAR = 1e6
# The maximum number of nodes of a grid that ``resolve`` refines: 256 cubed, 134 MB.
MOST_NODES = 2**24
# The approximate number of cells along the longest edge of the first grid of ``resolve``.
_FIRST_CELLS = 24
# The distance is exact at the nodes up to this many cells beyond the margin: in a spline, the influence of an error falls by 73 %
# per cell.
_FORGETTING = 4
# The distance is exact at every fourth node along each axis; at the other nodes, it is exact only near the surface.
_STRIDE = 4
# The number of random points on and around the surface at which the error is sampled.
_PROBES = 30_000
_CHUNK = 1_000_000
# The number of points evaluated at a time.
_AT_ONCE = 10_000
# The polynomial coefficients, for the powers 0 to 3 (columns), of the four cubic B-splines that extend into a cell (rows).
_SPLINES = np.array([[1, -3, 3, -1], [4, 0, -6, 3], [1, 3, 3, -3], [0, 0, 0, 1]]) / 6

logger = logging.getLogger(__name__)


@dataclass(frozen=True, eq=False)
class Grid:
    """The shape of a bone whose signed distance is a tricubic spline.

    ``coefficients`` (i, j, k) [mm]: the coefficients of B-splines about nodes ``spacing`` [mm] apart. ``origin`` [mm]: the
    node with the lowest x, y and z. The distance is valid within ``margin`` [mm] of the surface; farther away it is less accurate,
    and it is ``FAR`` outside the grid. ``error`` [mm]: the largest sampled difference from the exact distance within one spacing of
    the surface. ``mean_error`` [mm]: the root mean square, not the mean, of these differences. Farther away, ridges between two
    close parts of the surface are rounded, like edges, by a third of a spacing. The gradient has length 1 to within a few per cent,
    except on edges.
    """

    coefficients: Floats
    origin: Vector
    spacing: float
    margin: float
    error: float
    mean_error: float

    def __post_init__(self) -> None:
        object.__setattr__(self, "coefficients", read_only(self.coefficients, np.float64))

    @cached_property
    def steepest(self) -> float:
        """An upper bound on the gradient: along each axis a spline is no steeper than the steps between its coefficients."""
        steps = [np.abs(np.diff(self.coefficients, axis=axis)).max() for axis in range(3)]
        return float(np.linalg.norm(steps)) / self.spacing

    @cached_property
    def half_thickness(self) -> float:
        """An upper bound on the depth [mm], from the smallest coefficient; infinite if the nodes are too far apart to give one."""
        deepest = float(-self.coefficients.min())
        return deepest if deepest > self.spacing else np.inf

    def clearance(self, within: float) -> Clearance:
        """Return a lower bound on the length of paths from given points to any point whose distance is at most ``within`` [mm]."""
        return of_spline(self.coefficients, np.asarray(self.origin), self.spacing, within)

    def sample(self, points: Floats) -> Sampled:
        """Distance, gradient and curvature at ``points`` (n, 3) [mm]: ``FAR`` and 0 outside the grid, NaN for NaN coordinates."""
        found = Sampled(np.full(len(points), FAR), np.zeros((len(points), 3)), np.zeros((len(points), 3, 3)))
        found.distance[~np.isfinite(points).all(axis=1)] = np.nan
        for chunk, at in self._inside(points):
            for whole, part in zip(found, self._interpolate(at), strict=True):
                whole[chunk] = part
        return found

    def distances(self, points: Floats) -> Floats:
        """The distance (n,) of :meth:`sample`, without the derivatives, in half the time."""
        found = np.where(np.isfinite(points).all(axis=1), FAR, np.nan)
        for chunk, at in self._inside(points):
            found[chunk] = self._values(at, 1).ravel()
        return found

    def _inside(self, points: Floats) -> Iterator[tuple[Ints, Floats]]:
        """Yield chunks of the indices of ``points`` (n, 3) inside the grid, and their positions from the origin in cells."""
        at = (points - self.origin) / self.spacing
        inside = np.flatnonzero(((at >= 1) & (at <= np.array(self.coefficients.shape) - 2)).all(axis=1))
        for chunk in np.split(inside, range(_AT_ONCE, len(inside), _AT_ONCE)) if len(inside) else ():
            yield chunk, at[chunk]

    def _values(self, at: Floats, orders: int) -> Floats:
        """Derivatives (n, orders, orders, orders) of order 0 to ``orders`` - 1 along x, y and z, at positions (n, 3) in cells."""
        shape = self.coefficients.shape
        cell = np.minimum(at.astype(np.int64), np.array(shape) - 3)
        x, y, z = (_weights(at[:, axis] - cell[:, axis], orders) for axis in range(3))
        first = np.ravel_multi_index(tuple(cell.T - 1), shape)
        reach = np.ravel_multi_index(tuple(np.indices((4, 4, 4)).reshape(3, -1)), shape)
        around = self.coefficients.ravel()[first[:, None] + reach].reshape(-1, 4, 4, 4)
        values = x @ (y[:, None] @ (around @ z.transpose(0, 2, 1)[:, None])).reshape(-1, 4, orders**2)
        return np.asarray(values.reshape(-1, orders, orders, orders))

    def _interpolate(self, at: Floats) -> Sampled:
        """Distance and its first two derivatives at positions (n, 3) in units of cells from the origin."""
        values = self._values(at, 3)
        curvature = np.empty((len(at), 3, 3))
        for i, j in np.ndindex(3, 3):
            curvature[:, i, j] = values[:, *(np.eye(3, dtype=int)[i] + np.eye(3, dtype=int)[j])]
        gradient = np.stack([values[:, 1, 0, 0], values[:, 0, 1, 0], values[:, 0, 0, 1]], axis=1)
        return Sampled(values[:, 0, 0, 0], gradient / self.spacing, curvature / self.spacing**2)


def _weights(within: Floats, orders: int) -> Floats:
    """Derivatives of orders below ``orders`` (n, orders, 4) of the four B-splines of a cell at ``within`` (n,), from 0 to 1."""
    one, none = np.ones_like(within), np.zeros_like(within)
    found = [np.stack([one, within, within**2, within**3], axis=1)]
    if orders > 1:
        found.append(np.stack([none, one, 2 * within, 3 * within**2], axis=1))
        found.append(np.stack([none, none, 2 * one, 6 * within], axis=1))
    return np.stack(found, axis=1) @ _SPLINES.T


def build(surface: Surface, spacing: float, margin: float, rounding: float = 0.0) -> Grid:
    """Sample the signed distance to a closed ``surface`` on a grid with nodes ``spacing`` [mm] apart; it is valid within
    ``margin`` [mm] of the surface. Triangles may have any orientation. Raises InputError if the surface does not bound one body
    (see ``check_closed``).

    ``rounding`` is the standard deviation s [mm] of a Gaussian filter of the distance, used because contact does not slide smoothly
    over the edges between flat triangles. A surface with a mean curvature of 1/r moves inward by s^2/r; this is part of the error.
    """
    surface = _outward(surface)
    return _measured(_sampled(surface, spacing, margin)(rounding), surface)


def resolve(surface: Surface, error: float, margin: float, rounding: float = 0.0) -> Grid:
    """Return the grid of :func:`build` at a spacing that is halved until the grid without rounding has a ``mean_error`` of at most
    ``error`` [mm], or until ``MOST_NODES`` would be exceeded.

    The largest error would not be a suitable criterion: on sharp edges and thin rims, which a grid rounds, it decreases only in
    proportion to the spacing, and in a slit narrower than a cell it does not decrease.
    """
    surface = _outward(surface)
    spacing = float(np.ptp(surface.points, axis=0).max()) / _FIRST_CELLS
    fitted = _sampled(surface, spacing, margin)
    while not (reached := _rms(_beside(fitted(0.0), surface))) <= error:
        spacing /= 2
        if math.prod(_extent(surface, spacing, margin)[1]) > MOST_NODES:
            logger.warning("%s: distance error of %.3g mm instead of %.3g mm", surface.place, reached, error)
            break
        fitted = _sampled(surface, spacing, margin)
    return _measured(fitted(rounding), surface)


def cached(surface: Surface, error: float, margin: float, rounding: float, folder: Path) -> Grid:
    """Return the grid of :func:`resolve`, stored in ``folder`` under a hash of its inputs and of the code that computes it."""
    source = np.frombuffer(code().encode(), np.uint8)
    name = fingerprint(surface.points, surface.triangles, np.array([error, margin, rounding]), source)
    path = folder / f"distance_{name[:32]}.npz"
    return kept(path, lambda: resolve(surface, error, margin, rounding), lambda grid: vars(grid), _grid)


def _outward(surface: Surface) -> Surface:
    """Return a closed surface with outward triangles; InputError if it does not bound one body."""
    check_finite(surface)
    outward, _ = igl.bfs_orient(surface.triangles)
    return check_closed(Surface(surface.points, outward, surface.place))


def _sampled(surface: Surface, spacing: float, margin: float) -> Callable[[float], Grid]:
    """Sample the distance to an outward ``surface`` once. Returns a function that fits a grid, with unknown errors, to the samples
    after a Gaussian filter whose standard deviation [mm] is its argument.
    """
    low, shape = _extent(surface, spacing, margin)
    values = _on_nodes(surface, low, shape, spacing, margin)

    def fitted(rounding: float) -> Grid:
        filtered = scipy.ndimage.gaussian_filter(values, rounding / spacing, mode="nearest") if rounding > 0 else values
        return Grid(_coefficients(filtered), tuple((low - spacing).tolist()), spacing, margin, np.nan, np.nan)

    return fitted


def _grid(arrays: dict[str, Any]) -> Grid:
    numbers = (float(arrays[name]) for name in ("spacing", "margin", "error", "mean_error"))
    return Grid(arrays["coefficients"], tuple(arrays["origin"].tolist()), *numbers)


def _extent(surface: Surface, spacing: float, margin: float) -> tuple[Floats, tuple[int, ...]]:
    """Return the first node (3,) [mm] of a grid that extends ``margin`` and a cell beyond ``surface``, and the number of nodes."""
    low, high = surface.points.min(axis=0) - margin - spacing, surface.points.max(axis=0) + margin + spacing
    return low, tuple(int(count) for count in np.ceil((high - low) / spacing) + 1)


def signed_distances(points: Floats, surface: Surface) -> Floats:
    """Exact distance (n,) [mm] of ``points`` (n, 3) to a closed ``surface``, negative inside according to the winding number."""
    found = [
        np.where(inside(surface, chunk), -1.0, 1.0) * distances(chunk, surface).distance
        for chunk in np.array_split(np.ascontiguousarray(points), 1 + len(points) // _CHUNK)
    ]
    return np.concatenate(found)


def _on_nodes(surface: Surface, low: Floats, shape: tuple[int, ...], spacing: float, margin: float) -> Floats:
    """Distance at the nodes: exact within the margin and a few cells beyond it, elsewhere interpolated from every fourth node."""
    coarse_shape = [-(-(count - 1) // _STRIDE) + 1 for count in shape]
    coarse_points = low + np.moveaxis(np.indices(coarse_shape), 0, -1).reshape(-1, 3) * (_STRIDE * spacing)
    coarse = signed_distances(coarse_points, surface).reshape(coarse_shape)
    stretch = [((count - 1) * _STRIDE + 1) / count for count in coarse_shape]
    values: Floats = scipy.ndimage.zoom(coarse, stretch, order=1)[tuple(slice(count) for count in shape)]
    # The error of interpolated values is at most half the diagonal of a coarse cell, as the gradient of a distance has length 1.
    near = np.abs(values) < margin + (_FORGETTING + 0.75**0.5 * _STRIDE) * spacing
    values[near] = signed_distances(low + np.argwhere(near) * spacing, surface)
    return values


def _coefficients(values: Floats) -> Floats:
    """Coefficients of the B-splines through ``values`` (i, j, k), with one more on each side by odd reflection at the border."""
    beyond = np.pad(values, _FORGETTING, mode="reflect", reflect_type="odd")
    keep = slice(_FORGETTING - 1, 1 - _FORGETTING)
    return np.asarray(scipy.ndimage.spline_filter(beyond, order=3)[keep, keep, keep])


def _measured(grid: Grid, surface: Surface) -> Grid:
    """Return the grid with its errors [mm]: the largest one on the surface and near it, and the root mean square near it."""
    beside = _beside(grid, surface)
    largest = max(np.abs(grid.distances(_on(surface))).max(), np.abs(beside).max())
    return replace(grid, error=float(largest), mean_error=_rms(beside))


def _beside(grid: Grid, surface: Surface) -> Floats:
    """Return the differences (n,) [mm] between the distance on a grid and the exact distance, at random points near the surface."""
    around = _around(surface, grid.spacing)
    return grid.distances(around) - signed_distances(around, surface)


def _rms(differences: Floats) -> float:
    return float(np.sqrt(np.mean(differences**2)))


def _on(surface: Surface) -> Floats:
    """Return all vertices, edge midpoints and triangle centroids, and random points on edges (more on longer ones): (n, 3) [mm]."""
    random = np.random.default_rng(0)
    ends = surface.points[surface.triangles[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2)]
    lengths = np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1)
    chosen = ends[random.choice(len(ends), _PROBES, p=lengths / lengths.sum())]
    along = random.uniform(size=(_PROBES, 1))
    edges = chosen[:, 0] * (1 - along) + chosen[:, 1] * along
    return np.concatenate([surface.points, ends.mean(axis=1), surface.points[surface.triangles].mean(axis=1), edges])


def _around(surface: Surface, reach: float) -> Floats:
    """Return random points (n, 3) on the triangles, moved by up to ``reach`` [mm] in any direction; the same on every call."""
    random = np.random.default_rng(1)
    areas = triangle_areas(surface.points, surface.triangles)
    corners = surface.points[surface.triangles[random.choice(len(areas), _PROBES, p=areas / areas.sum())]]
    shift = random.normal(size=(_PROBES, 3))
    shift *= reach * random.uniform(size=(_PROBES, 1)) / np.linalg.norm(shift, axis=1, keepdims=True)
    return np.asarray(np.einsum("nk,nkd->nd", random.dirichlet(np.ones(3), _PROBES), corners) + shift)
