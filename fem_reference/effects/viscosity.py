"""Viscosity of the matrix, in parallel with its elastic law (a Kelvin-Voigt material).

With viscosity, short waves in an unstable state grow no faster than long waves.
"""

from typing import Any, ClassVar

from fem_reference.effects import Energy, State
from fem_reference.foundations.indicators import Estimates, Indicator
from fem_reference.foundations.units import Viscosity as Coefficient


class Viscosity(Energy):
    """A Cauchy stress of ``2 eta D``, where D is the rate of deformation including its volumetric part, which is 0 in
    incompressible material.

    Over a load step D is replaced by ``rate e`` (implicit Euler), where ``e = (f^T f - 1)/2`` is the Green strain of
    ``f = F F_before^-1``. The stress is the derivative of ``eta rate |e|^2`` per unit volume before the step. This expression is a
    potential of the step, not a stored energy, and rotations do not change it. The stress agrees with ``2 eta D`` to first order in
    the size of the step.

    ``eta``: the viscosity [MPa s].
    """

    needs: ClassVar[tuple[str, ...]] = ("interval",)
    stored: ClassVar[bool] = False
    example: ClassVar[dict[str, Any]] = {"eta": "300 kPa s"}

    eta: Coefficient

    def indicator(self, scene: Estimates) -> Indicator:
        """The lag of a body, estimated from its relaxation time and its travel, and the viscous stress."""
        rate = scene.in_time(scene.speed) / scene.length
        deborah = self.eta / scene.shear * rate
        rule, lag = "Deborah number, relaxation time divided by the time of the motion", 0.25 * deborah * scene.travel
        return Indicator(rule, deborah, scene.lag(lag), 2 * self.eta * rate)

    def energy(self, state: State) -> Any:
        """The potential of the step per unit rest volume [MPa]."""
        before = State(F=state.F_before)
        axes, now, then = before.cofactors, state.C, before.C
        grown = [[now[i][k] - then[i][k] for k in range(3)] for i in range(3)]
        half = [[sum(axes[i][k] * grown[k][m] for k in range(3)) for m in range(3)] for i in range(3)]
        strain = [[sum(half[i][m] * axes[j][m] for m in range(3)) for j in range(3)] for i in range(3)]
        square = sum(entry**2 for row in strain for entry in row)  # the squared norm of 2 J_before^2 e
        return self.eta / 4 * state.rate * square / before.J**3
