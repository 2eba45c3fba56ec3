"""A dead load: a force of constant direction and size on a part of the surface."""

import math
from collections.abc import Sequence
from typing import Any, ClassVar

import numpy as np

from fem_reference.effects import Load, Ramped, State
from fem_reference.foundations.indicators import Estimates, Indicator
from fem_reference.foundations.loads import Shape, Wrench, dead
from fem_reference.foundations.mesh import Bools, Floats
from fem_reference.foundations.units import PressureVector


class Traction(Ramped, Load):
    """``amount t``: a force per unit rest area, whose direction and size do not depend on the deformation.

    ``on``: the part of the surface; ``force``: t, the force per unit rest area (3,) [MPa].
    """

    example: ClassVar[dict[str, Any]] = {"force": "0, 6.25, 1 kPa"}
    force: PressureVector

    def indicator(self, scene: Estimates) -> Indicator:
        """The distance by which the load extends the muscle."""
        load = scene.greatest(self) * math.hypot(*self.force)
        part = load / scene.shear
        return Indicator("ratio of traction to shear modulus", part, part * scene.length / 3, load)

    def resultant(self, shape: Shape) -> Wrench:
        """The force and moment on the entire part of the surface."""
        return dead(self.force, shape, self.on)

    def along(self, normals: Floats) -> Bools:
        """Mask (f, 3) of the axes along which the force is not 0."""
        return np.broadcast_to(np.array(self.force) != 0, normals.shape)

    def traction(self, state: State, normal: Sequence[Any]) -> Sequence[Any]:  # noqa: ARG002
        return [state.amount * entry for entry in self.force]
