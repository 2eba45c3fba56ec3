"""Weight, or any other steady acceleration."""

import math
from typing import Any, ClassVar

import numpy as np

from fem_reference.effects import Energy, Ramped, State
from fem_reference.foundations.indicators import Estimates, Indicator
from fem_reference.foundations.loads import Shape, Wrench, dead
from fem_reference.foundations.units import AccelerationVector, Density


class Gravity(Ramped, Energy):
    """The energy ``-amount rho g . u``, where u is the displacement.

    ``density``: rho, the density at rest [tonne/mm^3]; ``acceleration``: the vector g (3,) [mm/s^2].
    """

    outer: ClassVar[bool] = True
    example: ClassVar[dict[str, Any]] = {"density": "1060 kg/m3", "acceleration": "0, 0, -9.81 m/s^2"}
    density: Density
    acceleration: AccelerationVector

    def indicator(self, scene: Estimates) -> Indicator:
        """The sag of a beam under its weight."""
        force = scene.greatest(self) * self.density * math.hypot(*self.acceleration)
        rule, stress = "weight per unit cross-sectional area divided by the shear modulus", force * scene.length
        return Indicator(rule, stress / scene.shear, scene.bend(force), stress)

    def resultant(self, shape: Shape) -> Wrench:
        return dead(self.density * np.array(self.acceleration), shape)

    def energy(self, state: State) -> Any:
        """Energy per unit rest volume [MPa], zero at rest."""
        work = sum(g * u for g, u in zip(self.acceleration, state.displacement, strict=True))
        return -state.amount * self.density * work
