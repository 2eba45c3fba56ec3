"""Inertia: mass resists acceleration. Without it a scene is quasi-static and has neither velocities nor a mass matrix."""

import math
from typing import Any, ClassVar

from pydantic import Field

from fem_reference.effects import Energy, State
from fem_reference.foundations.indicators import Estimates, Indicator
from fem_reference.foundations.units import Density


class Inertia(Energy):
    """A force ``-density a`` per unit rest volume, where a is the acceleration, integrated by an implicit second-order method.

    The method is the member of the generalised-alpha family that evaluates stresses at the end of a step (Wood, Bossak and
    Zienkiewicz 1980, doi 10.1002/nme.1620151011; Chung and Hulbert 1993, doi 10.1115/1.2900803, with alpha_f = 0):
    ``alpha = (r - 1) / (r + 1)``, ``gamma = 1/2 - alpha``, ``beta = (1 - alpha)^2 / 4``. Each step multiplies the amplitude of the
    shortest waves by r, the ``spectral_radius``: 1 preserves them (the trapezoidal rule), 0 removes them in one step. Long waves
    retain their energy. The displacement at the end of a step minimises the sum of all other energies and
    ``density (1 + r) rate^2 |u - predicted|^2``, a potential of the step.

    ``density``: the density at rest [tonne/mm^3]; ``spectral_radius``: from 0 to 1.
    """

    outer: ClassVar[bool] = True
    needs: ClassVar[tuple[str, ...]] = ("interval", "momentum")
    stored: ClassVar[bool] = False
    example: ClassVar[dict[str, Any]] = {"density": "1060 kg/m3", "spectral_radius": 0.8}

    density: Density
    spectral_radius: float = Field(default=0.9, ge=0, le=1)

    def indicator(self, scene: Estimates) -> Indicator:
        """The lag of a beam under its inertial force, and the stress of the wave that a sudden change of velocity sends through the
        beam. The first natural frequency of the beam follows from its deflection under its weight.
        """
        square = scene.bend(self.density)  # the inverse square of the frequency
        acceleration, jump = scene.in_time(scene.in_time(scene.acceleration)), scene.in_time(scene.jump)
        lag = scene.lag(max(square * acceleration, math.sqrt(square) * jump))
        stress = max(self.density * acceleration * scene.length, math.sqrt(self.density * scene.shear) * jump)
        cauchy = self.density * scene.in_time(scene.speed) ** 2 / scene.shear
        return Indicator("Cauchy number, density times speed squared divided by shear modulus", cauchy, lag, stress)

    def energy(self, state: State) -> Any:
        """The potential of the step per unit rest volume [MPa]."""
        square = sum((now - then) ** 2 for now, then in zip(state.displacement, state.predicted, strict=True))
        return self.density * (1 + self.spectral_radius) * state.rate**2 * square

    def kinetic(self, velocity: Any) -> Any:
        """The kinetic energy per unit rest volume [MPa] at a ``velocity`` (3,) [mm/s]."""
        return self.density / 2 * sum(component**2 for component in velocity)

    def predicted(self, u: Any, v: Any, a: Any, seconds: float) -> Any:
        """The displacement [mm] after ``seconds`` without forces. ``u``, ``v``, ``a``: displacement, velocity and acceleration at
        the start.
        """
        alpha, _, beta = self._rule()
        return u + seconds * v + seconds**2 * (0.5 - beta - beta * alpha / (1 - alpha)) * a

    def advanced(self, u: Any, v: Any, a: Any, now: Any, seconds: float) -> tuple[Any, Any]:
        """The velocity and the acceleration after a step of ``seconds`` that takes the displacement from ``u`` to ``now``.

        ``v``, ``a``: the velocity and the acceleration before the step.
        """
        _, gamma, beta = self._rule()
        after = (now - u - seconds * v - seconds**2 * (0.5 - beta) * a) / (beta * seconds**2)
        return v + seconds * ((1 - gamma) * a + gamma * after), after

    def begun(self, u: Any, seconds: float) -> Any:
        """The acceleration of a body that moves from rest by ``u`` within ``seconds``, a time too short for forces to change."""
        return 2 * (1 + self.spectral_radius) * u / seconds**2

    def _rule(self) -> tuple[float, float, float]:
        alpha = (self.spectral_radius - 1) / (self.spectral_radius + 1)
        return alpha, 0.5 - alpha, (1 - alpha) ** 2 / 4
