"""Drag of the ground on moving tissue, which keeps a free body from drifting and slows the departure from an unstable state."""

from typing import Any, ClassVar

from fem_reference.effects import Energy, State
from fem_reference.foundations.indicators import Estimates, Indicator
from fem_reference.foundations.loads import Shape, Wrench
from fem_reference.foundations.units import VolumeDamping


class Damping(Energy):
    """A force per unit rest volume of ``-coefficient v``, with v the velocity relative to the ground.

    Over a load step v is ``rate (u - before)`` (implicit Euler), and the force is minus the derivative of
    ``coefficient / 2 rate |u - before|^2``: a potential of the step, not a stored energy.

    ``coefficient``: [MPa s/mm^2].
    """

    outer: ClassVar[bool] = True
    needs: ClassVar[tuple[str, ...]] = ("interval",)
    stored: ClassVar[bool] = False
    example: ClassVar[dict[str, Any]] = {"coefficient": "2 Pa s/mm^2"}

    coefficient: VolumeDamping

    def indicator(self, scene: Estimates) -> Indicator:
        """The sag of a beam under the drag, and the shift of a bar along its axis."""
        force, sideways = (self.coefficient * scene.in_time(speed) for speed in (scene.speed, scene.sideways))
        rule, stress = "drag per cross-section divided by the shear modulus", force * scene.length
        lag = scene.lag(scene.bend(sideways) + scene.draw(force))
        return Indicator(rule, stress / scene.shear, lag, stress)

    def resultant(self, shape: Shape) -> Wrench | None:
        """The drag on the entire body."""
        found = shape.motion()
        return None if found is None else Wrench(*(-self.coefficient * one for one in found))

    def energy(self, state: State) -> Any:
        """The potential of the step per unit rest volume [MPa]."""
        square = sum((now - before) ** 2 for now, before in zip(state.displacement, state.before, strict=True))
        return self.coefficient / 2 * state.rate * square
