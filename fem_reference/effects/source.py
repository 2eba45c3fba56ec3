"""A source of a scalar, everywhere or in the upper half of the domain."""

from typing import Any, ClassVar, Literal

from fem_reference.effects import FieldEffect, FieldState, Place
from fem_reference.foundations.formula import Formula, evaluate


class Source(FieldEffect):
    """``-f``: a source of strength f. Eq. 4.4 of the report DCSE/TR-2022-03: ``D f``.

    ``strength``: f, a number or a formula of the coordinates [psi / time]; ``where``: everywhere, or only where y is above the mean
    y of the mesh vertices, as in line 17 of listing 4.5 of the report. In an element that extends to both sides of the mean y, f is
    multiplied by the fraction of the element above it.
    """

    example: ClassVar[dict[str, Any]] = {"strength": "x*y", "where": "everywhere"}
    strength: Formula
    where: Literal["everywhere", "y above average"]

    def strong(self, psi: FieldState, place: Place) -> Any:  # noqa: ARG002
        strength = evaluate(self.strength, place.position, place.functions)
        return -strength * place.upper if self.where == "y above average" else -strength
