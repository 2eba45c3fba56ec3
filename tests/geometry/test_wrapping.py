"""Paths around spheres and cylinders: closed forms, an independent minimisation, and what every shortest path has."""

import math
from dataclasses import dataclass

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.optimize import minimize
from scipy.spatial.transform import Rotation

from fem_reference.geometry.obstacles import Quadric
from fem_reference.geometry.wrapping import Paths, around, straight


@dataclass(frozen=True)
class Ball:
    """A ball of ``radius`` about ``centre`` [mm], and paths around it."""

    centre: tuple[float, float, float]
    radius: float

    def around(self, starts: np.ndarray, ends: np.ndarray) -> Paths:
        pose = np.eye(4)
        pose[:3, 3] = self.centre
        return around(Quadric(pose, np.full(3, self.radius)), starts, ends)


@dataclass(frozen=True)
class Roll:
    """The infinite cylinder of ``radius`` [mm] about the line through ``point`` [mm] along ``axis``, and paths around it."""

    point: tuple[float, float, float]
    axis: tuple[float, float, float]
    radius: float

    def around(self, starts: np.ndarray, ends: np.ndarray) -> Paths:
        pose = np.eye(4)
        pose[:3, :3] = Rotation.align_vectors([self.axis], [[0, 0, 1]])[0].as_matrix()
        pose[:3, 3] = self.point
        return around(Quadric(pose, np.array([self.radius, self.radius, np.inf])), starts, ends)


BALL = Ball((1.0, -2.0, 3.0), 5.0)
ROLL = Roll((1.0, -2.0, 3.0), (0.2, -0.5, 2.0), 5.0)


def depths(obstacle, points: np.ndarray) -> np.ndarray:
    """Depths (n,) [mm] of points in an obstacle; negative outside."""
    if obstacle is BALL:
        return obstacle.radius - np.linalg.norm(points - obstacle.centre, axis=1)
    axis = np.array(obstacle.axis) / np.linalg.norm(obstacle.axis)
    return obstacle.radius - np.linalg.norm(np.cross(points - obstacle.point, axis), axis=1)


def outside(obstacle, count: int, seed: int) -> np.ndarray:
    """Points within 12 mm around the obstacles and outside."""
    points = np.random.default_rng(seed).uniform(-12, 12, (10 * count, 3)) + [1.0, -2.0, 3.0]
    return points[depths(obstacle, points) < -0.1][:count]


def sampled(paths: Paths, path: int, count: int) -> np.ndarray:
    return paths.at(np.full(count, path), np.linspace(0, 1, count))


def one(obstacle, start, end) -> Paths:
    return obstacle.around(np.array([start], float), np.array([end], float))


@pytest.mark.parametrize("distance", [5.0, 6.0, 13.0])
def test_around_a_sphere_between_opposite_points(distance) -> None:
    # Two tangents of sqrt(d^2 - r^2), and r (pi - 2 acos(r / d)) between.
    ball = Ball((0, 0, 0), 5.0)
    length = 2 * math.sqrt(distance**2 - 25) + 5 * (math.pi - 2 * math.acos(5 / distance))
    paths = one(ball, [-distance, 0, 0], [distance, 0, 0])
    assert_allclose(paths.lengths, length, rtol=1e-14)
    assert np.isfinite(sampled(paths, 0, 20)).all()


def test_a_quarter_of_a_great_circle() -> None:
    paths = one(BALL, np.add(BALL.centre, [5, 0, 0]), np.add(BALL.centre, [0, 5, 0]))
    assert_allclose(paths.lengths, 2.5 * math.pi, rtol=1e-14)
    assert_allclose(sampled(paths, 0, 3)[1], BALL.centre + 5 * np.array([1, 1, 0]) / math.sqrt(2), rtol=1e-14)


def test_a_helix() -> None:
    # Unrolled, a third of a turn on radius 2 with a climb of 7 is the hypotenuse of a right triangle.
    roll = Roll((0, 0, 9.0), (0, 0, 3.0), 2.0)
    end = [2 * math.cos(2 * math.pi / 3), 2 * math.sin(2 * math.pi / 3), 7.0]
    paths = one(roll, [2, 0, 0], end)
    assert_allclose(paths.lengths, math.hypot(2 * 2 * math.pi / 3, 7), rtol=1e-14)
    assert_allclose(sampled(paths, 0, 3)[1], [1, math.sqrt(3), 3.5], rtol=1e-14)


def test_across_a_cylinder_it_is_the_path_around_a_sphere() -> None:
    ends = (np.add(BALL.centre, [-8, 1, 0]), np.add(BALL.centre, [7, 2, 0]))
    across = one(Roll(BALL.centre, (0, 0, 1), BALL.radius), *ends)
    assert_allclose(across.lengths, one(BALL, *ends).lengths, rtol=1e-14)


@pytest.mark.parametrize("obstacle", [BALL, ROLL])
def test_what_misses_is_straight(obstacle) -> None:
    starts, ends = outside(obstacle, 200, 1), outside(obstacle, 200, 2)
    # A chord is clear where no point of it is inside; that of 400 points misses less than 0.01 mm of depth.
    shares = np.linspace(0, 1, 400)[:, None]
    depth = np.array([depths(obstacle, a + shares * (b - a)).max() for a, b in zip(starts, ends, strict=True)])
    paths, chords = obstacle.around(starts, ends), np.linalg.norm(ends - starts, axis=1)
    assert 20 < (depth > 0).sum() < 180
    assert_allclose(paths.lengths[depth < -0.01], chords[depth < -0.01], rtol=1e-14)
    assert (paths.lengths[depth > 0.01] > chords[depth > 0.01] * (1 + 1e-9)).all()
    assert (paths.turns[depth < -0.01] == 0).all()


@pytest.mark.parametrize("obstacle", [BALL, ROLL])
def test_sampled_paths_stay_outside_and_are_as_long_as_reported(obstacle) -> None:
    starts, ends = outside(obstacle, 40, 3), outside(obstacle, 40, 4)
    paths = obstacle.around(starts, ends)
    for path in range(len(starts)):
        points = sampled(paths, path, 1500)
        assert depths(obstacle, points).max() < 1e-12
        assert_allclose(points[[0, -1]], [starts[path], ends[path]], atol=1e-12)
        steps = np.linalg.norm(np.diff(points, axis=0), axis=1)
        # Chords of at most pi / 1500 are shorter than their arc by less than angle^2 / 24 = 2e-7; all are as long, smoothly.
        assert_allclose(steps.sum(), paths.lengths[path], rtol=1e-6)
        assert_allclose(steps, steps.mean(), rtol=1e-5)


@pytest.mark.slow
@pytest.mark.parametrize("obstacle", [BALL, ROLL])
def test_no_path_over_visible_points_is_shorter(obstacle) -> None:
    """Independent of tangents: the least, by SLSQP, over any two points on the obstacle that the ends see."""
    starts, ends = outside(obstacle, 60, 5), outside(obstacle, 60, 6)
    paths = obstacle.around(starts, ends)
    wrapped = np.flatnonzero(paths.turns > 0.1)[:4]
    assert len(wrapped) == 4
    for path in wrapped:
        assert_allclose(paths.lengths[path], least(obstacle, starts[path], ends[path]), rtol=1e-7)


def least(obstacle, start: np.ndarray, end: np.ndarray) -> float:
    if isinstance(obstacle, Ball):

        def surface(u):  # angles of latitude and longitude
            normal = np.array([math.cos(u[0]) * math.cos(u[1]), math.cos(u[0]) * math.sin(u[1]), math.sin(u[0])])
            return obstacle.centre + obstacle.radius * normal, normal

        def geodesic(u):
            one, other = surface(u[:2])[1], surface(u[2:])[1]
            return obstacle.radius * math.atan2(float(np.linalg.norm(np.cross(one, other))), float(one @ other))
    else:
        turn = Rotation.align_vectors([obstacle.axis], [[0, 0, 1]])[0]

        def surface(u):  # height along the axis and angle around it
            normal = turn.apply([math.cos(u[1]), math.sin(u[1]), 0])
            return obstacle.point + obstacle.radius * normal + turn.apply([0, 0, u[0]]), normal

        def geodesic(u):
            around = abs((u[1] - u[3] + math.pi) % (2 * math.pi) - math.pi)
            return math.hypot(obstacle.radius * around, u[0] - u[2])

    def length(u):
        return float(np.linalg.norm(start - surface(u[:2])[0]) + geodesic(u) + np.linalg.norm(end - surface(u[2:])[0]))

    seen = [
        {"type": "ineq", "fun": lambda u: float((start - surface(u[:2])[0]) @ surface(u[:2])[1])},
        {"type": "ineq", "fun": lambda u: float((end - surface(u[2:])[0]) @ surface(u[2:])[1])},
    ]
    random = np.random.default_rng(7)
    tries = [
        minimize(length, random.uniform(-1.5, 1.5, 4) * [1, 2, 1, 2], constraints=seen, options={"ftol": 1e-13})
        for _ in range(8)
    ]
    kept = [found.fun for found in tries if min(entry["fun"](found.x) for entry in seen) > -1e-6]
    return min(kept)


@pytest.mark.parametrize("kind", ["sphere", "cylinder"])
def test_moving_everything_moves_the_path(kind) -> None:
    obstacle = BALL if kind == "sphere" else ROLL
    turn, shift = Rotation.from_rotvec([0.3, -1.1, 0.7]), np.array([30.0, -70, 11])
    middle = tuple(turn.apply(np.array([1.0, -2.0, 3.0])) + shift)
    moved = Ball(middle, 5.0) if kind == "sphere" else Roll(middle, tuple(turn.apply(ROLL.axis)), 5.0)
    starts, ends = outside(obstacle, 30, 8), outside(obstacle, 30, 9)
    still, other = obstacle.around(starts, ends), moved.around(turn.apply(starts) + shift, turn.apply(ends) + shift)
    which, shares = np.arange(30), np.linspace(0, 1, 30)
    # Both round in the 15th digit of numbers near 100.
    assert_allclose(other.lengths, still.lengths, rtol=1e-12)
    assert_allclose(other.at(which, shares), turn.apply(still.at(which, shares)) + shift, atol=1e-10)


@pytest.mark.parametrize("obstacle", [BALL, ROLL])
def test_there_and_back_is_the_same_path(obstacle) -> None:
    starts, ends = outside(obstacle, 30, 10), outside(obstacle, 30, 11)
    there, back = obstacle.around(starts, ends), obstacle.around(ends, starts)
    which, shares = np.arange(30), np.linspace(0, 1, 30)
    assert_allclose(back.lengths, there.lengths, rtol=1e-13)
    assert_allclose(back.at(which, 1 - shares), there.at(which, shares), atol=1e-10)


def test_straight_lines() -> None:
    paths = straight(np.zeros((2, 3)), np.array([[3.0, 4, 0], [0, 0, 0]]))
    assert paths.lengths.tolist() == [5, 0]
    assert paths.at(np.array([0, 0, 1]), np.array([0, 0.5, 0.5])).tolist() == [[0, 0, 0], [1.5, 2, 0], [0, 0, 0]]
