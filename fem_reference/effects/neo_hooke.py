"""Isotropic elastic matrix, without its resistance to volume change."""

from typing import Any

from fem_reference.effects import Energy, State
from fem_reference.foundations.units import PositivePressure


class NeoHooke(Energy):
    """``mu/2 (J^(-2/3) tr C - 3)``: the isochoric neo-Hookean energy (Holzapfel 2000, Nonlinear Solid Mechanics, eq. 6.143).

    ``mu``: shear modulus at rest [MPa].
    """

    mu: PositivePressure

    def energy(self, state: State) -> Any:
        """Energy per rest volume [MPa]."""
        return self.mu / 2 * (state.J ** (-2 / 3) * state.I1 - 3)
