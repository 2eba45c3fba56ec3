"""Laws of the isochoric stretch along the fibre, ``lambdabar = J^(-1/3) |F a|``: passive and active muscle.

They have the form of ``validation/laws.py``, with

    d lambdabar / dF = J^(-1/3) (F a (x) a / lambda - lambda/3 F^-T),  lambda = |F a|.

No digitisation error: the numbers follow from the formulas.
"""

from dataclasses import dataclass

import numpy as np
from scipy.special import expi

from validation.laws import Floats


class FibreLaw:
    """A law of the isochoric stretch along the fibre alone, ``W(lambdabar)``."""

    def stored(self, stretch: float) -> float:
        """``W`` [MPa] at an isochoric ``stretch`` of the fibre."""
        raise NotImplementedError(f"{type(self).__name__} has no energy")

    def slope(self, stretch: float) -> float:
        """``dW/dlambdabar`` [MPa]."""
        raise NotImplementedError(f"{type(self).__name__} has no slope")

    def energy(self, F: Floats, fibre: Floats) -> float:
        """Energy per unit rest volume [MPa]."""
        return self.stored(float(np.linalg.det(F) ** (-1 / 3) * np.linalg.norm(F @ fibre)))

    def stress(self, F: Floats, fibre: Floats) -> Floats:
        """First Piola-Kirchhoff stress (3, 3) [MPa]."""
        shrink, stretch = np.linalg.det(F) ** (-1 / 3), np.linalg.norm(F @ fibre)
        turned = np.outer(F @ fibre, fibre) / stretch - stretch / 3 * np.linalg.inv(F).T
        return np.asarray(self.slope(float(shrink * stretch)) * shrink * turned)


@dataclass(frozen=True)
class FibrePassive(FibreLaw):
    """``dW/dlambdabar = s/optimal_stretch f(l)``, ``l = lambdabar / optimal_stretch``, where f is 0 for ``l <= 1``,
    ``p1 (exp(p2 (l - 1)) - 1)`` up to ``linear_from`` and ``p3 l + p4`` beyond, f and f' continuous; s = ``stress_at_optimum``
    [MPa]. Source: Blemker, Pinsky, Delp 2005, doi 10.1016/j.jbiomech.2004.04.009. ``W`` is 0 where the fibre is slack.
    """

    stress_at_optimum: float
    p1: float
    p2: float
    optimal_stretch: float
    linear_from: float

    @property
    def _line(self) -> tuple[float, float]:
        """The coefficients p3 and p4."""
        p3 = self.p1 * self.p2 * np.exp(self.p2 * (self.linear_from - 1))
        return p3, self.p1 * np.expm1(self.p2 * (self.linear_from - 1)) - p3 * self.linear_from

    def stored(self, stretch: float) -> float:
        """``W`` [MPa]: s times the integral of f over l."""
        length, (p3, p4) = stretch / self.optimal_stretch, self._line
        toe, far = max(min(length, self.linear_from), 1.0) - 1, max(length, self.linear_from)
        whole = self.p1 * (np.expm1(self.p2 * toe) / self.p2 - toe)
        whole += p3 / 2 * (far**2 - self.linear_from**2) + p4 * (far - self.linear_from)
        return float(self.stress_at_optimum * whole)

    def slope(self, stretch: float) -> float:
        """``dW/dlambdabar`` [MPa]."""
        length, (p3, p4) = stretch / self.optimal_stretch, self._line
        toe = self.p1 * np.expm1(self.p2 * max(min(length, self.linear_from) - 1, 0.0))
        force = toe if length <= self.linear_from else p3 * length + p4
        return float(self.stress_at_optimum / self.optimal_stretch * force)


@dataclass(frozen=True)
class FibrePassiveFebio(FibreLaw):
    """``lambdabar dW/dlambdabar`` is 0 for ``lambdabar <= 1``, ``c3 (exp(c4 (lambdabar - 1)) - 1)`` up to ``linear_from`` and
    ``c5 lambdabar + c6`` beyond; c6 makes it continuous; c3, c5 [MPa].

    Source: Weiss, Maker, Govindjee 1996, doi 10.1016/0045-7825(96)01035-3; FEBio theory manual, transversely isotropic
    Mooney-Rivlin. The toe's energy is an exponential integral.
    """

    c3: float
    c4: float
    c5: float
    linear_from: float

    @property
    def c6(self) -> float:
        """The constant [MPa] that makes the force continuous."""
        return float(self.c3 * np.expm1(self.c4 * (self.linear_from - 1)) - self.c5 * self.linear_from)

    def stored(self, stretch: float) -> float:
        """``W`` [MPa]: ``c3 (exp(-c4) (Ei(c4 l) - Ei(c4)) - log l)`` in the toe."""
        toe = max(min(stretch, self.linear_from), 1.0)
        whole = self.c3 * (np.exp(-self.c4) * (expi(self.c4 * toe) - expi(self.c4)) - np.log(toe))
        far = max(stretch, self.linear_from)
        return float(whole + self.c5 * (far - self.linear_from) + self.c6 * np.log(far / self.linear_from))

    def slope(self, stretch: float) -> float:
        """``dW/dlambdabar`` [MPa]."""
        if stretch <= 1:
            return 0.0
        if stretch <= self.linear_from:
            return float(self.c3 * np.expm1(self.c4 * (stretch - 1)) / stretch)
        return self.c5 + self.c6 / stretch


@dataclass(frozen=True)
class FibreActive(FibreLaw):
    """``dW/dlambdabar = activation s/optimal_stretch g(l)``, ``l = lambdabar / optimal_stretch``, with g
    ``9 (l - 0.4)^2`` for ``0.4 < l <= 0.6``, ``1 - 4 (1 - l)^2`` for ``0.6 < l < 1.4``, ``9 (l - 1.6)^2`` for ``1.4 <= l < 1.6``
    and 0 elsewhere; s = ``stress_at_optimum`` [MPa].

    Source: Blemker, Pinsky, Delp 2005, doi 10.1016/j.jbiomech.2004.04.009. ``W`` is 0 for ``l <= 0.4``.
    """

    stress_at_optimum: float
    optimal_stretch: float
    activation: float

    def stored(self, stretch: float) -> float:
        """``W`` [MPa]."""
        length = stretch / self.optimal_stretch
        rising = min(max(length, 0.4), 0.6)
        middle = min(max(length, 0.6), 1.4)
        falling = min(max(length, 1.4), 1.6)
        hill = (middle - 0.6) - 4 / 3 * ((middle - 1) ** 3 + 0.4**3)
        whole = 3 * (rising - 0.4) ** 3 + hill + 3 * ((falling - 1.6) ** 3 + 0.2**3)
        return self.activation * self.stress_at_optimum * whole

    def slope(self, stretch: float) -> float:
        """``dW/dlambdabar`` [MPa]."""
        length = stretch / self.optimal_stretch
        if not 0.4 < length < 1.6:
            force = 0.0
        elif length <= 0.6:
            force = 9 * (length - 0.4) ** 2
        elif length < 1.4:
            force = 1 - 4 * (1 - length) ** 2
        else:
            force = 9 * (length - 1.6) ** 2
        return self.activation * self.stress_at_optimum / self.optimal_stretch * force
