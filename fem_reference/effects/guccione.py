"""Heart muscle, which stiffens with strain and is stiffest along its fibres."""

from typing import Any, ClassVar

from pydantic import Field

from fem_reference.effects import Energy, Moduli, State
from fem_reference.foundations.units import PositivePressure


class Guccione(Energy):
    """``c/2 (exp(Q) - 1)`` with ``Q = bf Eff^2 + bt (Ess^2 + Enn^2 + 2 Esn^2) + 2 bfs (Efs^2 + Efn^2)``. The indices of
    ``E = (J^(-2/3) C - 1) / 2`` stand for the fibre (f) and for two directions perpendicular to it and to each other (s, n).

    ``c`` [MPa]; ``bf``, ``bt``, ``bfs`` dimensionless. Source: Guccione, McCulloch and Waldman 1991, doi 10.1115/1.2894084, as in
    Land et al. 2015, doi 10.1098/rspa.2015.0641, both for incompressible material. Without the factor ``J^(-2/3)`` the pressure
    unknown would have to balance the whole of a large tension, and the ventricle of Land et al., meshed with two layers of mixed
    elements, would lose equilibrium.
    """

    needs: ClassVar[tuple[str, ...]] = ("fibre",)
    example: ClassVar[dict[str, Any]] = {"c": "2 kPa", "bf": 8.0, "bt": 2.0, "bfs": 4.0}
    c: PositivePressure
    bf: float = Field(gt=0)
    bt: float = Field(gt=0)
    bfs: float = Field(gt=0)

    def moduli(self) -> Moduli:
        return Moduli(shear=self.c * self.bt / 2)

    def energy(self, state: State) -> Any:
        """Energy per unit rest volume [MPa]. The sums over s and n follow from ``|E fibre|^2`` and ``|E|^2``."""
        C, f, factor = state.C, state.fibre, state.J ** (-2 / 3)
        E = [[(factor * C[i][k] - (i == k)) / 2 for k in range(3)] for i in range(3)]
        along = [sum(E[i][k] * f[k] for k in range(3)) for i in range(3)]
        square = sum(entry**2 for row in E for entry in row)
        Eff = sum(a * b for a, b in zip(f, along, strict=True))
        shear = sum(entry**2 for entry in along) - Eff**2
        transverse = square - Eff**2 - 2 * shear
        Q = self.bf * Eff**2 + self.bt * transverse + 2 * self.bfs * shear
        return self.c / 2 * (state.functions.exp(Q) - 1)
