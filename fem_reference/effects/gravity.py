"""Weight, or any other steady acceleration."""

from typing import Any

from fem_reference.effects import Energy, Ramped, State
from fem_reference.foundations.units import AccelerationVector, Density


class Gravity(Ramped, Energy):
    """``-amount rho g . u``, with u the displacement.

    ``density``: rho at rest [tonne/mm^3]; ``acceleration``: g (3,) [mm/s^2].
    """

    density: Density
    acceleration: AccelerationVector

    def energy(self, state: State) -> Any:
        """Energy per rest volume [MPa], zero at rest."""
        work = sum(g * u for g, u in zip(self.acceleration, state.displacement, strict=True))
        return -state.amount * self.density * work
