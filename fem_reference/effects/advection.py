"""Advection of a scalar by a flow."""

from typing import Any, ClassVar

from fem_reference.effects import FieldEffect, FieldState, Place


class Advection(FieldEffect):
    """``v . grad psi``; on a surface, only the tangential part of v acts. Eq. 4.4 of the report DCSE/TR-2022-03: ``B = v``.

    ``velocity``: v [length / time], with one component for each coordinate of the domain.
    """

    example: ClassVar[dict[str, Any]] = {"velocity": [1.0, -3.0]}
    velocity: tuple[float, ...]

    def strong(self, psi: FieldState, place: Place) -> Any:  # noqa: ARG002
        return self.along(psi)

    def along(self, function: FieldState) -> Any:
        """The derivative of ``function`` along the flow, times the speed of the flow."""
        return sum(v * slope for v, slope in zip(self.velocity, function.gradient, strict=True))
