"""Obstacles of paths: gradients and second derivatives by differences, and points pushed to the surface along its normal."""

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.spatial.transform import Rotation

from fem_reference.geometry.obstacles import Quadric, Ring


def pose(turn=(0.3, -1.1, 0.7), place=(1.0, -2.0, 3.0)) -> np.ndarray:
    made = np.eye(4)
    made[:3, :3], made[:3, 3] = Rotation.from_rotvec(turn).as_matrix(), place
    return made


EVERY = [
    Quadric(pose(), np.array([3.0, 4, 6])),
    Quadric(pose(), np.array([5.0, 5, np.inf])),
    Ring(pose(), 8.0, 2.5),
]
PLACES = np.random.default_rng(1).uniform(-9, 9, (200, 3)) + [1.0, -2.0, 3.0]


@pytest.mark.parametrize("obstacle", EVERY)
def test_derivatives_are_those_of_differences(obstacle) -> None:
    along = Rotation.random(200, rng=3).apply([1.0, 0, 0])
    step = 1e-5
    up, down = (obstacle.level(PLACES + sign * step * along) for sign in (1, -1))
    value, slope = obstacle.level(PLACES)
    assert value.shape == (200,)
    assert_allclose((up[0] - down[0]) / (2 * step), np.sum(slope * along, axis=1), rtol=1e-5, atol=1e-5)
    curved = np.sum((up[1] - down[1]) * along, axis=1) / (2 * step)
    assert_allclose(obstacle.bending(PLACES, along), curved, rtol=1e-5, atol=1e-5)


@pytest.mark.parametrize("obstacle", EVERY)
def test_a_geodesic_curves_along_the_normal_and_stays_on_its_level(obstacle) -> None:
    along = Rotation.random(200, rng=3).apply([1.0, 0, 0])
    slope, found = obstacle.level(PLACES)[1], obstacle.curving(PLACES, along)
    assert_allclose(np.vecdot(slope, found), -obstacle.bending(PLACES, along), rtol=1e-10, atol=1e-12)
    assert_allclose(np.cross(slope, found), 0, atol=1e-10 * np.abs(slope).max() * np.abs(found).max())


@pytest.mark.parametrize("obstacle", EVERY)
def test_what_is_inside_goes_to_the_surface_and_nothing_else_moves(obstacle) -> None:
    inside = obstacle.level(PLACES)[0] < 0
    assert 3 < inside.sum() < 197
    found = obstacle.pushed(PLACES)
    assert_allclose(found[~inside], PLACES[~inside], rtol=0, atol=1e-12)
    assert np.abs(obstacle.level(found[inside])[0]).max() < 1e-4  # three steps of Newton's method from 0.64 - 1


@pytest.mark.parametrize("obstacle", EVERY)
def test_moving_an_obstacle_moves_its_level(obstacle) -> None:
    other = pose((-0.4, 0.2, 1.0), (5.0, 6, -7))
    moved = obstacle.moved(other).level(PLACES @ other[:3, :3].T + other[:3, 3])
    assert_allclose(moved[0], obstacle.level(PLACES)[0], rtol=1e-10, atol=1e-10)
    assert_allclose(moved[1], obstacle.level(PLACES)[1] @ other[:3, :3].T, rtol=1e-10, atol=1e-10)


def test_the_smallest_radius_of_curvature() -> None:
    assert Quadric(np.eye(4), np.array([2.0, 3, 4])).bend == 1.0  # 2^2 / 4, at the ends of the longest axis
    assert Quadric(np.eye(4), np.array([5.0, 5, np.inf])).bend == 5.0
    assert Ring(np.eye(4), 8.0, 2.5).bend == 2.5


def test_a_path_goes_through_the_hole_of_a_ring() -> None:
    ring = Ring(np.eye(4), 8.0, 2.0)
    starts = np.array([[1.0, 0, 5], [20, 0, 5], [20, 0, 5]])
    ends = np.array([[1.0, 0, -5], [20, 0, -5], [30, 0, 5]])
    # Within the hole where it is; outside on the inner circle; on one side alone, in the middle.
    assert_allclose(ring.through(starts, ends), [[1, 0, 0], [6, 0, 0], [25, 0, 5]], atol=1e-12)


@pytest.mark.parametrize("obstacle", EVERY)
@pytest.mark.parametrize("away", [0.0, 1e-15, 1e-10, 1e-8])
def test_the_middle_is_inside_and_pushed_out(obstacle, away) -> None:
    """Where no direction leads out more than others: the centre, a point of the axis, a point of the circle."""
    along = np.array([obstacle.radius if isinstance(obstacle, Ring) else 0.0, away, 0.0])
    middle = (obstacle.pose[:3, 3] + obstacle.pose[:3, :3] @ along)[None]
    pushed = obstacle.pushed(middle)
    assert obstacle.level(middle)[0][0] < -0.9 * min(1.0, obstacle.bend**2)
    assert abs(obstacle.level(pushed)[0][0]) < 1e-3 * max(1.0, obstacle.bend**2)


def test_the_axis_of_a_ring_is_in_its_hole() -> None:
    ring = EVERY[2]
    on_axis = ring.pose[:3, 3] + np.array([[-1.0], [0], [1e-13], [2]]) * ring.pose[:3, 2]
    assert_allclose(ring.level(on_axis)[0], 8.0**2 + np.array([1, 0, 0, 4]) - 2.5**2, rtol=1e-12)
    assert_allclose(ring.pushed(on_axis), on_axis, atol=1e-12)
