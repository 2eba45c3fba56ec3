"""Prescribed paths beside rotations and matrices by hand."""

import pickle

import numpy as np
import pytest

from fem_reference.foundations.motion import RigidMotion
from fem_reference.problems.paths import Affine, Along, Follows, From, Rest, Turn, amount, radially

POINTS = np.random.default_rng(3).uniform(-5, 5, (12, 3))
THERE_AND_BACK = ((0.0, 0.0), (2.0, 1.0), (4.0, -1.0))


@pytest.mark.parametrize(("frame", "much"), [(-1.0, 0.0), (0.0, 0.0), (1.0, 0.5), (2.0, 1.0), (3.0, 0.0), (9.0, -1.0)])
def test_an_amount_is_linear_between_knots_and_stays_beyond_them(frame: float, much: float) -> None:
    assert amount(THERE_AND_BACK, frame) == pytest.approx(much)


def test_what_rests_moves_nowhere_and_turns_by_nothing() -> None:
    assert np.array_equal(Rest()(POINTS, 3.0), np.zeros((12, 3)))
    assert Rest().turning(POINTS) == ((), ())


def test_an_affine_path_is_its_matrix_and_its_shift() -> None:
    path = Affine(((0.1, 0.2, 0.0), (0.0, -0.3, 0.0), (0.0, 0.0, 0.5)), (1.0, 2.0, 3.0), THERE_AND_BACK)
    by_hand = np.array([[0.1 * x + 0.2 * y + 1, -0.3 * y + 2, 0.5 * z + 3] for x, y, z in POINTS])
    assert path(POINTS, 2.0) == pytest.approx(by_hand, abs=1e-12)
    assert path(POINTS, 1.0) == pytest.approx(by_hand / 2, abs=1e-12)
    assert path(POINTS, 4.0) == pytest.approx(-by_hand, abs=1e-12)
    assert path.turning(POINTS) == ((0.0, 2.0, 4.0), (0.0, 0.0, 0.0))


@pytest.mark.parametrize("angle", [0.3, np.pi / 2, 7.0])
def test_a_turn_is_right_handed_about_its_axis_through_its_centre(angle: float) -> None:
    """About z by hand; the axis may be of any length."""
    found = Turn((0.0, 0.0, 3.0), angle, (1.0, 2.0, 50.0))(POINTS, 1.0) + POINTS
    x, y = (POINTS - [1, 2, 50])[:, :2].T
    turned = [np.cos(angle) * x - np.sin(angle) * y + 1, np.sin(angle) * x + np.cos(angle) * y + 2, POINTS[:, 2]]
    assert found == pytest.approx(np.stack(turned, axis=1), abs=1e-12)


def test_a_turn_about_any_axis_is_rigid_and_leaves_the_axis() -> None:
    axis, centre = np.array([1.0, 2, -2]) / 3, np.array([4.0, 0, 1])
    path = Turn(tuple(axis), 1.2, tuple(centre))
    moved = POINTS + path(POINTS, 1.0)
    apart = [np.linalg.norm(points[:, None] - points, axis=2) for points in (POINTS, moved)]
    assert apart[1] == pytest.approx(apart[0], abs=1e-12)
    assert path(centre + np.outer([-3.0, 0, 8], axis), 1.0) == pytest.approx(np.zeros((3, 3)), abs=1e-12)
    # The trace of a rotation by a is 1 + 2 cos a.
    matrix = np.eye(3) + path(centre + np.eye(3), 1.0) - path(centre[None], 1.0)
    assert np.trace(matrix) == pytest.approx(1 + 2 * np.cos(1.2))


def test_a_twist_turns_each_plane_by_its_height() -> None:
    path = Turn((0.0, 0.0, 1.0), 0.1, (0.0, 0.0, 2.0), per_length=True, knots=THERE_AND_BACK)
    for point in POINTS:
        alone = Turn((0.0, 0.0, 1.0), 0.1 * (point[2] - 2), knots=THERE_AND_BACK)
        assert path(point[None], 4.0) == pytest.approx(alone(point[None], 4.0), abs=1e-12)
    frames, angles = path.turning(np.array([[1.0, 0, -6], [0, 1, 5]]))  # 8 mm and 3 mm from the centre
    assert frames == (0.0, 2.0, 4.0)
    assert angles == pytest.approx((0.0, 0.8, -0.8))


def test_radial_points_go_away_along_the_axes_that_count() -> None:
    path = radially(0.2, (1.0, 0.0, 1.0))
    assert path(POINTS, 0.5) == pytest.approx(0.1 * POINTS * [1, 0, 1], abs=1e-12)
    assert path.turning(POINTS) == ((0.0, 1.0), (0.0, 0.0))


def test_what_is_attached_to_a_bone_goes_with_it() -> None:
    down = RigidMotion((0.0, -2.0, 0.0), None, (0.0, 10.0), (0.0, 30.0))
    assert Follows(down.pose)(POINTS, 5.0) == pytest.approx(np.tile([0.0, -15, 0], (12, 1)), abs=1e-12)
    turned = RigidMotion((1, 2, 2), (5.0, 0.0, 1.0), (0.0, 10.0), (0.0, 0.8))
    same = Turn((1.0, 2.0, 2.0), 0.4, (5.0, 0.0, 1.0))
    follows = Follows(turned.pose)
    assert follows(POINTS, 5.0) == pytest.approx(same(POINTS, 1.0), abs=1e-12)
    assert follows.turning(POINTS) == ((0.0, 10.0), (0.0, 0.8))
    assert Follows(lambda _: np.eye(4)).turning(POINTS) is None, "nothing is known of a function of the caller's own"


def test_a_pose_that_begins_late_is_that_of_its_first_frame_before() -> None:
    turned = RigidMotion((0, 0, 1), (0.0, 0.0, 0.0), (0.0, 4.0, 10.0), (0.0, 0.8, 0.2))
    late = From(2.0, turned.pose)
    for frame in (-3.0, 0.0, 2.0):
        assert np.array_equal(late(frame), turned.pose(2.0))
    assert np.array_equal(late(7.0), turned.pose(7.0))
    frames, angles = late.turning(POINTS)
    assert frames == (2.0, 4.0, 10.0)
    assert angles == pytest.approx((0.4, 0.8, 0.2))


def test_fibres_along_one_direction_have_it_everywhere() -> None:
    assert np.array_equal(Along((0.6, 0.0, 0.8))(np.zeros(12, int), POINTS), np.tile([0.6, 0, 0.8], (12, 1)))


def test_paths_reach_another_process() -> None:
    turned = RigidMotion((1, 2, 2), (5.0, 0.0, 1.0), (0.0, 10.0), (0.0, 0.8))
    for path in (Turn((0.0, 1.0, 0.0), 0.7), radially(0.1), Follows(From(2.0, turned.pose))):
        assert np.array_equal(pickle.loads(pickle.dumps(path))(POINTS, 3.0), path(POINTS, 3.0))
