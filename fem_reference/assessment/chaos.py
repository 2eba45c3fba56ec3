"""Sparse polynomial chaos: a function of uniform variables as a sum of few products of Legendre polynomials, and its sensitivities.

The terms are chosen one after the other, each as the one that takes up most of what is left (orthogonal matching pursuit;
Baptista, Stolbunov and Nair 2019, doi 10.1016/j.jcp.2019.04.043), as many as give the least leave-one-out error. As terms that are
chosen from many, of the degree that suits best, follow even noise, the error that is stated is that at runs which took no part in
the choice. Sobol's indices are sums of squares of the coefficients (Sudret 2008, doi 10.1016/j.ress.2007.04.002); of several
outputs together they are those of the sum of their variances (Lamboni, Monod and Makowski 2011, doi 10.1016/j.ress.2010.09.002).
"""

from dataclasses import dataclass
from itertools import combinations_with_replacement
from math import comb

import numpy as np
from numpy.polynomial.legendre import legvander
from numpy.typing import NDArray

from fem_reference.foundations.mesh import Floats, Ints

DEGREE = 8  # the greatest of a term
# Terms to choose from, by the number of runs, and terms that are chosen, by their inverse.
_CANDIDATES, _CHOSEN = 8, 2
_GROUPS = 20  # of runs that are left out


@dataclass(frozen=True, eq=False)
class Chaos:
    """A polynomial of variables from -1 to 1: ``powers`` (k, d) of the terms, the constant first, and ``coefficients`` (k, q).

    ``error``: the mean square of the error at runs that were left out, terms and all, as a share of the variance of the outputs
    together; one run at a time of up to 20, and groups of them of more.
    """

    powers: Ints
    coefficients: Floats
    error: float

    def __call__(self, points: Floats) -> Floats:
        """The outputs (m, q) at ``points`` (m, d)."""
        return np.asarray(_terms(points, self.powers) @ self.coefficients)

    @property
    def first(self) -> Floats:
        """The share (d,) of the variance by each variable alone."""
        return self._share(np.equal((self.powers > 0).sum(axis=1), 1)[:, None] & (self.powers > 0))

    @property
    def total(self) -> Floats:
        """The share (d,) of the variance by each variable alone and with others."""
        return self._share(self.powers > 0)

    def _share(self, counted: NDArray[np.bool_]) -> Floats:
        """The shares (d,) of the variance in the terms that are ``counted`` (k, d)."""
        variances = (self.coefficients**2).sum(axis=1)
        return np.asarray(variances @ counted / variances[1:].sum())


def fit(points: Floats, outputs: Floats) -> Chaos | None:
    """The polynomial of ``outputs`` (n, q) at ``points`` (n, d) from -1 to 1; None where the outputs do not vary.

    >>> points = np.linspace(-1, 1, 8)[:, None]
    >>> float(fit(points, 3 * points + 1)(np.array([[0.5]]))[0, 0].round(9))
    2.5
    """
    if not (np.isfinite(points).all() and np.isfinite(outputs).all()):
        raise ValueError("finite points and outputs: a run without a value has no place in a surrogate")
    variance = float(outputs.var(axis=0).sum())
    if variance <= (1e-12 * np.abs(outputs).max(initial=0.0)) ** 2:
        return None
    powers = _candidates(points.shape[1], len(points))
    matrix, degrees = _terms(points, powers), powers.sum(axis=1)
    chosen, coefficients = _selected(matrix, degrees, outputs)
    missed = 0.0
    for i in range(min(_GROUPS, len(points))):
        out = np.arange(len(points)) % _GROUPS == i
        some, found = _selected(matrix[~out], degrees, outputs[~out])
        missed += float(((matrix[out][:, some] @ found - outputs[out]) ** 2).sum())
    return Chaos(powers[chosen], coefficients, missed / (len(points) * variance))


def _selected(matrix: Floats, degrees: Ints, outputs: Floats) -> tuple[list[int], Floats]:
    """The columns of a ``matrix`` (n, k) for ``outputs`` (n, q), the first always, and their coefficients (m, q): of those up to
    each degree the ones that :func:`_pursued` takes, and of these the ones with the least error.
    """
    counts = [int((degrees <= degree).sum()) for degree in range(1, degrees.max() + 1)]
    _, best = min(_pursued(matrix[:, :count], outputs) for count in counts)
    return best, np.linalg.lstsq(matrix[:, best], outputs, rcond=None)[0]


def _pursued(matrix: Floats, outputs: Floats) -> tuple[float, list[int]]:
    """Columns of a ``matrix`` (n, k), each next one the one that takes up most of what those before leave of ``outputs`` (n, q), in
    the number with the least leave-one-out error; and this sum of squares.
    """
    runs, count = matrix.shape
    left, weight, lengths = outputs, np.zeros(runs), np.linalg.norm(matrix, axis=0)
    chosen, basis, errors = list[int](), np.zeros((runs, 0)), list[float]()
    while len(chosen) < max(1, min(runs // _CHOSEN, count)):
        gains = np.linalg.norm(matrix.T @ left, axis=1) / lengths
        gains[chosen] = -1.0
        chosen.append(int(np.argmax(gains)) if chosen else 0)
        new = matrix[:, chosen[-1]]
        for _ in range(2):  # twice is enough against rounding
            new = new - basis @ (basis.T @ new)
        new = new / np.linalg.norm(new)
        basis = np.column_stack([basis, new])
        left, weight = left - np.outer(new, new @ left), weight + new**2
        errors.append(float(((left / (1 - weight)[:, None]) ** 2).sum()))
    best = int(np.argmin(errors))
    return errors[best], chosen[: best + 1]


def _candidates(variables: int, runs: int) -> Ints:
    """The powers (k, d) of all terms up to the greatest degree with not too many for so many ``runs``, the constant first."""
    degrees = (one for one in range(DEGREE, 1, -1) if comb(variables + one, one) <= _CANDIDATES * runs)
    chosen = [
        factors
        for degree in range(next(degrees, 1) + 1)
        for factors in combinations_with_replacement(range(variables), degree)
    ]
    return np.array([np.bincount(np.array(factors, int), minlength=variables) for factors in chosen])


def _terms(points: Floats, powers: Ints) -> Floats:
    """The terms (n, k) at ``points`` (n, d): of mean square 1 over the uniform variables, and orthogonal there."""
    degrees = np.arange(powers.max(initial=0) + 1)
    factors = legvander(points, degrees[-1]) * np.sqrt(2 * degrees + 1)
    return np.asarray(np.prod([factors[:, i, powers[:, i]] for i in range(points.shape[1])], axis=0))
