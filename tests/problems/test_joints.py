"""Joints of a case: from its keys, from the motions of its bones, and refused where an angle would not be defined."""

from pathlib import Path

import numpy as np
import pytest
import small
from numpy.testing import assert_allclose

from fem_reference.foundations.errors import InputError
from fem_reference.problems.of_case import setup
from fem_reference.problems.setup import Joint
from fem_reference.scenes import casefile

JOINT = """
[[joint]]
name = "hinge"
bone = "lid"
axis = {axis}
centre = "{centre} mm"
"""


def joints(folder: Path, joint: str = "") -> tuple[Joint, ...]:
    scene = small.write(folder) / "case.toml"
    scene.write_text(scene.read_text().replace("\n[[attachment]]", f"{joint}\n[[attachment]]", 1))
    return setup(casefile.read_muscle(folder)).joints


def test_a_bone_that_rotates_is_a_joint_of_its_name(tmp_path: Path) -> None:
    (joint,) = joints(tmp_path / "bar")
    assert (joint.name, joint.bone.name) == ("lid", "lid")
    assert_allclose(joint.axis, [1, 0, 0])
    assert_allclose(joint.centre, [5, 5, 30])
    assert_allclose(joint.angles((0, 5, 10, 20)), [0, 0.2, 0.4, 0], atol=1e-15)


def test_a_joint_against_the_axis_of_the_motion_counts_the_other_way(tmp_path: Path) -> None:
    (joint,) = joints(tmp_path / "bar", JOINT.format(axis="[-3, 0, 0]", centre="-20, 5, 30"))
    assert joint.name == "hinge"
    assert_allclose(joint.axis, [-1, 0, 0])
    assert_allclose(joint.angles((5, 10)), [-0.2, -0.4])
    turned = joint.bone.pose(10)[:3, :3]  # what the angle and the axis say, by its matrix
    assert_allclose([turned[2, 1], turned[1, 1]], [np.sin(-0.4) * -1, np.cos(0.4)])


AXIS, ON = "[1, 0, 0]", "5, 5, 30"


@pytest.mark.parametrize(
    ("axis", "centre", "change", "message"),
    [
        ("[1, 0.01, 0]", ON, ("", ""), r"joint\[0\].axis: got .* want that of the bone's motion"),
        (AXIS, "5, 6, 30", ("", ""), r"joint\[0\].centre: got a point 1 mm off the axis"),
        (AXIS, ON, ("lid", "floor"), r'joint\[0\].bone: got the bone "floor", which rests'),
        (AXIS, ON, ("lid", "femur"), r'joint\[0\].bone: got "femur", want one of floor, lid'),
        (
            AXIS,
            ON,
            ("\n[[joint]]", JOINT.format(axis=AXIS, centre=ON) + "\n[[joint]]"),
            r'joint: got the name "hinge" twice',
        ),
        ("[0, 0, 0]", ON, ("", ""), r"joint\[0\].axis: got .* want an axis that is not zero"),
    ],
)
def test_a_joint_without_an_angle_is_refused(
    tmp_path: Path, axis: str, centre: str, change: tuple[str, str], message: str
) -> None:
    with pytest.raises(InputError, match=message):
        joints(tmp_path / "bar", JOINT.format(axis=axis, centre=centre).replace(*change))
