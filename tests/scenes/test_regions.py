"""Regions of a case: one kind each, with a border that has a place."""

import pytest

from fem_reference.effects import make
from fem_reference.foundations.errors import InputError
from fem_reference.foundations.records import parse
from fem_reference.scenes.regions import CaseRegion, check

FIELD = {"start": "a", "end": "b", "first": 0.25, "last": 0.5}


def region(**changes) -> CaseRegion:
    return parse(CaseRegion, {"name": "fat", "width": "1 mm", "field": FIELD} | changes, "region[0]")


def test_a_region_is_of_one_kind() -> None:
    assert region().field.last == 0.5
    for more in ({"field": None}, {"surface": {"file": "fat.ply", "unit": "mm"}}):
        with pytest.raises(InputError, match="exactly one of"):
            region(**more)


@pytest.mark.parametrize(("first", "last"), [(0.5, 0.5), (0.6, 0.5), (-0.1, 0.5), (0.5, 1.1), (1.0, 1.0)])
def test_a_share_of_the_field_is_between_its_ends(first: float, last: float) -> None:
    with pytest.raises(InputError, match=r"region\[0\]\.field\.(first|last)"):
        region(field=FIELD | {"first": first, "last": last})


def test_attachments_and_regions_are_those_that_there_are() -> None:
    law = make("neo_hooke", mu=0.01, **{"in": "not fat"})
    check([region()], [law], ["a", "b"], "case")
    with pytest.raises(InputError, match=r'case\.region\[0\]\.field\.end: got "b", want one of a'):
        check([region()], [law], ["a"], "case")
    with pytest.raises(InputError, match=r'case\.effect\[0\]\.in: got "fat", want one of skin'):
        check([region(name="skin")], [law], ["a", "b"], "case")
