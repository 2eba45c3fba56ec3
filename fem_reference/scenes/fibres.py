"""The sources of a muscle's fibres in a case: a file, a Laplace field, or a decomposition of its volume."""

import math
from functools import partial
from typing import Annotated, Literal, Self

from pydantic import AfterValidator, Field, model_validator

from fem_reference.foundations.records import Record, directed, one_of
from fem_reference.foundations.units import Angle, LengthUnit

# Fibres of a template that is inclined by more than this angle [rad] would all be shorter than the muscle is wide.
_STEEPEST = math.radians(60)


class PolylineFile(Record):
    """Fibres given as polylines in a file."""

    file: str
    unit: LengthUnit


class Traced(Record):
    """Fibres traced along gradient lines of a Laplace field from the attachment ``start`` to ``end``.

    With ``flux = "area"`` the flux per area of an attachment is constant, and fibres cover both attachments. Without it, the field
    is 0 on the start and 1 on the end, and fibres are concentrated at the rims of wide attachments.
    """

    count: int = Field(gt=0, le=100_000)
    start: str
    end: str
    flux: Literal["area"] | None = None


class KohoutKukacka(Record):
    """Fibres of a ``template`` in the unit cube, mapped to ``contours`` of the Laplace field between the attachments ``start``
    and ``end``. Fibres of the template "pennate" are inclined by ``pennation`` in the direction ``towards`` across the muscle.
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
    """Fibres interpolated between fibres on the muscle's surface. ``heads``: a file for each head, with three or more fibres around
    it. ``around``: instead of files, lines of the Laplace field just below the surface.
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
    """The fibres whose lengths are measured: exactly one of ``polylines``, ``traced``, ``kohout_kukacka`` and ``chmd``.

    ``turned``: a rotation, the same everywhere, from the directions of the lines to the fibre directions of the material; lengths
    are still measured along the lines.

    ``complete``: fibre ends over 2 mm from an attachment without ``tendon`` are extended, in the muscle or along its surface, to
    the nearest point of the attachment.
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
        """The attachments between which the fibres run, by the key that names them; none for fibres from a file."""
        around = None if self.chmd is None else self.chmd.around
        between = {"traced": self.traced, "kohout_kukacka": self.kohout_kukacka, "chmd.around": around}
        return {
            f"fibres.{source}.{end}": getattr(one, end)
            for source, one in between.items()
            if one is not None
            for end in ("start", "end")
        }
