"""A bone turns about its axis, right-handed, or slides along a direction: rigidly, linearly between keyframes, at rest outside."""

import numpy as np
import pytest

from fem_reference.foundations.motion import RigidMotion, apply

AXIS, CENTRE = (1.0, -2.0, 0.5), (10.0, 20.0, -3.0)
TURN = RigidMotion(AXIS, CENTRE, (0.0, 10.0, 30.0), (0.0, 1.0, -0.5))


@pytest.mark.parametrize("frame", [0, 3.3, 10, 25, 30])
def test_pose_is_rigid_and_keeps_the_axis(frame: float) -> None:
    pose = TURN.pose(frame)
    assert pose[:3, :3].T @ pose[:3, :3] == pytest.approx(np.eye(3), abs=1e-14)
    assert np.linalg.det(pose[:3, :3]) == pytest.approx(1, rel=1e-14)
    on_axis = np.array([np.add(CENTRE, np.multiply(t, AXIS)) for t in (-5, 0, 7)])
    assert apply(pose, on_axis) == pytest.approx(on_axis, abs=1e-12)
    assert pose[3].tolist() == [0, 0, 0, 1]


@pytest.mark.parametrize(
    ("frame", "angle"), [(-5, 0.0), (0, 0.0), (5, 0.5), (10, 1.0), (20, 0.25), (30, -0.5), (99, -0.5)]
)
def test_angle_is_linear_between_keyframes(frame: float, angle: float) -> None:
    # Signed angle of a turn R about n: 2 cos = tr R - 1, 2 sin = n . (R32 - R23, R13 - R31, R21 - R12).
    R, n = TURN.pose(frame)[:3, :3], np.divide(AXIS, np.linalg.norm(AXIS))
    sine = n @ [R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1]] / 2
    assert np.arctan2(sine, (np.trace(R) - 1) / 2) == pytest.approx(angle, abs=1e-14)


def test_rest_is_exact() -> None:
    assert np.array_equal(TURN.pose(0), np.eye(4))


def test_positive_angle_is_right_handed() -> None:
    # A quarter turn about the line along z through (1, 0, 0) takes (2, 0, 5) to (1, 1, 5).
    quarter = RigidMotion((0, 0, 3), (1, 0, 0), (0.0, 10.0), (0.0, np.pi / 2))
    moved = apply(quarter.pose(10), np.array([[2.0, 0.0, 5.0]]))
    assert moved == pytest.approx(np.array([[1.0, 1.0, 5.0]]), abs=1e-14)


@pytest.mark.parametrize("scale", [1e-8, 1e8])
def test_length_of_the_axis_does_not_matter(scale: float) -> None:
    x, y, z = (scale * entry for entry in AXIS)
    assert RigidMotion((x, y, z), CENTRE, TURN.frames, TURN.amounts).pose(7) == pytest.approx(TURN.pose(7), abs=1e-12)


# 2 and 1 and 2 mm along the direction for 3 mm of distance.
SLIDE = RigidMotion((2.0, -1.0, 2.0), None, (0.0, 10.0, 30.0), (0.0, 90.0, -30.0))


@pytest.mark.parametrize(
    ("frame", "distance"), [(-5, 0), (0, 0), (5, 45), (10, 90), (20, 30), (25, 0), (30, -30), (99, -30)]
)
def test_distance_is_linear_between_keyframes(frame: float, distance: float) -> None:
    pose = SLIDE.pose(frame)
    assert np.array_equal(pose[:3, :3], np.eye(3))
    assert pose[3].tolist() == [0, 0, 0, 1]
    points = np.array([[1.0, 2, 3], [-7, 0, 5]])
    assert apply(pose, points) - points == pytest.approx(
        np.tile(np.array([2, -1, 2]) * distance / 3, (2, 1)), abs=1e-13
    )


def test_rest_before_a_slide_is_exact() -> None:
    assert np.array_equal(SLIDE.pose(0), np.eye(4))


@pytest.mark.parametrize("scale", [1e-8, 1e8])
def test_length_of_the_direction_does_not_matter(scale: float) -> None:
    x, y, z = (scale * entry for entry in SLIDE.axis)
    assert RigidMotion((x, y, z), None, SLIDE.frames, SLIDE.amounts).pose(7) == pytest.approx(SLIDE.pose(7), abs=1e-12)
