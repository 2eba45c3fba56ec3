"""Near-incompressibility by a pressure unknown of its own (mixed form)."""

from typing import Any, ClassVar

from fem_reference.effects import Energy, State
from fem_reference.units import PositivePressure


class Incompressible(Energy):
    """``p (J - 1) - p^2 / (2 K)``: the perturbed Lagrangian whose stationary point in p is ``p = K (J - 1)``.

    ``bulk``: bulk modulus K [MPa]. Source: Sussman and Bathe 1987, doi 10.1016/0045-7949(87)90265-3, with U = K/2 (J - 1)^2.
    """

    unknowns: ClassVar[tuple[str, ...]] = ("pressure",)
    bulk: PositivePressure

    def energy(self, state: State) -> Any:
        """Energy per rest volume [MPa]."""
        return state.pressure * (state.J - 1) - state.pressure**2 / (2 * self.bulk)
