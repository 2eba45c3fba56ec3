"""Isotropic elastic law in which stress is linear in Green's strain, as in MuJoCo and libraries for position based dynamics."""

from typing import Any

from fem_reference.effects import LameLaw, State
from fem_reference.foundations.limits import Limit


class StVenantKirchhoff(LameLaw):
    """``mu tr(E^2) + lame/2 (tr E)^2`` with ``E = (C - 1) / 2`` (Holzapfel 2000, Nonlinear Solid Mechanics, eq. 6.151).

    ``mu``, ``lame``: the Lame parameters [MPa]. Valid for V/V0 from 1/2 to 2: the law softens in compression, and a body that is
    pressed flat turns inside out without further resistance.
    """

    def limits(self) -> tuple[Limit, ...]:
        return (Limit("V/V0", 0.5, 2.0),)

    def energy(self, state: State) -> Any:
        C = state.C
        square = sum((C[i][k] - (i == k)) ** 2 for i in range(3) for k in range(3)) / 4
        return self.mu * square + self.lame / 8 * (state.I1 - 3) ** 2
