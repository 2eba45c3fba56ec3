"""An effect outside the package: Yeoh's three-term law, which stiffens at large stretches."""

from typing import Any

from fem_reference.effects import Energy, State
from fem_reference.foundations.units import PositivePressure


class Yeoh(Energy):
    """``c1 (I - 3) + c2 (I - 3)^2 + c3 (I - 3)^3`` with ``I = J^(-2/3) tr C`` (Yeoh 1993, doi 10.5254/1.3538343).

    ``c1``, ``c2``, ``c3``: [MPa]; the shear modulus at rest is ``2 c1``.
    """

    c1: PositivePressure
    c2: PositivePressure
    c3: PositivePressure

    def energy(self, state: State) -> Any:
        """Energy per unit rest volume [MPa]."""
        over = state.J ** (-2 / 3) * state.I1 - 3
        return self.c1 * over + self.c2 * over**2 + self.c3 * over**3
