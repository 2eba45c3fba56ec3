"""Collagen in all directions of the plane perpendicular to the fibres, without stiffness in compression."""

from typing import Any, ClassVar

import numpy as np
from pydantic import Field

from fem_reference.effects import Energy, Moduli, State
from fem_reference.foundations.units import PositivePressure

# Cosines of values of ``2 angle`` spread evenly from 0 to pi; Python floats, because numpy floats would turn symbols into arrays.
_DIRECTIONS = 8
COSINES = [float(np.cos((j + 0.5) * np.pi / _DIRECTIONS)) for j in range(_DIRECTIONS)]
# The square root has no derivative at 0, so this fraction of the squared mean is added to the squared spread.
_ROUNDING = 1e-13


class CollagenAcross(Energy):
    """The mean, over all directions ``a`` perpendicular to the fibre, of ``k1/(2 k2) (exp(k2 (I - 1)^2) - 1)`` if
    ``I = J^(-2/3) a . C a`` is above 1, and of 0 otherwise.

    ``k1`` [MPa]; ``k2`` dimensionless. In the plane perpendicular to the fibre, I is ``mean + spread cos(2 angle)``, where ``mean``
    is half the trace of ``J^(-2/3) C`` in this plane, and ``mean^2 - spread^2`` is its determinant. The mean is taken over eight
    angles.

    Source: Bleiler, Ponte Castaneda and Roehrle 2019, doi 10.1016/j.jmbbm.2019.05.012, who integrate over the directions of
    collagen in muscle; their muscle is stiffer in tension across its fibres than along them. Here only directions in the plane are
    used. The exponential is taken from Holzapfel, Gasser and Ogden 2000, doi 10.1023/A:1010835316564.
    """

    needs: ClassVar[tuple[str, ...]] = ("fibre",)
    example: ClassVar[dict[str, Any]] = {"k1": "20 kPa", "k2": 1.5}
    k1: PositivePressure
    k2: float = Field(gt=0)

    def moduli(self) -> Moduli:
        """The contribution of the effect to the stiffness at rest, for shear in the plane perpendicular to the fibre."""
        return Moduli(shear=self.k1 / 4)

    def energy(self, state: State) -> Any:
        factor, functions = state.J ** (-2 / 3), state.functions
        mean = factor * (state.I1 - state.square_stretch(state.fibre)) / 2
        area = sum(sum(entry * a for entry, a in zip(row, state.fibre, strict=True)) ** 2 for row in state.cofactors)
        spread = functions.sqrt(mean**2 * (1 + _ROUNDING) - factor**2 * area)
        energy = 0
        for cosine in COSINES:
            strain = mean + cosine * spread - 1
            taut = functions.above(strain, 0, strain, 0)
            energy += self.k1 / (2 * self.k2) * (functions.exp(self.k2 * taut**2) - 1)
        return energy / _DIRECTIONS
