"""Two families of fibres, at an angle to the fibre direction, which stiffen as they are stretched, as in arteries and fascia."""

from functools import partial
from typing import Annotated, Any, ClassVar

from pydantic import AfterValidator, Field

from fem_reference.effects import Energy, State
from fem_reference.foundations.records import directed
from fem_reference.foundations.units import Angle, PositivePressure


class HolzapfelOgden(Energy):
    """``k1/(2 k2) (exp(k2 (I - 1)^2) - 1)`` for each family that is stretched, with ``I = J^(-2/3) a . C a`` above 1.

    ``k1`` [MPa]; ``k2`` dimensionless; ``angle`` [rad]: the unit vectors ``a`` of the two families are the fibre direction rotated
    by plus and by minus this angle; ``normal``: the axis of this rotation, of any length and not along a fibre. Only the component
    of ``normal`` perpendicular to the fibre matters. Source: Holzapfel, Gasser and Ogden 2000, doi 10.1023/A:1010835316564.
    """

    needs: ClassVar[tuple[str, ...]] = ("fibre",)
    example: ClassVar[dict[str, Any]] = {"k1": "20 kPa", "k2": 1.5, "angle": "30 deg", "normal": [0.2, 0.5, 2.0]}
    k1: PositivePressure
    k2: float = Field(gt=0)
    angle: Angle
    normal: Annotated[tuple[float, float, float], AfterValidator(partial(directed, name="a normal"))]

    def energy(self, state: State) -> Any:
        """Energy per unit rest volume [MPa], zero in slack families."""
        f, functions = state.fibre, state.functions
        across = [self.normal[i] * f[k] - self.normal[k] * f[i] for i, k in ((1, 2), (2, 0), (0, 1))]
        length = functions.sqrt(sum(entry**2 for entry in across))
        cosine, sine = functions.cos(self.angle), functions.sin(self.angle)
        energy = 0
        for sign in (1, -1):
            family = [cosine * a + sign * sine * b / length for a, b in zip(f, across, strict=True)]
            square = state.J ** (-2 / 3) * state.square_stretch(family)
            strain = functions.above(square, 1, square - 1, 0)
            energy += self.k1 / (2 * self.k2) * (functions.exp(self.k2 * strain**2) - 1)
        return energy
