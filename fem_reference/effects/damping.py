"""Viscous drag relative to the ground. It keeps a free body from drifting and slows the departure from an unstable state."""

from typing import Any, ClassVar

from fem_reference.effects import Energy, State
from fem_reference.foundations.indicators import Estimates, Indicator
from fem_reference.foundations.loads import Shape, Wrench
from fem_reference.foundations.units import VolumeDamping


class Damping(Energy):
    """A drag force ``-coefficient v`` per unit rest volume, where v is the velocity relative to the ground.

    In a load step, implicit Euler gives v = ``rate (u - before)``, where u and ``before`` are the displacements at the end and at
    the start of the step, and ``rate`` is one over the duration of the step. The force is minus the derivative of
    ``coefficient / 2 rate |u - before|^2`` with respect to u. This potential belongs to the step; it is not a stored energy.

    ``coefficient``: drag coefficient [MPa s/mm^2].
    """

    outer: ClassVar[bool] = True
    needs: ClassVar[tuple[str, ...]] = ("interval",)
    stored: ClassVar[bool] = False
    example: ClassVar[dict[str, Any]] = {"coefficient": "2 Pa s/mm^2"}

    coefficient: VolumeDamping

    def indicator(self, scene: Estimates) -> Indicator:
        """The distance by which the muscle lags, due to drag, behind the motion that it would have without drag.

        The estimate is the deflection of a beam under transverse drag plus the axial displacement of a bar under axial drag.
        """
        force, sideways = (self.coefficient * scene.in_time(speed) for speed in (scene.speed, scene.sideways))
        rule, stress = "drag per unit cross-sectional area divided by the shear modulus", force * scene.length
        lag = scene.lag(scene.bend(sideways) + scene.draw(force))
        return Indicator(rule, stress / scene.shear, lag, stress)

    def resultant(self, shape: Shape) -> Wrench | None:
        """The force and moment of the drag on the entire body, None if the motion is not known."""
        found = shape.motion()
        return None if found is None else Wrench(*(-self.coefficient * one for one in found))

    def energy(self, state: State) -> Any:
        """The potential of the drag in the present load step, per unit rest volume [MPa]."""
        square = sum((now - before) ** 2 for now, before in zip(state.displacement, state.before, strict=True))
        return self.coefficient / 2 * state.rate * square
