"""Active tension along the fibres, independent of their stretch."""

from typing import Any, ClassVar

from fem_reference.effects import Energy, Ramped, State, fibre_indicator
from fem_reference.foundations.indicators import Estimates, Indicator
from fem_reference.foundations.units import PositivePressure


class ActiveTension(Ramped, Energy):
    """``amount T/2 (J^(-2/3) fibre . C fibre - 1)``. At constant volume the second Piola-Kirchhoff stress is ``amount T`` along the
    fibre, plus a pressure that the resistance to volume change balances.

    ``tension``: T [MPa]. Source: Land et al. 2015, problem 3, doi 10.1098/rspa.2015.0641, for incompressible material.
    """

    needs: ClassVar[tuple[str, ...]] = ("fibre",)
    example: ClassVar[dict[str, Any]] = {"tension": "60 kPa"}
    tension: PositivePressure

    def indicator(self, scene: Estimates) -> Indicator:
        """The distance by which active fibres straighten the muscle, or shorten a muscle that is free to shorten."""
        pull = scene.greatest(self) * self.tension
        return fibre_indicator(scene, pull, scene.straighten(pull))

    def energy(self, state: State) -> Any:
        return state.amount * self.tension / 2 * (state.J ** (-2 / 3) * state.square_stretch(state.fibre) - 1)
