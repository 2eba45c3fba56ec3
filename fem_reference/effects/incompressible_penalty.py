"""Near-incompressibility by a penalty on volume change, without a pressure unknown: it locks where the mixed form does not."""

from typing import Any, ClassVar

from fem_reference.effects import Energy, Moduli, State
from fem_reference.foundations.limits import Limit
from fem_reference.foundations.units import PositivePressure


class IncompressiblePenalty(Energy):
    """``K/2 (J - 1)^2``: what ``incompressible`` is where its pressure is free at every point.

    ``bulk``: bulk modulus K [MPa]. Meant for J from 1/2 to 2, as ``incompressible`` is, and for its reasons.
    """

    example: ClassVar[dict[str, Any]] = {"bulk": "10 MPa"}
    bulk: PositivePressure

    def limits(self) -> tuple[Limit, ...]:
        """The range of the volume."""
        return (Limit("V/V0", 0.5, 2.0),)

    def moduli(self) -> Moduli:
        """The stiffness that it gives the body at rest."""
        return Moduli(bulk=self.bulk)

    def energy(self, state: State) -> Any:
        """Energy per rest volume [MPa]."""
        return self.bulk / 2 * (state.J - 1) ** 2
