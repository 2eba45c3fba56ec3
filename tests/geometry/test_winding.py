"""Paths around several obstacles: closed forms, elliptic integrals, a second program's minimum, and what shortest paths have."""

import math

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.special import ellipeinc

from fem_reference.geometry import winding, wrapping
from fem_reference.geometry.obstacles import Quadric, Ring
from fem_reference.geometry.winding import Winding, around


def at(*place: float) -> np.ndarray:
    pose = np.eye(4)
    pose[:3, 3] = place
    return pose


EGG, BALL = Quadric(at(0, 1, 0), np.array([3.0, 4, 5])), Quadric(at(10, -2, 1), np.full(3, 4.0))


def beside(count: int) -> tuple[np.ndarray, np.ndarray]:
    """Ends on both sides of the egg and the ball."""
    random = np.random.default_rng(5)
    return random.uniform(-4, 4, (count, 3)) + [-8, 0, 0], random.uniform(-4, 4, (count, 3)) + [20, 0, 0]


def sampled(paths: Winding, count: int) -> np.ndarray:
    size = len(paths.lengths)
    points = paths.at(np.repeat(np.arange(size), count), np.tile(np.linspace(0, 1, count), size))
    return points.reshape(size, count, 3)


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["sphere", "cylinder"])
def test_around_a_ball_or_a_roll_it_is_the_closed_form(kind) -> None:
    """The error of Runge-Kutta's method, 1e-7 of the radius for half a turn."""
    random = np.random.default_rng(3)
    starts, ends = (random.uniform(-4, 4, (60, 3)) + [x, 0, 0] for x in (-9, 9))
    quadric = Quadric(np.eye(4), np.array([4.0, 4, 4 if kind == "sphere" else np.inf]))
    found, exact = around([quadric], starts, ends), wrapping.around(quadric, starts, ends)
    assert not found.failed.any()
    assert (exact.turns > 0).sum() > 20
    assert_allclose(found.lengths, exact.lengths, rtol=1e-7)
    for one, other in zip(found.directions(), exact.directions(), strict=True):
        assert_allclose(one, other, atol=1e-6)
    which, shares = np.arange(60), np.linspace(0, 1, 60)
    assert_allclose(found.at(which, shares), exact.at(which, shares), atol=1e-5)


@pytest.mark.parametrize(("a", "c"), [(5.0, 8.0), (6.0, 3.0)])
def test_meridian_and_equator_of_a_spheroid(a, c) -> None:
    """The arc of an ellipse is an elliptic integral, that of the equator a circle."""
    spheroid = Quadric(np.eye(4), np.array([a, a, c]))
    first, last = 0.3, 1.2
    starts, ends = ([[a * math.sin(t), 0, c * math.cos(t)]] for t in (first, last))
    paths = around([spheroid], np.array(starts), np.array(ends))
    m = 1 - (c / a) ** 2
    assert_allclose(paths.lengths, a * (ellipeinc(last, m) - ellipeinc(first, m)), rtol=1e-6)
    angle = 0.9
    paths = around([spheroid], np.array([[a, 0, 0.0]]), np.array([[a * math.cos(angle), a * math.sin(angle), 0]]))
    if c > a:  # on an oblate one the equator is the shortest too, at this angle
        assert_allclose(paths.lengths, a * angle, rtol=1e-6)


@pytest.mark.parametrize("tube", [3.0, 1.0, 0.3])
def test_over_the_tube_of_a_ring(tube) -> None:
    """In a plane through its axis, a ring is a circle: tangents of sqrt(d^2 - r^2) and r (pi - 2 acos(r / d))."""
    ring, away = Ring(np.eye(4), 10.0, tube), 9.0
    exact = 2 * math.sqrt(away**2 - tube**2) + tube * (math.pi - 2 * math.acos(tube / away))
    paths = around([ring], np.array([[10.0, 0, away]]), np.array([[10.0, 0, -away]]))
    assert not paths.failed.any()
    assert_allclose(paths.lengths, exact, rtol=1e-6)
    middle = paths.at(np.array([0]), np.array([0.5]))
    assert_allclose(middle, [[10 - tube, 0, 0]], atol=1e-6)  # through the hole, not around


@pytest.mark.slow
def test_through_the_hole_of_a_ring_it_is_straight() -> None:
    ring = Ring(np.eye(4), 10.0, 2.0)
    starts, ends = np.array([[1.0, 2, 9], [8.0, 0, 0], [0, 0, 9]]), np.array([[-3.0, 1, -7], [0.0, 8, 0], [0, 0, -9]])
    paths = around([ring], starts, ends)  # the second between two points of the inner circle, the third along the axis
    assert not paths.failed.any()
    assert_allclose(paths.lengths, np.linalg.norm(ends - starts, axis=1), rtol=1e-12)


@pytest.mark.slow
def test_around_two_it_is_smooth_outside_and_the_same_backwards() -> None:
    starts, ends = beside(40)
    paths = around([EGG, BALL], starts, ends)
    assert not paths.failed.any()
    assert (paths.arcs[:, winding._STEPS + 1] < paths.lengths).sum() > 20  # met two
    points = sampled(paths, 1500)
    steps = np.linalg.norm(np.diff(points, axis=1), axis=2)
    # Chords turn by less than 0.02: 0.02^2 / 24 = 2e-5 of their length.
    assert_allclose(steps.sum(axis=1), paths.lengths, rtol=2e-5)
    assert_allclose(steps, steps.mean(axis=1, keepdims=True).repeat(1499, axis=1), rtol=1e-3)
    for obstacle in (EGG, BALL):
        assert obstacle.level(points.reshape(-1, 3))[0].min() > -1e-6
    assert_allclose(around([BALL, EGG], ends, starts).lengths, paths.lengths, rtol=1e-8)


@pytest.mark.slow
def test_directions_are_the_slopes_of_the_length() -> None:
    """Moving an end changes the length by the direction there: differences over 2e-4 mm."""
    starts, ends = beside(6)
    paths, step = around([EGG, BALL], starts, ends), 1e-4
    assert not paths.failed.any()
    axis = np.array([1, 2, 3]) / np.sqrt(14)  # oblique: every component counts
    up, down = (around([EGG, BALL], starts, ends + sign * step * axis).lengths for sign in (1, -1))
    assert_allclose((up - down) / (2 * step), paths.directions()[1] @ axis, atol=1e-6)
    up, down = (around([EGG, BALL], starts + sign * step * axis, ends).lengths for sign in (1, -1))
    assert_allclose((up - down) / (2 * step), -paths.directions()[0] @ axis, atol=1e-6)


def test_what_crosses_an_obstacle_has_failed(monkeypatch) -> None:
    monkeypatch.setattr(winding, "met", lambda _, string: [() for _ in string])
    assert around([BALL], np.array([[0.0, -2, 1]]), np.array([[20.0, -2, 1]])).failed.tolist() == [True]


@pytest.mark.parametrize("radius", [0.05, 1e-4])
def test_what_crosses_an_obstacle_that_is_smaller_than_a_step_has_failed(monkeypatch, radius) -> None:
    """30 mm in 200 steps: none of them ends in the ball, nor in the middle of the flat ellipsoid."""
    monkeypatch.setattr(winding, "met", lambda _, string: [() for _ in string])
    starts, ends = np.array([[0.0, 0, 0], [0, 1, 0]]), np.array([[0.0, 0, 30], [0, 1, 30]])
    for radii in (np.full(3, radius), np.array([5.0, 0.5, radius])):
        # A path a millimetre beside it is found.
        assert around([Quadric(at(0, 0, 7.3144), radii)], starts, ends).failed.tolist() == [True, False]
    assert not around([Quadric(at(0, 0, 7.3144), np.array([5.0, 0.5, np.inf]))], starts[1:], ends[1:]).failed.any()


@pytest.mark.slow
@pytest.mark.parametrize("radius", [1e-12, 1e-30])
def test_around_what_has_hardly_a_size_no_path_is_no_number(radius) -> None:
    """Newton's method cannot bend a path around it: not found, and never not-a-number."""
    paths = around([Quadric(at(0, 4, 0), np.full(3, radius))], np.array([[0.0, 4, -15]]), np.array([[0.0, 4, 15]]))
    assert paths.failed.tolist() == [True]


@pytest.mark.slow
def test_a_path_that_is_no_number_has_failed(monkeypatch) -> None:
    plain = winding._geodesic

    def lost(*given) -> tuple[np.ndarray, np.ndarray]:
        points, tangents = plain(*given)
        return points * [[[np.nan]] * len(given[1])], tangents

    monkeypatch.setattr(winding, "_geodesic", lost)
    assert around([BALL], np.array([[0.0, -2, 1]]), np.array([[20.0, -2, 1]])).failed.tolist() == [True]


@pytest.mark.slow
def test_a_tube_so_thin_that_a_string_slips_past_it_has_no_path() -> None:
    """It would take 2e7 points to follow it past a tube of 1 nm."""
    starts, ends = np.array([[12.0, 0, 9]]), np.array([[12.0, 0, -9]])
    assert around([Ring(np.eye(4), 10.0, 1e-6)], starts, ends).failed.tolist() == [True]
    # A thread of 0.1 mm is followed: its length is that of two straight lines by the inside of the ring, but for its thickness.
    paths = around([Ring(np.eye(4), 10.0, 0.1)], starts, ends)
    assert paths.failed.tolist() == [False]
    assert_allclose(paths.lengths, 2 * math.hypot(9, 2.1), rtol=1e-4)


def test_a_path_much_longer_than_the_string_has_failed() -> None:
    """The way over a ball beside a string that slipped through it, which is 3 % shorter."""
    starts, ends = np.array([[0.0, -2, 1]]), np.array([[20.0, -2, 1]])
    found = around([BALL], starts, ends)
    straight = starts[:, None] + np.linspace(0, 1, 9)[None, :, None] * (ends - starts)[:, None]
    assert 1.02 < found.lengths[0] / 20 < 1.15
    assert winding._wrong([BALL], found, straight).tolist() == [True]
    assert winding._wrong([BALL], found, sampled(found, 99)).tolist() == [False]
