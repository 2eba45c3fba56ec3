"""Parts of a surface: short edges at rims collapse, rims are spaced evenly and keep their corners, areas are made good."""

import numpy as np
import shapes
from numpy.testing import assert_allclose, assert_array_equal

from fem_reference.foundations.mesh import Surface, check_closed, enclosed_volume, triangle_areas
from fem_reference.geometry.parts import Parts, _along_rims, between, collapsed, widened

BLOCK = shapes.skin(shapes.box((8, 8, 2), (16.0, 16.0, 4.0)))


def _parts(points: np.ndarray, inside: np.ndarray) -> Parts:
    """The block with other points; labelled 1 where ``inside``."""
    labels = inside.astype(np.int64)
    return Parts(points, BLOCK.triangles, labels, between(BLOCK.triangles, labels, len(points)))


def _square() -> np.ndarray:
    """Which triangles are in the square from 4 to 12 mm on the top of the block."""
    corners = BLOCK.points[BLOCK.triangles]
    return np.asarray((corners[:, :, 2] == 4).all(axis=1) & (np.abs(corners[:, :, :2] - 8).max(axis=(1, 2)) <= 4))


def test_points_between_parts_are_those_of_the_rim() -> None:
    rim = _parts(np.array(BLOCK.points), _square()).rim
    x, y, z = BLOCK.points.T
    assert_array_equal(rim, (z == 4) & (np.maximum(np.abs(x - 8), np.abs(y - 8)) == 4))


def test_points_slide_along_a_rim_to_even_distances_and_its_corners_stay() -> None:
    parts = _parts(np.array(BLOCK.points), _square())
    x, y, _ = BLOCK.points.T
    at_side, at_corner = (parts.rim & (np.abs(x - 8) == 4) & chosen for chosen in (y == 8, np.abs(y - 8) == 4))
    shaken = np.array(BLOCK.points)
    shaken[at_side, 1] += 0.5
    slid = _along_rims(_parts(shaken, _square()))
    assert_allclose(slid[at_side], BLOCK.points[at_side], atol=1e-12)
    assert_array_equal(slid[at_corner], BLOCK.points[at_corner])
    assert_array_equal(slid[~parts.rim], shaken[~parts.rim])


def test_a_short_edge_of_a_rim_collapses() -> None:
    x, y, z = BLOCK.points.T
    points = np.array(BLOCK.points)
    points[(x == 4) & (y == 8) & (z == 4), 1] = 6.3
    parts = _parts(points, _square())
    fewer = collapsed(parts, 0.5)
    assert len(fewer.points) == len(points) - 1
    assert_array_equal(check_closed(Surface(fewer.points, fewer.triangles)).triangles, fewer.triangles)
    assert_allclose(fewer.area(1), parts.area(1))
    assert_allclose(enclosed_volume(fewer.points, fewer.triangles), 16 * 16 * 4)
    assert_array_equal(fewer.rim, between(fewer.triangles, fewer.labels, len(fewer.points)))


def test_collapses_leave_rims_and_sharp_edges_where_they_are() -> None:
    x, y, z = BLOCK.points.T
    inner = (z == 4) & (np.abs(x - 8) < 8) & (np.abs(y - 8) < 8)
    points = np.array(BLOCK.points)
    loose = inner & ~_parts(points, _square()).rim
    points[loose, :2] += np.random.default_rng(13).uniform(-0.9, 0.9, (loose.sum(), 2))
    parts = _parts(points, _square())
    for _ in range(3):
        parts = collapsed(parts, 1.6)
    assert len(parts.points) < len(BLOCK.points)
    assert_array_equal(check_closed(Surface(parts.points, parts.triangles)).triangles, parts.triangles)
    assert_allclose(parts.area(1), 64)
    assert_allclose(enclosed_volume(parts.points, parts.triangles), 16 * 16 * 4)


def test_a_rim_is_widened_to_an_area_and_the_volume_kept() -> None:
    ball = shapes.sphere(3, 30.0)
    labels = (ball.points[ball.triangles].mean(axis=1)[:, 2] > 20).astype(np.int64)
    parts = Parts(ball.points, ball.triangles, labels, between(ball.triangles, labels, len(ball.points)))
    wanted, volume = 1.02 * parts.area(1), 1.001 * enclosed_volume(ball.points, ball.triangles)
    points = widened(parts, [wanted], volume, 1.0)
    # Each of four rounds leaves about a tenth.
    assert_allclose(triangle_areas(points, ball.triangles[labels == 1]).sum(), wanted, rtol=1e-4)
    assert_allclose(enclosed_volume(points, ball.triangles), volume, rtol=1e-6)
    still = widened(parts, [10 * wanted], volume, 0.0)
    assert (
        np.linalg.norm(still - ball.points, axis=1).max() < 0.02
    )  # a third of a thousandth of the radius, for the volume
