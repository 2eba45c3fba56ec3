"""What a case is like in numbers, beside what its geometry gives by hand."""

import math

import pytest
import small

from fem_reference.problems import muscle
from fem_reference.scenes import casefile
from fem_reference.studies.features import features

CONTACT = """
[[effect]]
name = "contact"
stiffness = "1 MPa/mm"
"""


def found(folder, text=""):
    place = small.write(folder)
    with (place / "case.toml").open("a") as file:
        file.write(text)
    scene = casefile.read_muscle(place)
    return features(scene, muscle.setup(scene))


def test_motion_is_the_way_of_the_attached_vertex_that_goes_farthest(tmp_path) -> None:
    # The lid turns by 0.4 rad at most, about a line 10 mm below the bar's end, whose corners are 5 mm to the side of it: a chord.
    # Both ends of the path, and the attachment that rests, do not move.
    assert found(tmp_path)["motion"] == pytest.approx(2 * math.hypot(10, 5) * math.sin(0.2), rel=1e-9)


@pytest.mark.parametrize(("text", "count"), [("", 0), (CONTACT, 2), (CONTACT + 'bones = ["lid"]\n', 1)])
def test_bones_that_may_press_are_counted(tmp_path, text, count) -> None:
    assert found(tmp_path, text)["contact"] == count
