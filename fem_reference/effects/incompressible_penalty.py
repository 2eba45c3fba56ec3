"""Near-incompressibility by a penalty on volume change, without a pressure unknown. Some elements lock in this formulation only."""

from typing import Any

from fem_reference.effects import State, VolumeLaw


class IncompressiblePenalty(VolumeLaw):
    """``K/2 (J - 1)^2``: the law ``incompressible`` with an independent pressure at every point.

    ``bulk``: the bulk modulus K [MPa]. Valid for J from 1/2 to 2, for the reasons stated for ``incompressible``.
    """

    def energy(self, state: State) -> Any:
        return self.bulk / 2 * (state.J - 1) ** 2
