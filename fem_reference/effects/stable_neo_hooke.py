"""Isotropic neo-Hookean law without a logarithm, as in vertex block descent: finite where the body is inside out."""

from typing import Any, ClassVar

from fem_reference.effects import Energy, Moduli, State
from fem_reference.foundations.units import PositivePressure


class StableNeoHooke(Energy):
    """``mu/2 (I1 - 3) - mu (J - 1) + (lame + mu)/2 (J - 1)^2``.

    ``mu``, ``lame``: Lame's parameters at rest [MPa]. Source: Smith, De Goes and Kim 2018, doi 10.1145/3180491, section 3.4, with
    lambda by eq. 13 and without the constant; their term for a state of zero volume is left out.
    """

    example: ClassVar[dict[str, Any]] = {"mu": "10 kPa", "lame": "90 kPa"}
    mu: PositivePressure
    lame: PositivePressure

    def moduli(self) -> Moduli:
        return Moduli(shear=self.mu, bulk=self.lame + 2 / 3 * self.mu)

    def energy(self, state: State) -> Any:
        more = state.J - 1
        return self.mu * ((state.I1 - 3) / 2 - more) + (self.lame + self.mu) / 2 * more**2
