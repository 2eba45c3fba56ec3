"""Membranes on the surface, which resist stretch but not bending: aponeuroses and fasciae."""

from collections.abc import Sequence
from typing import Any, ClassVar

from pydantic import Field

from fem_reference.effects import Load, State
from fem_reference.foundations.units import PositiveLength, PositivePressure


class Membrane(Load):
    """``h mu/2 (I + 1/a^2 - 3)`` per unit rest area, with ``I = tr C - N . C N`` the sum of the squared stretches in the surface, a
    the ratio of present area to area at rest, and N the normal at rest: an incompressible neo-Hookean sheet in plane stress, whose
    thickness follows from its area (Holzapfel 2000, Nonlinear Solid Mechanics, ch. 6.2, on membranes).

    ``on``: the part of the surface; ``in``, if given: a region, in which the effect acts in proportion to the share, linear between
    the vertices of cells; ``thickness``: h at rest [mm]; ``mu``: shear modulus at rest [MPa].

    Stretched by l in all directions the sheet has the tension ``h mu (1 - l^-6)`` per present length. A real sheet wrinkles in
    compression; here it resists, like a sheet that the tissue below keeps flat.
    """

    outer: ClassVar[bool] = False
    stored: ClassVar[bool] = True
    example: ClassVar[dict[str, Any]] = {"thickness": "0.5 mm", "mu": "10 MPa"}
    thickness: PositiveLength
    mu: PositivePressure
    region: str = Field(default="", alias="in", exclude_if=lambda region: not region)

    def potential(self, state: State, normal: Sequence[Any]) -> Any:
        """Energy per unit rest area [N/mm], multiplied by the share of the point in the region."""
        area = sum(sum(c * n for c, n in zip(row, normal, strict=True)) ** 2 for row in state.cofactors)
        inside = state.I1 - state.square_stretch(normal)
        return state.share(self.region) * self.thickness * self.mu / 2 * (inside + 1 / area - 3)
