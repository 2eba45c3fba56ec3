"""How cost grows with the size of a problem: a power of it, by phase, with its uncertainty."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.special import stdtrit

from fem_reference.foundations.mesh import Floats

# How sure an extrapolation is.
CONFIDENCE = 0.95


@dataclass(frozen=True)
class Growth:
    """``cost`` of a ``solver`` over ``sizes`` (k,), unknowns, triangles or tets as ``counted`` says: ``values`` (k,), about
    ``size^exponent``. ``uncertainty``: the standard error of the exponent.
    """

    solver: str
    cost: str
    sizes: tuple[float, ...]
    values: tuple[float, ...]
    exponent: float
    uncertainty: float
    counted: str = "unknowns"

    def at(self, size: float) -> tuple[float, float, float]:
        """The cost expected at a ``size``, and its least and greatest value: the interval in which another measurement there would
        be found with ``CONFIDENCE``, if the power is the same that far.
        """
        x, y = np.log(np.array(self.sizes)), np.log(np.array(self.values))
        away = math.log(size) - float(x.mean())
        middle = float(y.mean()) + self.exponent * away
        rest = y - y.mean() - self.exponent * (x - x.mean())
        scatter = float(rest @ rest) / (len(x) - 2)
        spread = math.sqrt(scatter * (1 + 1 / len(x)) + (self.uncertainty * away) ** 2)
        reach = float(stdtrit(len(x) - 2, (1 + CONFIDENCE) / 2)) * spread
        return _exp(middle), _exp(middle - reach), _exp(middle + reach)

    @property
    def decades(self) -> float:
        """Over how many powers of ten of the size it was measured."""
        return math.log10(max(self.sizes) / min(self.sizes))


def growth(
    solver: str, cost: str, sizes: Sequence[float], values: Sequence[float], counted: str = "unknowns"
) -> Growth | None:
    """A line through costs over sizes in logarithms, by least squares; None for fewer than three sizes whose costs are above zero.

    >>> found = growth("pbd", "seconds", (10, 100, 1000), (1, 10, 100))
    >>> round(found.exponent, 6), round(found.uncertainty, 6)
    (1.0, 0.0)
    """
    known = [(size, value) for size, value in zip(sizes, values, strict=True) if value > 0 and math.isfinite(value)]
    if len({size for size, _ in known}) < 3:
        return None
    x, y = np.log(np.array(known)).T
    exponent, error = _slope(x, y)
    kept_sizes, kept_values = (tuple(map(float, column)) for column in zip(*known, strict=True))
    return Growth(solver, cost, kept_sizes, kept_values, exponent, error, counted)


def _slope(x: Floats, y: Floats) -> tuple[float, float]:
    """Slope and its standard error of a line through points by least squares."""
    centred = x - x.mean()
    slope = float(centred @ y / (centred @ centred))
    rest = y - y.mean() - slope * centred
    return slope, float(np.sqrt(rest @ rest / (len(x) - 2) / (centred @ centred)))


def _exp(x: float) -> float:
    """The exponential, infinite where it is beyond all numbers."""
    return math.exp(x) if x < 700 else math.inf
