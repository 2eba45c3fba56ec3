"""Passive muscle fibres: resistance to stretch beyond the optimal fibre length, with a toe region followed by a straight line."""

from typing import Any, ClassVar

from pydantic import Field

from fem_reference.effects import Moduli, PassiveFibres, State
from fem_reference.effects.fibre_active import PEAK_STRESS
from fem_reference.foundations.limits import Limit, Range
from fem_reference.foundations.units import PositivePressure

# In this form Thelen's exp(k (l - 1)/e) - 1, divided by exp(k) - 1, has p1 = 1 / (exp(k) - 1) and p2 = k / e; k = 5, e = 0.6.
_SOURCE = (
    "Blemker, Pinsky and Delp 2005 (doi 10.1016/j.jbiomech.2004.04.009: 0.05 and 6.6, as in FEBio's manual) to Thelen 2003 "
    "(doi 10.1115/1.1531112: exponent 5 and strain 0.6 at the peak active stress, as in OpenSim, so 0.00678 and 8.33); "
    "neither paper was read"
)


class FibrePassive(PassiveFibres):
    """``dW/dl = stress f(l)``, where ``l`` is the isochoric fibre stretch divided by the optimal stretch, and f is 0 for
    ``l`` up to 1, ``p1 (exp(p2 (l - 1)) - 1)`` from 1 to ``linear_from``, and the tangent line beyond.

    ``stress`` [MPa]: the peak active stress, by which the source scales the law; ``p1``, ``p2``: dimensionless;
    ``optimal_stretch``: the fibre stretch at optimal length; ``linear_from``: the value of ``l`` at which the tangent line begins.
    Source: Blemker, Pinsky and Delp 2005, doi 10.1016/j.jbiomech.2004.04.009.

    Valid for ``l`` up to 1.6, or up to ``linear_from`` if this is greater. At 1.6 the active tension of the same source ends, and
    no data on longer fibres support this law. There is no lower limit, because shorter fibres are slack.
    """

    example: ClassVar[dict[str, Any]] = {
        "stress": "300 kPa",
        "p1": 0.05,
        "p2": 6.6,
        "optimal_stretch": 1.1,
        "linear_from": 1.4,
    }
    published: ClassVar[dict[str, Range]] = {
        "stress": PEAK_STRESS,
        "p1": Range(low=0.00678, high=0.05, source=_SOURCE),
        "p2": Range(low=6.6, high=8.33, source=_SOURCE),
    }
    stress: PositivePressure
    p1: float = Field(gt=0)
    p2: float = Field(gt=0)
    optimal_stretch: float = Field(gt=0)
    linear_from: float = Field(gt=1)

    def limits(self) -> tuple[Limit, ...]:
        return (Limit("fibre stretch", high=max(1.6, self.linear_from) * self.optimal_stretch),)

    def moduli(self) -> Moduli:
        return Moduli(fibres=self.stress)

    def energy(self, state: State) -> Any:
        """Energy per unit rest volume [MPa], zero in slack fibres."""
        p1, p2, exp = self.p1, self.p2, state.functions.exp
        stretch = state.fibre_stretch / self.optimal_stretch
        toe = state.between(1, self.linear_from, stretch) - 1
        beyond = state.functions.above(stretch, self.linear_from, stretch - self.linear_from, 0)
        end = p1 * exp(p2 * (self.linear_from - 1))
        curved = p1 * ((exp(p2 * toe) - 1) / p2 - toe)
        return self.stress * (curved + (end - p1) * beyond + p2 * end / 2 * beyond**2)
