"""Fibres that are already stretched in the rest state of the mesh, as in living muscle."""

from collections.abc import Sequence
from typing import Any, ClassVar

from pydantic import Field

from fem_reference.effects import Prestrain, Ramped, State
from fem_reference.foundations.indicators import Estimates, Indicator
from fem_reference.foundations.records import rule


class Prestretch(Ramped, Prestrain):
    """The energies depend on ``F Fp`` with ``Fp = l f f^T + l^(-1/2) (1 - f f^T)``: a stretch ``l = 1 + amount (stretch - 1)``
    along the fibre f at constant volume.

    ``stretch``: dimensionless; above 1 if fibres are taut at rest.
    """

    needs: ClassVar[tuple[str, ...]] = ("fibre",)
    example: ClassVar[dict[str, Any]] = {"stretch": 1.1}
    stretch: float = Field(gt=0)

    _check_stretch = rule(
        lambda one: all(1 + knot.amount * (one.stretch - 1) > 0 for knot in one.ramp),
        "a ramp whose stretches 1 + amount (stretch - 1) are above zero",
    )

    def indicator(self, scene: Estimates) -> Indicator:
        """The shortening of fibres as they are released, and the resulting stress in the matrix."""
        part = scene.greatest(self) * abs(self.stretch - 1)
        return Indicator("stretch of the fibres minus 1", part, 0.1 * part * scene.length, 3 * scene.shear * part)

    def elastic(self, state: State) -> Sequence[Sequence[Any]]:
        return state.stretched(1 + state.amount * (self.stretch - 1))
