"""Muscles before they are meshed: where their bones are, and what of their surface is attached to them."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import shapes
import small
from numpy.testing import assert_allclose

from fem_reference.foundations.errors import InputError
from fem_reference.foundations.mesh import Surface, check_closed
from fem_reference.geometry.rigid_bodies import Box, HalfSpace
from fem_reference.problems import muscle
from fem_reference.problems.of_case import setup
from fem_reference.problems.setup import AttachedVertices, Bone, Joint, Setup
from fem_reference.scenes import casefile


def test_a_body_rests_where_it_has_no_motion(bar) -> None:
    floor, lid = muscle.setup(casefile.read(bar)).bones
    assert np.array_equal(floor.pose(7), np.eye(4))
    assert not np.array_equal(lid.pose(7), np.eye(4))


def test_bones_of_closed_form_are_their_own_distance(squeezed) -> None:
    floor, lid = muscle.setup(squeezed).bones
    assert floor.shape == floor.solid == HalfSpace((0, 10, 0), (0, 1, 0))
    assert lid.shape == lid.solid == Box((0, 140, 0), (400, 100, 400), 0)
    for bone in (floor, lid):
        assert check_closed(bone.surface) is bone.surface
    assert lid.pose(50) == pytest.approx(np.array([[1, 0, 0, 0], [0, 1, 0, -20], [0, 0, 1, 0], [0, 0, 0, 1]]))
    assert np.array_equal(floor.pose(50), np.eye(4))


BALL = shapes.sphere(2, 10.0)


def held(*vertices: list[int]) -> Setup:
    """A ball of 10 mm with a bone for each list of its vertices."""
    bones = tuple(Bone(f"bone {i}", shapes.sphere(1), None) for i in range(len(vertices)))
    attached = tuple(
        AttachedVertices(f"to {bone.name}", bone, np.array(some)) for bone, some in zip(bones, vertices, strict=True)
    )
    return Setup(BALL, bones, attached, (0, 1), None)


@pytest.mark.slow
def test_a_surface_in_a_file_has_its_distance_with_what_is_inside_below_zero(tmp_path, monkeypatch) -> None:
    monkeypatch.setattr("fem_reference.problems.setup.kept_distances", lambda: tmp_path)
    shape = Bone("ball", BALL, None).shape
    at = np.array([[0.0, 0, 12], [9, 0, 0], [0, 6, 8]])
    # Triangles of a ball of 10 mm are up to a fifth of a millimetre inside it, and its edges are rounded.
    assert shape.sample(at).distance == pytest.approx(np.linalg.norm(at, axis=1) - 10, abs=0.4)
    assert any(tmp_path.iterdir())


def test_an_open_surface_of_a_bone_is_refused_by_the_name_of_the_bone(tmp_path, monkeypatch) -> None:
    monkeypatch.setattr("fem_reference.problems.setup.kept_distances", lambda: tmp_path)
    with pytest.raises(InputError, match='bone "femur": a file'):
        _ = Bone("femur", Surface(BALL.points, BALL.triangles[1:], "a file"), None).shape


def test_attached_vertices_are_those_of_each_attachment_in_turn() -> None:
    assert held([5, 1], [7]).attached_vertices.tolist() == [5, 1, 7]
    assert held().attached_vertices.tolist() == []


def test_what_is_attached_is_not_free_and_what_is_far_from_it_is() -> None:
    z = BALL.points[:, 2]
    rest = held(np.flatnonzero(z > 5).tolist())
    assert not rest.free[z > 5].any()
    assert rest.free[z < 0].all()
    assert held().free.all()


def test_a_start_says_where_points_begin() -> None:
    rest = held()
    points = BALL.points[:4]
    for start, shift in ((None, 0.0), (lambda at: at + [1.0, 0, 0], [1.0, 0, 0])):
        begun = replace(rest, start=start).begin(points)
        assert np.array_equal(begun, points + shift)
        begun[:] = 0  # an array of the caller's own
        assert np.array_equal(points, BALL.points[:4])


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
        ("[1, 0.01, 0]", ON, ("", ""), r"joint\[0\].axis: got .* want the axis of the bone's motion"),
        (AXIS, "5, 6, 30", ("", ""), r"joint\[0\].centre: got a point 1 mm off the axis"),
        (AXIS, ON, ("lid", "floor"), r'joint\[0\].bone: got the bone "floor", which is fixed'),
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
