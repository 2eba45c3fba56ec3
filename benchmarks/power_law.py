"""A power law of the size fitted to costs, with its uncertainty."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.special import stdtrit

# The probability with which an interval contains another measurement.
CONFIDENCE = 0.95


@dataclass(frozen=True)
class PowerLaw:
    """Costs in proportion to ``size^exponent``, fitted to ``points`` (k, 2). ``uncertainty``: standard error of the exponent."""

    points: tuple[tuple[float, float], ...]
    exponent: float
    uncertainty: float

    def at(self, size: float) -> tuple[float, float, float]:
        """The cost expected at a ``size``, and the ends of the interval that contains another measurement at this size with the
        probability ``CONFIDENCE``, if the power law is valid there.
        """
        x, y = np.log(np.array(self.points)).T
        away = math.log(size) - float(x.mean())
        middle = float(y.mean()) + self.exponent * away
        rest = y - y.mean() - self.exponent * (x - x.mean())
        scatter = float(rest @ rest) / (len(x) - 2)
        spread = math.sqrt(scatter * (1 + 1 / len(x)) + (self.uncertainty * away) ** 2)
        reach = float(stdtrit(len(x) - 2, (1 + CONFIDENCE) / 2)) * spread
        return _exp(middle), _exp(middle - reach), _exp(middle + reach)


def fit(sizes: Sequence[float], costs: Sequence[float]) -> PowerLaw | None:
    """The line through the logarithms of costs over sizes, by least squares; None for fewer than three sizes with costs above zero.

    >>> found = fit((10, 100, 1000), (1, 10, 100))
    >>> round(found.exponent, 6), round(found.uncertainty, 6)
    (1.0, 0.0)
    """
    known = [(float(size), cost) for size, cost in zip(sizes, costs, strict=True) if 0 < cost < math.inf]
    if len({size for size, _ in known}) < 3:
        return None
    x, y = np.log(np.array(known)).T
    centred = x - x.mean()
    slope = float(centred @ y / (centred @ centred))
    rest = y - y.mean() - slope * centred
    return PowerLaw(tuple(known), slope, math.sqrt(rest @ rest / (len(x) - 2) / (centred @ centred)))


def _exp(x: float) -> float:
    """The exponential, infinite if it overflows."""
    return math.exp(x) if x < 700 else math.inf
