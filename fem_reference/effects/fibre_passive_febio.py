"""Passive fibres as in FEBio: resistance to stretch, with a toe region followed by a part that is linear in the stretch."""

from typing import Any, ClassVar

import numpy as np
from pydantic import Field

from fem_reference.effects import PassiveFibres, State
from fem_reference.foundations.units import PositivePressure

# Points and weights on (0, 1), as Python floats, because numpy floats would turn symbols into arrays.
_POINTS, _WEIGHTS = np.polynomial.legendre.leggauss(10)
RULE = tuple(zip(((_POINTS + 1) / 2).tolist(), (_WEIGHTS / 2).tolist(), strict=True))


class FibrePassiveFebio(PassiveFibres):
    """``l dW/dl``, where ``l`` is the isochoric fibre stretch, is 0 for ``l`` up to 1, ``c3 (exp(c4 (l - 1)) - 1)`` from
    1 to ``linear_from``, and ``c5 l + c6`` beyond, where c6 makes the function continuous.

    ``c3``, ``c5`` [MPa]; ``c4`` dimensionless; ``linear_from``: a value of ``l``. Source: FEBio Theory Manual, "Transversely
    Isotropic Hyperelastic"; Weiss, Maker and Govindjee 1996, doi 10.1016/0045-7825(96)01035-3. The energy of the toe is an
    exponential integral, which is computed by a Gauss-Legendre rule. The error of this rule is below 1e-12 c3 if
    ``c4 (linear_from - 1)`` is at most 6 and ``linear_from`` is at most 2.
    """

    example: ClassVar[dict[str, Any]] = {"c3": "10 kPa", "c4": 12.0, "c5": "3 MPa", "linear_from": 1.3}
    c3: PositivePressure
    c4: float = Field(gt=0)
    c5: PositivePressure
    linear_from: float = Field(gt=1)

    def energy(self, state: State) -> Any:
        """Energy per unit rest volume [MPa], zero in slack fibres."""
        exp, log, stretch = state.functions.exp, state.functions.log, state.fibre_stretch
        toe = state.between(1, self.linear_from, stretch) - 1
        line = state.functions.above(stretch, self.linear_from, stretch, self.linear_from)
        curved = toe * sum(weight * exp(self.c4 * toe * x) / (1 + toe * x) for x, weight in RULE)
        c6 = self.c3 * (exp(self.c4 * (self.linear_from - 1)) - 1) - self.c5 * self.linear_from
        straight = self.c5 * (line - self.linear_from) + c6 * log(line / self.linear_from)
        return self.c3 * (curved - log(1 + toe)) + straight
