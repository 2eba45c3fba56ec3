"""Bounding boxes of surfaces and triangles."""

import numpy as np
from numpy.testing import assert_array_equal

from fem_reference.foundations.mesh import Surface
from fem_reference.geometry.boxes import bounds, within

POINTS = np.array([[0.0, 5, 2], [1, 4, 2], [-1, 6, 7], [20, 20, 20]])


def test_a_surface_fills_its_bounds() -> None:
    assert_array_equal(bounds(Surface(POINTS, np.array([[0, 1, 2]]))), [[-1, 4, 2], [20, 20, 20]])


def test_triangles_whose_boxes_meet_or_touch_a_box_are_within_it() -> None:
    surface = Surface(POINTS, np.array([[0, 1, 2], [3, 3, 3]]))
    low, high = np.array([-1.0, 4, 2]), np.array([1.0, 6, 7])
    for axis in range(3):
        for way in (-1, 1):
            shift = np.eye(3)[axis] * way * (high - low)
            assert within(surface, low + shift, high + shift).tolist() == [0]
            assert within(surface, low + 1.01 * shift, high + 1.01 * shift).tolist() == []
    assert within(surface, low, np.full(3, 20.0)).tolist() == [0, 1]
    assert within(surface, np.full(3, np.nan), high).tolist() == []
