"""The stress at rest of a body in situ, as a term of its weak form; ``in_situ`` finds it."""

from typing import Any

import ufl
from dolfinx import fem

from fem_reference.effects import Effect, State
from fem_reference.effects.in_situ import among, balancing, moduli_of
from fem_reference.effects.incompressible import Incompressible
from fem_reference.effects.incompressible_penalty import IncompressiblePenalty
from fem_reference.effects.neo_hooke import NeoHooke


class RestStress:
    """The stress due to the ``response`` of an isotropic body to the effects at rest; see ``effects.in_situ``."""

    def __init__(self, unknowns: fem.Function, effects: tuple[Effect, ...]) -> None:
        self.response = fem.Function(unknowns.function_space)
        self.shear, self.bulk = (fem.Constant(unknowns.function_space.mesh, one) for one in moduli_of(effects))

    def energy(self, state: State) -> Any:
        """The energy per unit rest volume [MPa] of the stress at rest."""
        displacement, *others = ufl.split(self.response)
        slopes = ufl.grad(displacement)
        pressure = others[0] if others else self.bulk * ufl.tr(slopes)
        return balancing(state, [[slopes[i, k] for k in range(3)] for i in range(3)], pressure, self.shear)

    def isotropic(self, state: State) -> Any:
        """The energy per unit rest volume [MPa] of the isotropic body."""
        volume = IncompressiblePenalty if state.pressure is None else Incompressible
        matrix, resistance = NeoHooke.model_construct(mu=self.shear), volume.model_construct(bulk=self.bulk)
        return matrix.energy(state) + resistance.energy(state)


def rest_stress(unknowns: fem.Function, effects: tuple[Effect, ...]) -> RestStress | None:
    """The stress at rest of a body with ``effects``; None if the body is not in situ."""
    return None if among(effects) is None else RestStress(unknowns, effects)
