"""Membranes on the surface, such as aponeuroses and fasciae, which resist stretch but not bending."""

from collections.abc import Sequence
from typing import Any, ClassVar

from pydantic import Field

from fem_reference.effects import Load, State
from fem_reference.foundations.units import PositiveLength, PositivePressure


class Membrane(Load):
    """``h mu/2 (I + 1/a^2 - 3)`` per unit rest area, where ``I = tr C - N . C N`` is the sum of the squared principal stretches in
    the surface, a is the ratio of present area to area at rest, and N is the normal at rest. This is an incompressible neo-Hookean
    sheet in plane stress, whose thickness follows from its area (Holzapfel 2000, Nonlinear Solid Mechanics, ch. 6.2, on membranes).

    ``on``: the part of the surface; ``in``: an optional region, whose share weights the energy and is linear between the vertices
    of cells; ``thickness``: h at rest [mm]; ``mu``: the shear modulus at rest [MPa].

    If the sheet is stretched by the factor l in all directions, its tension per unit of present length is ``h mu (1 - l^-6)``. A
    real sheet wrinkles in compression; this sheet resists compression, as if the tissue below kept it flat.
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
