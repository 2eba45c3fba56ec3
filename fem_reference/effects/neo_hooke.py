"""Isotropic elastic matrix, without resistance to volume change."""

from typing import Any, ClassVar

from fem_reference.effects import Energy, Moduli, State
from fem_reference.foundations.limits import Range
from fem_reference.foundations.units import PositivePressure


class NeoHooke(Energy):
    """``mu/2 (J^(-2/3) tr C - 3)``: the isochoric neo-Hookean energy (Holzapfel 2000, Nonlinear Solid Mechanics, eq. 6.143).

    ``mu``: the shear modulus at rest [MPa].
    """

    example: ClassVar[dict[str, Any]] = {"mu": "10 kPa"}
    published: ClassVar[dict[str, Range]] = {
        "mu": Range(
            low="3.73 kPa",
            high="20.7 kPa",
            source="relaxed vastus lateralis by magnetic resonance elastography, 3.73 (SD 0.85) kPa (Bensamoun et al. 2006, "
            "J Magn Reson Imaging 23:242); gluteal muscle under 5 N, E/3 of 62.2 (SD 10.3) kPa (Isogai et al. 2022, "
            "doi 10.1589/jpts.34.777)",
            spread="log-uniform",
        )
    }
    mu: PositivePressure

    def moduli(self) -> Moduli:
        return Moduli(shear=self.mu)

    def energy(self, state: State) -> Any:
        return self.mu / 2 * (state.J ** (-2 / 3) * state.I1 - 3)
