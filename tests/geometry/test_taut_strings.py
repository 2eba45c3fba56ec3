"""Taut strings: nearly as long as closed forms, outside obstacles, and what they touch in turn."""

import math

import numpy as np
from numpy.testing import assert_allclose

from fem_reference.geometry.obstacles import Quadric, Ring
from fem_reference.geometry.taut_strings import halved, longest, met, taut


def ball(x: float, y: float = 0.0, radius: float = 5.0) -> Quadric:
    pose = np.eye(4)
    pose[:2, 3] = x, y
    return Quadric(pose, np.full(3, radius))


def long(string: np.ndarray) -> np.ndarray:
    return np.linalg.norm(np.diff(string, axis=1), axis=2).sum(axis=1)


def test_around_a_ball_it_is_nearly_as_long_as_the_closed_form() -> None:
    string = taut([ball(0)], np.array([[-13.0, 0, 0]]), np.array([[13.0, 0, 0]]))
    exact = 2 * 12 + 5 * (math.pi - 2 * math.acos(5 / 13))
    # 48 chords of 0.6 mm turn by 0.12 each: they cut off 0.12^2 / 24 of the arc.
    assert_allclose(long(string), exact, rtol=1e-3)
    assert long(string)[0] < exact
    assert np.linalg.norm(string[0], axis=1).min() > 5 - 1e-3


def test_obstacles_are_met_in_turn() -> None:
    obstacles = [ball(20), ball(0), ball(0, 50)]
    starts, ends = (
        np.array([[-13.0, 1, 0], [33, 1, 0], [-13, 20, 0]]),
        np.array([[33.0, 1, 0], [-13, 1, 0], [33, 20, 0]]),
    )
    assert met(obstacles, taut(obstacles, starts, ends)) == [(1, 0), (0, 1), ()]


def test_a_thin_tube_is_not_slipped_past() -> None:
    ring = Ring(np.eye(4), 10.0, 0.3)
    string = taut([ring], np.array([[20.0, 0, 9]]), np.array([[20.0, 0, -9]]))
    plane = string[0][np.abs(string[0][:, 2]) < 0.2]
    assert len(plane)
    assert (np.hypot(plane[:, 0], plane[:, 1]) < 10).all()


def test_middles_and_runs() -> None:
    assert halved(np.array([[[0.0, 0, 0], [2, 0, 0], [2, 4, 0]]]))[0].tolist() == [
        [0, 0, 0], [1, 0, 0], [2, 0, 0], [2, 2, 0], [2, 4, 0],
    ]  # fmt: skip
    first, last = longest(np.array([[1, 0, 1, 1, 0], [1, 1, 1, 0, 1], [0, 0, 0, 0, 1]], dtype=bool))
    assert first.tolist() == [2, 0, 4]
    assert last.tolist() == [3, 2, 4]
