"""Isotropic elastic law that is linear in the stretches, as Drake and solvers of computer graphics have it."""

from typing import Any, ClassVar

from fem_reference.effects import Energy, Moduli, State
from fem_reference.foundations.units import PositivePressure

# Newton steps to the sum of the stretches: they leave 4e-11 of it for stretches from 0.3 to 3, and more of it inside out.
_STEPS = 4


class Corotated(Energy):
    """``mu |F - R|^2 + lame/2 (J - 1)^2`` with R the rotation of F: the fixed corotated law (Stomakhin et al. 2012, Energetically
    consistent invertible elasticity, eq. 8).

    ``mu``, ``lame``: Lame's parameters [MPa]. ``|F - R|^2`` is ``I1 - 2 s + 3``, where s is the sum of the principal stretches, the
    greatest root of ``(s^2 - I1)^2 = 4 (I2 + 2 J s)``.
    """

    example: ClassVar[dict[str, Any]] = {"mu": "10 kPa", "lame": "90 kPa"}
    mu: PositivePressure
    lame: PositivePressure

    def moduli(self) -> Moduli:
        """The stiffness that it gives the body at rest."""
        return Moduli(shear=self.mu, bulk=self.lame + 2 / 3 * self.mu)

    def energy(self, state: State) -> Any:
        """Energy per rest volume [MPa]."""
        return self.mu * (state.I1 - 2 * _stretches(state) + 3) + self.lame / 2 * (state.J - 1) ** 2


def _stretches(state: State) -> Any:
    """The sum of the principal stretches, by Newton's method from an upper bound. The root is simple, at rest too."""
    I1, I2, J = state.I1, state.I2, state.J
    s = state.functions.sqrt(I1 + 2 * state.functions.sqrt(3 * I2))
    for _ in range(_STEPS):
        over = s * s - I1
        s = s - (over * over / 4 - I2 - 2 * J * s) / (s * over - 2 * J)
    return s
