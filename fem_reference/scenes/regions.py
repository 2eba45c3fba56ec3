"""Records of the regions of a muscle in which effects act, such as tendons, aponeuroses, fat and compartments."""

from collections.abc import Sequence
from typing import Annotated

from pydantic import Field

from fem_reference.effects import Effect, region_of
from fem_reference.foundations.material_point import REST
from fem_reference.foundations.records import Name, Record, check_used, key_rule, one_of
from fem_reference.foundations.units import Length, LengthUnit, PositiveLength


class LengthFromAttachment(Record):
    """The part of the muscle within the distance ``length`` of the attached area of the attachment ``name``."""

    name: str
    length: PositiveLength


class DepthBelowPatch(Record):
    """The part of the muscle within the distance ``depth`` of the triangles in a ``file``."""

    file: str
    unit: LengthUnit
    depth: PositiveLength


class ClosedSurface(Record):
    """The part of the muscle inside the closed triangle surface in a ``file``."""

    file: str
    unit: LengthUnit


class LabelledTets(Record):
    """The part of the muscle inside those tetrahedra of a VTU or MSH ``file`` that have one of ``labels`` in the cell array
    ``array``.
    """

    file: str
    unit: LengthUnit
    array: str
    labels: tuple[int, ...] = Field(min_length=1)


class ShareOfField(Record):
    """The part of the muscle in which a Laplace field has values from ``first`` to ``last``. The field is 0 on the attachment
    ``start`` and 1 on the attachment ``end``.
    """

    start: str
    end: str
    first: float = Field(ge=0, lt=1)
    last: float = Field(gt=0, le=1)

    _check_last = key_rule("last", lambda last, keys: last > keys.get("first", 0), "a number greater than `first`")


class CaseRegion(Record):
    """A part of the muscle at rest, given by exactly one of ``attachment``, ``patch``, ``surface``, ``tets`` and ``field``.

    An effect acts in a region if its key ``in`` names the region. At each point the effect is weighted by the share of the point in
    the region, which grows from 0 at the border to 1 at a depth of ``width``. Regions with the same name are united.
    """

    name: Name
    width: Annotated[Length, Field(ge=0)]
    attachment: LengthFromAttachment | None = None
    patch: DepthBelowPatch | None = None
    surface: ClosedSurface | None = None
    tets: LabelledTets | None = None
    field: ShareOfField | None = None

    _check = one_of("attachment", "patch", "surface", "tets", "field")

    _check_name = key_rule(
        "name",
        lambda name, _: not name.startswith(REST),
        f'a name that does not begin with "{REST}", which stands for the rest of the muscle',
    )


def check(regions: Sequence[CaseRegion], effects: Sequence[Effect], attachments: Sequence[str], place: str) -> None:
    """Raise InputError if one of the ``effects`` acts in a region that does not exist, or if one of the ``regions`` refers to a
    name that is not among ``attachments``. ``place``: the place of the case in messages.
    """
    laws = [
        (f"effect[{i}].in", region.removeprefix(REST)) for i, law in enumerate(effects) if (region := region_of(law))
    ]
    check_used([one.name for one in regions], laws, place)
    for i, one in enumerate(regions):
        named = [(f"region[{i}].attachment.name", one.attachment.name)] if one.attachment else []
        named += [(f"region[{i}].field.{end}", getattr(one.field, end)) for end in ("start", "end") if one.field]
        check_used(attachments, named, place)
