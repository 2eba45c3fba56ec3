"""Fluid pressure on a part of the surface, always perpendicular to the moving surface (a follower load)."""

from collections.abc import Sequence
from typing import Any, ClassVar

from fem_reference.effects import Load, Ramped, State
from fem_reference.foundations import units
from fem_reference.foundations.indicators import Estimates, Indicator
from fem_reference.foundations.loads import Shape, Wrench
from fem_reference.foundations.mesh import Bools, Floats

_ROUNDED = 1e-6  # rounding of the components of unit normals in files of 32-bit numbers


class Pressure(Ramped, Load):
    """``-amount p J F^-T N``, where N is the outward normal at rest: a pressure on the present surface, by Nanson's formula.

    ``on``: the part of the surface; ``pressure``: p [MPa], inwards if positive.

    If the pressure acts on the entire surface of a body that can shrink freely, and the volumetric energy is K/2 (J - 1)^2, then
    V/V0 is exactly 1 - p / K. A clamped part does not shrink; the body around it is sheared, and V/V0 is larger. In a cube
    of side L with one clamped triangle with legs a, it is larger by 0.15 mu / K (a / L)^3 p / K: for example, 0.9002 instead of 0.9
    if a is L/2 and K is 10 mu.
    """

    example: ClassVar[dict[str, Any]] = {"pressure": "8 kPa"}
    pressure: units.Pressure

    def indicator(self, scene: Estimates) -> Indicator:
        """The distance by which the pressure reduces the thickness of the muscle."""
        load = scene.greatest(self) * abs(self.pressure)
        part = load / scene.shear
        return Indicator("ratio of pressure to shear modulus", part, part * scene.thickness / 3, load)

    def resultant(self, shape: Shape) -> Wrench | None:
        """The force and moment on the entire part of the surface in its present shape."""
        found = shape.facing(self.on)
        return None if found is None else Wrench(*(-self.pressure * one for one in found))

    def along(self, normals: Floats) -> Bools:
        """Mask (f, 3) of the components of the ``normals`` (f, 3) that are not 0, up to rounding."""
        return normals > _ROUNDED

    def traction(self, state: State, normal: Sequence[Any]) -> Sequence[Any]:
        load = -state.amount * self.pressure
        return [load * sum(c * n for c, n in zip(row, normal, strict=True)) for row in state.cofactors]
