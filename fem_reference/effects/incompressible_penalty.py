"""Near-incompressibility by a penalty on volume change, without a pressure unknown; some elements lock only in this form."""

from typing import Any

from fem_reference.effects import State, VolumeLaw


class IncompressiblePenalty(VolumeLaw):
    """``K/2 (J - 1)^2``: the law ``incompressible`` with a pressure that is free at every point.

    ``bulk``: bulk modulus K [MPa]. Valid for J from 1/2 to 2, for the reasons of ``incompressible``.
    """

    def energy(self, state: State) -> Any:
        return self.bulk / 2 * (state.J - 1) ** 2
