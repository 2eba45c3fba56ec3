"""Active muscle fibres: a tension that is due to activation and is maximal at the optimal fibre length."""

from typing import Any, ClassVar

from pydantic import Field

from fem_reference.effects import Energy, Ramped, State, fibre_indicator
from fem_reference.foundations.indicators import Estimates, Indicator
from fem_reference.foundations.limits import Limit, Range
from fem_reference.foundations.units import PositivePressure

PEAK_STRESS = Range(
    low="225 kPa",
    high="350 kPa",
    source="specific tension: 22.5 N/cm2 in small mammals, 26.8 as the weighted mean of 96 human values (Persad et al. 2024, "
    "doi 10.1152/japplphysiol.00296.2024, abstract); 30 (SD 5) N/cm2 in the quadriceps of 27 men (In vivo specific tension of "
    "the human quadriceps femoris muscle, Eur J Appl Physiol 2009, abstract); Zajac's value (1989) is also 0.35 MPa, recalled",
)


class FibreActive(Ramped, Energy):
    """``dW/dl = amount stress g(l)``, where ``l`` is the isochoric fibre stretch divided by the optimal stretch, and g is
    ``9 (l - 0.4)^2`` from 0.4 to 0.6, ``1 - 4 (1 - l)^2`` from 0.6 to 1.4, ``9 (l - 1.6)^2`` from 1.4 to 1.6, and 0 elsewhere.

    ``stress`` [MPa]: the peak active stress; ``optimal_stretch``: the fibre stretch at optimal length; ``ramp``: the activation.
    Source: Blemker, Pinsky and Delp 2005, doi 10.1016/j.jbiomech.2004.04.009.

    Valid for ``l`` from 0.4 to 1.6, the range in which fibres have a tension in this source. Outside it, activation has no effect.
    """

    needs: ClassVar[tuple[str, ...]] = ("fibre",)
    example: ClassVar[dict[str, Any]] = {"stress": "300 kPa", "optimal_stretch": 1.1}
    published: ClassVar[dict[str, Range]] = {"stress": PEAK_STRESS}
    stress: PositivePressure
    optimal_stretch: float = Field(gt=0)

    def limits(self) -> tuple[Limit, ...]:
        return (Limit("fibre stretch", 0.4 * self.optimal_stretch, 1.6 * self.optimal_stretch),)

    def indicator(self, scene: Estimates) -> Indicator:
        """The distance by which active fibres straighten the muscle, or shorten a muscle that is free to shorten."""
        pull = scene.greatest(self) * self.stress
        return fibre_indicator(scene, pull, scene.straighten(pull))

    def energy(self, state: State) -> Any:
        """Energy per unit rest volume [MPa], zero at rest."""
        now, rest = state.fibre_stretch / self.optimal_stretch, 1 / self.optimal_stretch
        return state.amount * self.stress * (_area(now, state) - _area(rest, state))


def _area(stretch: Any, state: State) -> Any:
    """The integral of g from 1 to ``stretch``. At 1 the terms of the outer pieces cancel, as g is symmetric about 1."""
    rising = state.between(0.4, 0.6, stretch) - 0.4
    middle = state.between(0.6, 1.4, stretch) - 1
    falling = state.between(1.4, 1.6, stretch) - 1.6
    return 3 * rising**3 + middle - 4 / 3 * middle**3 + 3 * falling**3
