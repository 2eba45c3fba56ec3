"""Sums of Gaussians for scattered values, with centres from a grid, Halton's sequence, a greedy search or features.

Numbers such as 3.6 refer to report DCSE/TR-2022-03.
"""

from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree
from scipy.spatial.distance import cdist

from fem_reference.foundations.errors import InputError
from fem_reference.foundations.mesh import Floats


@dataclass(frozen=True, eq=False)
class RadialSum:
    """``sum_i weights_i exp(-(shape |x - centres_i|)^2)`` plus an optional polynomial of degree 0 or 1 (3.6, 3.7, 3.10).

    ``centres`` (m, d), ``weights`` (m,); ``polynomial``: the coefficients (0,), (1,) or (d + 1,); ``shape``: an inverse length;
    ``condition``: the condition number of the matrix from which the weights were computed.
    """

    centres: Floats
    weights: Floats
    polynomial: Floats
    shape: float
    condition: float

    def __call__(self, points: Floats) -> Floats:
        """Evaluate the sum at ``points`` (n, d); returns (n,)."""
        found = _gaussians(points, self.centres, self.shape) @ self.weights
        return np.asarray(found + _monomials(points, len(self.polynomial)) @ self.polynomial)


def radial_sum(points: Floats, values: Floats, centres: Floats, shape: float, *, terms: int = 0) -> RadialSum:
    """Fit a sum with the ``centres`` (m, d) to ``values`` (n,) at ``points`` (n, d) by least squares. With as many centres as
    points, the sum interpolates the values. The polynomial has 0, 1 or d + 1 ``terms``; the weights are orthogonal to it (3.10).
    """
    if len(centres) > len(points) or len(centres) <= terms:
        raise InputError("centres", len(centres), f"more than {terms} and at most {len(points)}, the number of points")
    basis = np.hstack([_gaussians(points, centres, shape), _monomials(points, terms)])
    # The weights are orthogonal to the polynomials: they lie in the null space of the polynomials at the centres.
    flat = np.linalg.qr(_monomials(centres, terms), mode="complete").Q[:, terms:]
    free = np.hstack([basis[:, : len(centres)] @ flat, basis[:, len(centres) :]])
    found, _, _, singular = np.linalg.lstsq(free, values, rcond=None)
    inner = found.shape[0] - terms
    return RadialSum(centres, flat @ found[:inner], found[inner:], shape, float(singular[0] / singular[-1]))


def _gaussians(points: Floats, centres: Floats, shape: float) -> Floats:
    """Basis functions (n, m) of the ``centres`` (m, d) at ``points`` (n, d)."""
    return np.asarray(np.exp(-((shape * cdist(points, centres)) ** 2)))


def _monomials(points: Floats, terms: int) -> Floats:
    """First ``terms`` of the monomials 1, x, y, ... at ``points`` (n, d); returns (n, terms)."""
    return np.hstack([np.ones((len(points), 1)), points])[:, :terms]


def grid_centres(points: Floats, count: int) -> Floats:
    """Return at most ``count`` centres, at the nodes of a regular grid over the bounding box of ``points`` (n, d)."""
    low, high = points.min(axis=0), points.max(axis=0)
    each = int(count ** (1 / points.shape[1]) + 1e-9)
    axes = np.meshgrid(*[np.linspace(a, b, each) for a, b in zip(low, high, strict=True)], indexing="ij")
    return np.stack([axis.ravel() for axis in axes], axis=1)


def halton(count: int, dimensions: int) -> Floats:
    """First ``count`` points (count, d) of Halton's sequence, with the first primes as bases, in the open unit cube (3.8)."""
    from scipy.stats import qmc  # imported here because the import takes half a second

    return np.asarray(qmc.Halton(dimensions, scramble=False).fast_forward(1).random(count))


def halton_centres(points: Floats, count: int) -> Floats:
    """Return ``count`` centres from Halton's sequence in the bounding box of ``points`` (n, d)."""
    low, high = points.min(axis=0), points.max(axis=0)
    return low + (high - low) * halton(count, points.shape[1])


def greedy_centres(points: Floats, values: Floats, count: int, shape: float, *, terms: int = 0) -> Floats:
    """Choose ``count`` of ``points`` (n, d), each where the sum with the previous centres deviates most from ``values`` (n,)."""
    chosen = list(np.argsort(-np.abs(values - values.mean()), kind="stable")[: terms + 1])
    while len(chosen) < count:
        off = np.abs(values - radial_sum(points, values, points[chosen], shape, terms=terms)(points))
        off[chosen] = -1
        chosen.append(int(np.argmax(off)))
    return points[chosen[:count]]


def feature_centres(points: Floats, values: Floats, count: int, *, neighbours: int = 6) -> Floats:
    """Choose ``count`` of the ``points`` (n, d): first the local maxima and minima of ``values`` (n,) among the nearest
    ``neighbours``, then points whose values differ most from the mean of their neighbours' values (3.5.1).
    """
    _, near = cKDTree(points).query(points, k=min(neighbours + 1, len(points)))
    around = values[near[:, 1:]]
    extreme = (values > around.max(axis=1)) | (values < around.min(axis=1))
    bend = np.abs(values - around.mean(axis=1))
    return points[np.lexsort((-bend, ~extreme))[:count]]
