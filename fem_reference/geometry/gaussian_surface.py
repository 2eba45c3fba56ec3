"""Closed surfaces: level sets of a sum of Gaussians (report DCSE/TR-2022-03, 7.1; Carr et al. 2001, doi 10.1145/383259.383266)."""

from dataclasses import dataclass

import igl
import numpy as np
import scipy
from scipy.spatial.distance import cdist

from fem_reference.foundations.errors import InputError
from fem_reference.foundations.mesh import Floats, Surface, enclosed_volume
from fem_reference.geometry.distance import farthest_points

# The number of points inside the surface from which the initial centres are chosen, and the number of vertices used in the fit.
_INSIDE, _SAMPLES = 20_000, 1500
# The distance from the surface to the samples on both sides of it, relative to the edge of a cube with the volume of the surface.
_BESIDE = 0.05
# The number of rounds of the fit, and the maximum number of evaluations in each round. Each round uses the gradients that
# the level has at the samples when the round begins.
_ROUNDS, _STEPS = 6, 8
# The minimum and the maximum radius of a Gaussian, relative to the edge of a cube with the volume of the surface.
_RADII = (0.02, 2.0)
# The maximum number of Newton steps, and their tolerance: the longest step divided by the smallest radius.
_PROJECTIONS, _THERE = 12, 1e-9


@dataclass(frozen=True, eq=False)
class GaussianSurface:
    """The surface on which ``sum_i exp(-|x - centres_i|^2 / radii_i^2)`` is 1. ``centres`` (m, 3) and ``radii`` (m,) [mm] are four
    parameters for each Gaussian. One Gaussian gives a point; n Gaussians of radius r about one centre give a sphere of radius
    ``r sqrt(log n)``.
    """

    centres: Floats
    radii: Floats

    def level(self, points: Floats) -> tuple[Floats, Floats, Floats]:
        """Return three quantities at ``points`` (n, 3): the log of the sum (n,), which is positive inside the surface; its gradient
        (n, 3) [1/mm]; and the share (n, m) of each Gaussian in the sum.
        """
        exponents = -cdist(points, self.centres, "sqeuclidean") / self.radii**2
        level = scipy.special.logsumexp(exponents, axis=1)
        shares = np.exp(exponents - level[:, None])
        weights = 2 * shares / self.radii**2
        return level, weights @ self.centres - points * weights.sum(axis=1)[:, None], shares

    def project(self, points: Floats, levels: Floats | float = 0.0) -> Floats:
        """Move ``points`` (n, 3) along the gradient to ``levels`` (n,), by Newton steps no longer than the smallest radius."""
        longest = float(self.radii.min())
        for _ in range(_PROJECTIONS):
            level, gradient, _ = self.level(points)
            squares = np.maximum((gradient**2).sum(axis=1), np.finfo(float).tiny)
            step = ((levels - level) / squares)[:, None] * gradient
            sizes = np.linalg.norm(step, axis=1)
            points = points + step * np.minimum(1, longest / np.maximum(sizes, 1e-300))[:, None]
            if sizes.max(initial=0.0) < _THERE * longest:
                break
        return points


def fit(surface: Surface, count: int) -> GaussianSurface:
    """Fit ``count`` Gaussians to a closed ``surface``, by nonlinear least squares, robust against outliers, of the distances at
    vertices and at points on both sides of them.

    The fit is deterministic. Rotating or scaling the surface rotates or scales the fit, up to rounding, if the principal axes of
    the surface are distinct.
    """
    middle, size = surface.points.mean(axis=0), float(np.cbrt(enclosed_volume(surface.points, surface.triangles)))
    axes = _axes(surface.points - middle)
    found = _fit(surface.moved_to((surface.points - middle) @ axes.T / size), count)
    return GaussianSurface(size * found.centres @ axes + middle, size * found.radii)


def _fit(surface: Surface, count: int) -> GaussianSurface:
    """Fit ``count`` Gaussians to a ``surface`` of volume 1 whose principal axes are the coordinate axes."""
    bounds, inside = np.log(_RADII), _inside(surface)
    if not 2 <= count <= len(inside):
        raise InputError("gaussians", count, f"2 to {len(inside)}, the number of points inside the surface")
    centres, found = scipy.cluster.vq.kmeans2(inside, inside[farthest_points(inside, count)], minit="matrix")
    squares = np.bincount(found, ((inside - centres[found]) ** 2).sum(axis=1), count)
    spread = np.maximum(squares / np.maximum(np.bincount(found, minlength=count), 1), 1.01 * np.exp(2 * bounds[0]))
    samples, distances = _samples(surface)
    unknowns = np.concatenate([centres.ravel(), np.log(1.2 * np.sqrt(spread))])
    low, high = surface.points.min(axis=0), surface.points.max(axis=0)
    boxes = zip((low, high), bounds, strict=True)
    within = tuple(np.concatenate([np.tile(box, count), np.full(count, end)]) for box, end in boxes)
    for _ in range(_ROUNDS):
        slopes = np.linalg.norm(_surface(unknowns).level(samples)[1], axis=1)
        lengths = 1 / np.maximum(slopes, np.quantile(slopes, 0.05))
        unknowns = scipy.optimize.least_squares(
            lambda q, lengths=lengths: _surface(q).level(samples)[0] * lengths - distances,
            unknowns,
            jac=lambda q, lengths=lengths: _slopes(_surface(q), samples) * lengths[:, None],
            bounds=within,
            x_scale="jac",
            loss="soft_l1",
            f_scale=_BESIDE,
            max_nfev=_STEPS,
        ).x
    return _surface(unknowns)


def _surface(unknowns: Floats) -> GaussianSurface:
    """Return the surface for the ``unknowns``: the centres, followed by the logarithms of the radii."""
    count = len(unknowns) // 4
    return GaussianSurface(unknowns[: 3 * count].reshape(count, 3), np.exp(unknowns[3 * count :]))


def _slopes(surface: GaussianSurface, points: Floats) -> Floats:
    """Derivatives (n, 4 m) of the level at ``points`` (n, 3) with respect to the unknowns."""
    weights = 2 * surface.level(points)[2] / surface.radii**2
    away = points[:, None] - surface.centres
    by_centre = weights[:, :, None] * away
    return np.hstack([by_centre.reshape(len(points), -1), weights * (away**2).sum(axis=2)])


def _samples(surface: Surface) -> tuple[Floats, Floats]:
    """Return points (k, 3), which are vertices and points on both sides of them, and their distances (k,) from the surface."""
    some = farthest_points(surface.points, _SAMPLES)
    points, normals = surface.points[some], igl.per_vertex_normals(surface.points, surface.triangles)[some]
    sides = np.array([0.0, _BESIDE, -_BESIDE])
    return np.concatenate([points - side * normals for side in sides]), np.repeat(sides, len(some))


def _axes(away: Floats) -> Floats:
    """Principal axes (3, 3), right-handed, of points at ``away`` (n, 3) from their mean; the first two point to the longer tail."""
    axes = np.linalg.svd(away, full_matrices=False)[2]
    first, second = np.where(((away @ axes[:2].T) ** 3).sum(axis=0)[:, None] < 0, -axes[:2], axes[:2])
    return np.stack([first, second, np.cross(first, second)])


def _inside(surface: Surface) -> Floats:
    """Nodes (k, 3) of a cubic grid that are inside the ``surface``."""
    step = float(np.cbrt(1 / _INSIDE))
    low, high = surface.points.min(axis=0), surface.points.max(axis=0)
    ticks = [np.arange(start + step / 2, end, step) for start, end in zip(low, high, strict=True)]
    nodes = np.stack(np.meshgrid(*ticks, indexing="ij"), axis=-1).reshape(-1, 3)
    return np.asarray(nodes[igl.fast_winding_number(surface.points, surface.triangles, nodes) > 0.5])
