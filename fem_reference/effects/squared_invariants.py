"""Isotropic elastic law of two squared constraints, as in the physics engine Newton; at rest it does not resist shear."""

from typing import Any, ClassVar

from fem_reference.effects import Energy, Moduli, State
from fem_reference.foundations.units import PositivePressure


class SquaredInvariants(Energy):
    """``mu/2 (I1 - 3)^2 + lame/2 (J - 1)^2``: the two squared constraints of a tetrahedron in
    extended position based dynamics (XPBD).

    ``mu``, ``lame``: the stiffnesses of the two terms [MPa]. They are not the Lame parameters: at rest the shear modulus is 0, and
    the bulk modulus is ``lame + 4 mu``. Source: Newton 1.8.0, newton/_src/solvers/xpbd/kernels.py, ``solve_tetrahedra``, whose
    compliances are 1 / (stiffness times rest volume).
    """

    example: ClassVar[dict[str, Any]] = {"mu": "10 kPa", "lame": "90 kPa"}
    mu: PositivePressure
    lame: PositivePressure

    def moduli(self) -> Moduli:
        """The contribution to the stiffness at rest. For small strains e, (I1 - 3)^2 is 4 (tr e)^2."""
        return Moduli(bulk=self.lame + 4 * self.mu)

    def energy(self, state: State) -> Any:
        return self.mu / 2 * (state.I1 - 3) ** 2 + self.lame / 2 * (state.J - 1) ** 2
