"""How cost grows with the size of a problem: a power of it, by phase, with its uncertainty."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from fem_reference.foundations.mesh import Floats


@dataclass(frozen=True)
class Growth:
    """``cost`` of a ``solver`` over ``sizes`` (k,), unknowns or triangles: ``values`` (k,), about ``size^exponent``.

    ``uncertainty``: the standard error of the exponent; ``offset`` and ``scatter`` of the fit in logarithms, for ``at``.
    """

    solver: str
    cost: str
    sizes: tuple[float, ...]
    values: tuple[float, ...]
    exponent: float
    uncertainty: float

    def at(self, size: float) -> tuple[float, float, float]:
        """The cost expected at a ``size``, and its least and greatest value with the exponent off by twice its uncertainty, from
        the greatest size that was measured on.
        """
        logs, values = np.log(np.array(self.sizes)), np.log(np.array(self.values))
        middle = float(values.mean() + self.exponent * (math.log(size) - logs.mean()))
        reach = 2 * self.uncertainty * abs(math.log(size) - float(logs.mean()))
        return math.exp(middle), math.exp(middle - reach), math.exp(middle + reach)

    @property
    def decades(self) -> float:
        """Over how many powers of ten of the size it was measured."""
        return math.log10(max(self.sizes) / min(self.sizes))


def growth(solver: str, cost: str, sizes: Sequence[float], values: Sequence[float]) -> Growth | None:
    """A line through costs over sizes in logarithms, by least squares; None for fewer than three that are above zero.

    >>> found = growth("pbd", "seconds", (10, 100, 1000), (1, 10, 100))
    >>> round(found.exponent, 6), round(found.uncertainty, 6)
    (1.0, 0.0)
    """
    known = [(size, value) for size, value in zip(sizes, values, strict=True) if value > 0 and math.isfinite(value)]
    if len(known) < 3 or len({size for size, _ in known}) < 3:
        return None
    x, y = np.log(np.array(known)).T
    exponent, error = _slope(x, y)
    return Growth(solver, cost, tuple(size for size, _ in known), tuple(value for _, value in known), exponent, error)


def _slope(x: Floats, y: Floats) -> tuple[float, float]:
    """Slope and its standard error of a line through points by least squares."""
    centred = x - x.mean()
    slope = float(centred @ y / (centred @ centred))
    rest = y - y.mean() - slope * centred
    return slope, float(np.sqrt(rest @ rest / (len(x) - 2) / (centred @ centred)))
