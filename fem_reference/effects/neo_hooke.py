"""Isotropic elastic matrix, without its resistance to volume change."""

from typing import Any, ClassVar

from fem_reference.effects import Energy, Moduli, State
from fem_reference.foundations.units import PositivePressure


class NeoHooke(Energy):
    """``mu/2 (J^(-2/3) tr C - 3)``: the isochoric neo-Hookean energy (Holzapfel 2000, Nonlinear Solid Mechanics, eq. 6.143).

    ``mu``: shear modulus at rest [MPa].
    """

    example: ClassVar[dict[str, Any]] = {"mu": "10 kPa"}
    mu: PositivePressure

    def moduli(self) -> Moduli:
        """The stiffness that it gives the body at rest."""
        return Moduli(shear=self.mu)

    def energy(self, state: State) -> Any:
        """Energy per rest volume [MPa]."""
        return self.mu / 2 * (state.J ** (-2 / 3) * state.I1 - 3)
