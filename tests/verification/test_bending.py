"""Bending in the catalogue: what is prescribed, and the circle through the inner face."""

from functools import partial

import numpy as np
import pytest

from fem_reference.verification import bending


def test_bend_starts_at_rest_and_keeps_volume() -> None:
    # The material is incompressible: det F = 1 by central differences of 1e-4 mm, good to 1e-8.
    bend = partial(bending.flexed, 10.0, 20.0, 1.0)
    points = np.random.default_rng(3).uniform((0, -10, 0), (10, 10, 2), (20, 3))
    assert np.abs(bend(points, 0.0)).max() < 1e-14
    sides = [np.eye(3)[axis] * 1e-4 for axis in range(3)]
    columns = [(bend(points + side, 0.7) - bend(points - side, 0.7)) / 2e-4 for side in sides]
    assert np.linalg.det(np.eye(3) + np.stack(columns, axis=2)) == pytest.approx(1, abs=1e-7)


def test_a_circle_is_found_through_its_points() -> None:
    angles = np.array([0.1, 0.4, 0.5, 0.9])
    points = 7 * np.stack([np.cos(angles), np.sin(angles)], axis=1) + [3.0, -2.0]
    assert bending.circle(points) == pytest.approx(7, rel=1e-9)
