"""Records of the fibres of a muscle, which come from files, a Laplace field, or a decomposition of the muscle's volume."""

import math
from functools import partial
from typing import Annotated, Literal, Self

from pydantic import AfterValidator, Field, model_validator

from fem_reference.foundations.records import Record, directed, one_of
from fem_reference.foundations.units import Angle, LengthUnit

# The maximum pennation [rad]. At this pennation, the fibres of a template are at most 1.15 times as long as the muscle is wide.
_STEEPEST = math.radians(60)


class PolylineFile(Record):
    """Fibres given as polylines in a ``file``, with coordinates in ``unit``."""

    file: str
    unit: LengthUnit


class Traced(Record):
    """``count`` fibres, traced along the gradient of a Laplace field from the attachment ``start`` to the attachment ``end``.

    With ``flux = "area"`` the flux per unit area is constant over each attachment, and fibres cover both attachments. Without it,
    the field is 0 on ``start`` and 1 on ``end``, and fibres are concentrated at the rims of wide attachments.
    """

    count: int = Field(gt=0, le=100_000)
    start: str
    end: str
    flux: Literal["area"] | None = None


class KohoutKukacka(Record):
    """Fibres of a ``template`` in the unit cube, mapped into the muscle. ``count``: the number of fibres.

    The map uses a number of ``contours`` of the Laplace field between the attachments ``start`` and ``end``. The fibres of the
    template "pennate" are inclined by the angle ``pennation`` to the direction along the muscle, towards the side of the muscle to
    which the vector ``towards`` points.
    """

    count: int = Field(gt=0, le=10_000)
    start: str
    end: str
    contours: int = Field(ge=4, le=1000)
    template: Literal["parallel", "pennate"]
    pennation: Angle | None = None
    towards: Annotated[tuple[float, float, float], AfterValidator(partial(directed, name='"towards"'))] | None = None

    @model_validator(mode="after")
    def _check(self) -> Self:
        pennate = self.template == "pennate"
        if (self.pennation is None) == pennate or (self.towards is None and pennate):
            raise ValueError('"pennation" and "towards" with the template "pennate", no "pennation" with "parallel"')
        if self.pennation is not None and not 0 < self.pennation <= _STEEPEST:
            raise ValueError('"pennation" above 0 and up to 60 degrees')
        return self


class Chmd(Record):
    """Fibres interpolated between fibres on the surface of the muscle, by the method that Kohout and Cholt call CHMD (report
    DCSE/TR-2022-03, 6.1.2). ``count``: the number of fibres.

    ``heads``: a file for each head of the muscle, with three or more fibres around the head. ``around``: instead of files, fibres
    that are traced along a Laplace field just below the surface.
    """

    count: int = Field(gt=0, le=1000)
    heads: Annotated[tuple[PolylineFile, ...], Field(min_length=1)] | None = None
    around: Traced | None = None

    _check = one_of("heads", "around")


class FibreTurn(Record):
    """A right-handed rotation about an ``axis`` by an ``angle``."""

    axis: Annotated[tuple[float, float, float], AfterValidator(partial(directed, name="an axis"))]
    angle: Angle


class Fibres(Record):
    """The fibres of a muscle, given by exactly one of ``polylines``, ``traced``, ``kohout_kukacka`` and ``chmd``. Their lengths are
    measured, and effects use their directions.

    ``turned``: a rotation from the directions of these fibres to the fibre directions of the material, the same at all points.
    Lengths are still measured along the fibres as given.

    ``complete``: True to extend each fibre that ends more than 2 mm from its attachment to the nearest point of the attachment, in
    a straight line or, where this leaves the muscle, along its surface. Fibres are not extended to an attachment with a ``tendon``.
    """

    polylines: PolylineFile | None = None
    traced: Traced | None = None
    kohout_kukacka: KohoutKukacka | None = None
    chmd: Chmd | None = None
    complete: bool = False
    turned: FibreTurn | None = None

    _check = one_of("polylines", "traced", "kohout_kukacka", "chmd")

    @property
    def ends(self) -> dict[str, str]:
        """The names of the attachments between which the fibres run, by key; empty for fibres from files."""
        around = None if self.chmd is None else self.chmd.around
        between = {"traced": self.traced, "kohout_kukacka": self.kohout_kukacka, "chmd.around": around}
        return {
            f"fibres.{source}.{end}": getattr(one, end)
            for source, one in between.items()
            if one is not None
            for end in ("start", "end")
        }
