"""Boxes that may touch: all of those that do, by asking every pair, and few others."""

import numpy as np
import pytest
import shapes
from numpy.testing import assert_allclose, assert_array_equal

from fem_reference.foundations.mesh import Surface
from fem_reference.geometry.boxes import Boxes, around, bounds, boxes_of, touching


def scattered(seed: int, count: int, size: float) -> Boxes:
    rng = np.random.default_rng(seed)
    low = rng.uniform(-50, 50, (3, count))
    return Boxes(low, low + rng.uniform(0, size, (3, count)))


def by_pairs(one: Boxes, other: Boxes) -> tuple[np.ndarray, np.ndarray]:
    touch = (one.low[:, :, None] <= other.high[:, None]) & (other.low[:, None] <= one.high[:, :, None])
    pairs = touch.all(axis=0)
    return np.flatnonzero(pairs.any(axis=1)), np.flatnonzero(pairs.any(axis=0))


# Points, small boxes, boxes as large as the whole, and very different ones.
@pytest.mark.parametrize("sizes", [(0.0, 8.0), (3.0, 3.0), (100.0, 1.0), (1.0, 100.0), (30.0, 0.1)])
def test_every_box_that_touches_one_of_the_others_is_found(sizes) -> None:
    for seed in range(5):
        one, other = scattered(seed, 300, sizes[0]), scattered(seed + 100, 200, sizes[1])
        for found, true in zip(touching(one, other), by_pairs(one, other), strict=True):
            assert np.isin(true, found).all()


def test_boxes_that_share_a_side_or_a_corner_touch() -> None:
    one = Boxes(np.zeros((3, 1)), np.ones((3, 1)))
    for shift in ([1, 0, 0], [1, 1, 1], [-1, -1, -1], [0, -1, 1]):
        other = Boxes(one.low + np.reshape(shift, (3, 1)), one.high + np.reshape(shift, (3, 1)))
        assert [found.tolist() for found in touching(one, other)] == [[0], [0]]
    assert [len(found) for found in touching(one, Boxes(one.low + 1.5, one.high + 1.5))] == [0, 0]
    flat = Boxes(np.zeros((3, 4)), np.zeros((3, 4)))
    assert [len(found) for found in touching(flat, flat)] == [4, 4]


def test_few_others_are_found() -> None:
    # Of spheres of 30 mm that overlap by 1 mm, the caps: 1/60 of either, twice over for the size of triangles and cells.
    ball = shapes.sphere(5, 30.0)
    other = ball.moved_to(ball.points + [59.0, 0, 0])
    for found in touching(boxes_of(ball), boxes_of(other)):
        assert 0.01 < len(found) / len(ball.triangles) < 0.08


def test_nothing_touches_nothing() -> None:
    none, some = Boxes(np.zeros((3, 0)), np.zeros((3, 0))), scattered(1, 10, 1.0)
    for pair in ((none, some), (some, none), (none, none)):
        assert [len(found) for found in touching(*pair)] == [0, 0]


def test_a_triangle_and_a_point_fill_their_boxes() -> None:
    surface = Surface(np.array([[0.0, 5, 2], [1, 4, 2], [-1, 6, 7]]), np.array([[0, 1, 2]]))
    assert_array_equal(bounds(surface), [[-1, 4, 2], [1, 6, 7]])
    assert_array_equal(
        bounds(surface.moved_to(surface.points + 9)), [[8, 13, 11], [10, 15, 16]]
    )  # not those of earlier points
    assert_array_equal(boxes_of(surface).low.T, [[-1, 4, 2]])
    assert_array_equal(boxes_of(surface).high.T, [[1, 6, 7]])
    found = around(surface.points, np.array([1.0, 2.0, 0.5]))
    assert_allclose(found.low.T, [[-1, 4, 1], [-1, 2, 0], [-1.5, 5.5, 6.5]])
    assert_allclose(found.high.T, [[1, 6, 3], [3, 6, 4], [-0.5, 6.5, 7.5]])
