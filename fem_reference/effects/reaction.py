"""Decay or growth of a scalar in proportion to itself."""

from typing import Any, ClassVar

from fem_reference.effects import FieldEffect, FieldState, Place


class Reaction(FieldEffect):
    """``c psi``: decay if c is positive, growth if it is negative. Eq. 4.4 of the report DCSE/TR-2022-03: ``C = c``.

    ``rate``: c [1 / time].
    """

    example: ClassVar[dict[str, Any]] = {"rate": 0.5}
    rate: float

    def strong(self, psi: FieldState, place: Place) -> Any:  # noqa: ARG002
        return self.rate * psi.value
