"""Approximation of a function of a few uniformly distributed variables by a Gaussian process fitted to runs, and its sensitivities.

The process has a linear trend and a squared exponential covariance with a length scale for each variable. The length scales and the
noise maximise the profile likelihood (Rasmussen and Williams 2006, Gaussian Processes for Machine Learning, sections 2.7 and
5.4.1), with the optimal trend and one optimal variance for all outputs. Sobol's indices are estimated by sampling: first-order
indices as in Saltelli et al. 2010 (doi 10.1016/j.cpc.2009.09.018), total indices as in Jansen 1999.
"""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy.linalg import cho_factor, cho_solve
from scipy.optimize import minimize
from scipy.spatial.distance import cdist

from fem_reference.foundations.mesh import Floats

_GROUPS = 10  # the number of groups of runs; each group is left out in turn
_LENGTHS, _NOISE = (0.2, 40.0), (1e-10, 0.1)  # limits; the noise is relative to the variance about the trend
_START = 1.0, 1e-4
_LEAST = 1e-24  # the minimum variance about the trend, as a fraction of the squared outputs, which the trend may reproduce exactly
_SAMPLES = 13  # the base-2 logarithm of the number of samples


@dataclass(frozen=True, eq=False)
class GaussianProcess:
    """The process through outputs (n, q) at ``points`` (n, d) with coordinates from -1 to 1.

    ``logs`` (d + 1,): the logarithms of the length scale of each variable and of the noise. ``trend`` (1 + d, q): the coefficients
    of the linear trend. ``weights`` (n, q): the weights of the points. ``error``: the mean square error at runs that were left out
    of all fits, including those of length scales and noise, relative to the variance of the outputs.
    """

    points: Floats
    logs: Floats
    trend: Floats
    weights: Floats
    error: float = np.nan

    def __call__(self, points: Floats) -> Floats:
        """The outputs (m, q) at ``points`` (m, d)."""
        return np.asarray(_terms(points) @ self.trend + _covariance(points, self.points, self.logs) @ self.weights)

    @property
    def first(self) -> Floats:
        """The fraction (d,) of the variance due to each variable alone."""
        return np.asarray(self._shares[0])

    @property
    def total(self) -> Floats:
        """The fraction (d,) of the variance due to each variable, alone and together with other variables."""
        return np.asarray(self._shares[1])

    @cached_property
    def _shares(self) -> Floats:
        """Both fractions (2, d), from samples of pairs of independent points; one variable at a time is exchanged between them."""
        from scipy.stats import qmc  # importing takes half a second, and few processes need it

        variables = self.points.shape[1]
        both = 2 * qmc.Sobol(2 * variables, rng=np.random.default_rng(0)).random_base2(_SAMPLES) - 1
        one, other = both[:, :variables], both[:, variables:]
        here, there = self(one), self(other)
        shares = []
        for i in range(variables):
            mixed = self(np.where(np.arange(variables) == i, other, one))
            shares.append((((there - here.mean(axis=0)) * (mixed - here)).mean(), ((here - mixed) ** 2).mean() / 2))
        return np.asarray(np.array(shares).T * here.shape[1] / here.var(axis=0).sum())


def fit(points: Floats, outputs: Floats) -> GaussianProcess | None:
    """Fit a process to ``outputs`` (n, q) at ``points`` (n, d) with coordinates from -1 to 1, and compute its error. Returns None
    if the outputs do not vary.

    >>> points = np.linspace(-1, 1, 12)[:, None]
    >>> float(fit(points, np.sin(3 * points))(np.array([[0.5]]))[0, 0].round(3))
    0.997
    """
    if not (np.isfinite(points).all() and np.isfinite(outputs).all()):
        raise ValueError("points and outputs must be finite: leave out runs without a value")
    variance = float(outputs.var(axis=0).sum())
    if variance <= (1e-12 * np.abs(outputs).max(initial=0.0)) ** 2:
        return None
    length, noise = _START
    whole = _fitted(points, outputs, np.log([*np.full(points.shape[1], length), noise]))
    missed = 0.0
    for i in range(min(_GROUPS, len(points))):
        out = np.arange(len(points)) % _GROUPS == i
        found = _fitted(points[~out], outputs[~out], whole.logs)
        missed += float(((found(points[out]) - outputs[out]) ** 2).sum())
    return replace(whole, error=missed / (len(points) * variance))


def _fitted(points: Floats, outputs: Floats, start: Floats) -> GaussianProcess:
    """The process of maximum likelihood, searched for from the logarithms ``start`` (d + 1,)."""
    bounds = [tuple(np.log(_LENGTHS))] * points.shape[1] + [tuple(np.log(_NOISE))]
    found = minimize(_unlikely, start, (points, outputs), jac=True, method="L-BFGS-B", bounds=bounds).x
    return GaussianProcess(points, found, *_solved(points, outputs, found)[:2])


def _unlikely(logs: Floats, points: Floats, outputs: Floats) -> tuple[float, Floats]:
    """The negative logarithm of the likelihood, up to a constant, and its derivatives (d + 1,) with respect to ``logs``."""
    trend, weights, factor = _solved(points, outputs, logs)
    squares = max(float(((outputs - _terms(points) @ trend) * weights).sum()), _LEAST * float((outputs**2).sum()))
    value = np.log(np.diag(factor[0])).sum() + len(points) / 2 * np.log(squares)
    pull = cho_solve(factor, np.eye(len(points))) - len(points) / squares * weights @ weights.T
    near = pull * _covariance(points, points, logs) / 2
    slopes = [(near * (one[:, None] - one) ** 2).sum() for one in (points / np.exp(logs[:-1])).T]
    return float(value), np.array([*slopes, np.exp(logs[-1]) * np.trace(pull) / 2])


def _solved(points: Floats, outputs: Floats, logs: Floats) -> tuple[Floats, Floats, tuple[Floats, bool]]:
    """The optimal trend (1 + d, q), the weights (n, q), and the Cholesky factor of the covariance of the points."""
    factor = cho_factor(_covariance(points, points, logs) + np.exp(logs[-1]) * np.eye(len(points)), lower=True)
    terms = _terms(points)
    trend = np.linalg.solve(terms.T @ cho_solve(factor, terms), terms.T @ cho_solve(factor, outputs))
    return trend, cho_solve(factor, outputs - terms @ trend), factor


def _covariance(points: Floats, others: Floats, logs: Floats) -> Floats:
    """The covariance (m, n) between ``points`` (m, d) and ``others`` (n, d), without noise."""
    lengths = np.exp(logs[:-1])
    return np.asarray(np.exp(-cdist(points / lengths, others / lengths, "sqeuclidean") / 2))


def _terms(points: Floats) -> Floats:
    """The terms (m, 1 + d) of the trend at ``points`` (m, d): 1 and the coordinates."""
    return np.column_stack([np.ones(len(points)), points])
