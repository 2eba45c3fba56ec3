"""Diffusion of a scalar down its gradient."""

from typing import Any, ClassVar

from pydantic import Field

from fem_reference.effects import FieldEffect, FieldState, Place


class Diffusion(FieldEffect):
    """``-div(k grad psi)``; on a surface, the Laplace-Beltrami operator. Eq. 4.4 of the report DCSE/TR-2022-03: ``A = -k``.

    ``coefficient``: k, greater than 0 [length^2 / time, in the units of the scene].
    """

    example: ClassVar[dict[str, Any]] = {"coefficient": 2.0}
    coefficient: float = Field(gt=0)

    def weak(self, psi: FieldState, test: FieldState, place: Place) -> Any:  # noqa: ARG002
        """``k grad psi . grad test``; a flux through the boundary is a boundary condition."""
        return self.coefficient * sum(a * b for a, b in zip(psi.gradient, test.gradient, strict=True))

    def strong(self, psi: FieldState, place: Place) -> Any:  # noqa: ARG002
        """``-k`` times the Laplacian."""
        return -self.coefficient * psi.laplacian
