"""Isotropic elastic matrix with separate terms for changes of length and of area, but without resistance to volume change."""

from typing import Any, ClassVar

from fem_reference.effects import Energy, Moduli, State
from fem_reference.foundations.records import rule
from fem_reference.foundations.units import Pressure


class MooneyRivlin(Energy):
    """``c1 (J^(-2/3) I1 - 3) + c2 (J^(-4/3) I2 - 3)`` (Mooney 1940, doi 10.1063/1.1712836; Rivlin 1948).

    ``c1``, ``c2`` [MPa]: the shear modulus at rest is ``2 (c1 + c2)``.
    """

    example: ClassVar[dict[str, Any]] = {"c1": "10 kPa", "c2": "4 kPa"}
    c1: Pressure
    c2: Pressure

    _check_modulus = rule(lambda one: one.c1 + one.c2 > 0, "c1 + c2 above zero")

    def moduli(self) -> Moduli:
        return Moduli(shear=2 * (self.c1 + self.c2))

    def energy(self, state: State) -> Any:
        J = state.J
        return self.c1 * (J ** (-2 / 3) * state.I1 - 3) + self.c2 * (J ** (-4 / 3) * state.I2 - 3)
