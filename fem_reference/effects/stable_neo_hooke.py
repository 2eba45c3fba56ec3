"""Isotropic neo-Hookean law without a logarithm, as in vertex block descent. Its energy is finite even in inverted states."""

from typing import Any

from fem_reference.effects import LameLaw, State


class StableNeoHooke(LameLaw):
    """``mu/2 (I1 - 3) - mu (J - 1) + (lame + mu)/2 (J - 1)^2``.

    ``mu``, ``lame``: the Lame parameters at rest [MPa]. Source: Smith, De Goes and Kim 2018, doi 10.1145/3180491, section 3.4, with
    lambda from eq. 13 and without the constant term. Their term for a state of zero volume is omitted.
    """

    def energy(self, state: State) -> Any:
        more = state.J - 1
        return self.mu * ((state.I1 - 3) / 2 - more) + (self.lame + self.mu) / 2 * more**2
