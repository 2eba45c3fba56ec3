"""Contact in FEBio's file: its tangent, and no more pressure from overlaps at rest than the matrix bears."""

from dataclasses import replace
from xml.etree.ElementTree import Element

import feb_file
import pytest
import shapes

from fem_reference.export import febio, febio_differences
from fem_reference.export.febio_contact import overlaps
from fem_reference.problems.muscle import MuscleProblem


def test_contact_has_its_whole_tangent(bar: MuscleProblem, feb: Element) -> None:
    """That of sliding is not symmetric; without contact FEBio's solver is left as it is."""
    assert feb.find("Contact/contact/symmetric_stiffness").text == "0"
    assert feb.find("Control/solver/symmetric_stiffness").text == "non-symmetric"
    plain = febio.model(replace(bar, effects=bar.effects[:3]))
    assert plain.find("Control/solver/symmetric_stiffness") is None


def overlapping(deep: float, name: str = "top") -> MuscleProblem:
    """The bar, and a bone of this name that is ``deep`` [mm] in one of its sides between its ends."""
    bar = feb_file.bar()
    plate = shapes.skin(shapes.box((1, 1, 1), (10, 30, 6)))
    plate = plate.moved_to(plate.points + [deep - 10, -10, 12])
    far = plate.moved_to(plate.points - [100, 0, 0])
    bones = tuple(replace(bone, surface=plate if bone.name == name else far) for bone in bar.bones)
    return replace(bar, bones=bones)


def radius(problem: MuscleProblem) -> float:
    (contact,) = febio.model(problem).iterfind("Contact/contact[@type='sliding-elastic']")
    return float(contact.find("search_radius").text)


@pytest.mark.parametrize(("deep", "wanted"), [(0.0, 5.0), (0.15, 5.0), (0.19, 5.0), (0.21, 0.2), (0.5, 0.2)])
def test_an_overlap_at_rest_presses_with_no_more_than_the_matrix_bears(deep: float, wanted: float) -> None:
    """Ten shear moduli of 10 kPa press 0.2 mm deep where the stiffness is 500 kPa/mm."""
    problem = overlapping(deep)
    assert overlaps(problem) == {"top": pytest.approx(deep, abs=1e-12)}
    assert radius(problem) == pytest.approx(wanted, rel=1e-12)
    said = febio_differences.notes(problem)
    assert len(said) == (deep > 0)
    assert all(f"{deep:.2g} mm inside" in text and f"search_radius is {wanted:.2g} mm" in text for text in said)


def test_a_bone_that_is_no_obstacle_may_overlap() -> None:
    """The contact of the bar is by the bone "top" alone."""
    problem = overlapping(0.5, "rests & <waits>")
    assert overlaps(problem) == {"top": 0.0}
    assert radius(problem) == 5.0
