"""Coarser surfaces: they lie on the fine one, keep its volume and sharp edges, and have well-shaped triangles."""

import numpy as np
import pytest
import shapes
from numpy.testing import assert_allclose, assert_array_equal
from scipy.spatial.transform import Rotation

from fem_reference.foundations.mesh import Surface, check_closed, enclosed_volume, triangle_areas
from fem_reference.geometry.coarsening import coarsen, flip_edges, inflate, slide
from fem_reference.geometry.distance import distances


def _qualities(surface: Surface) -> np.ndarray:
    """4 sqrt(3) area over the sum of squared sides: 1 for an equilateral triangle, 0 for a flat one."""
    a, b, c = (surface.points[surface.triangles[:, corner]] for corner in range(3))
    squares = sum(np.sum((p - q) ** 2, axis=1) for p, q in ((a, b), (b, c), (c, a)))
    return 4 * np.sqrt(3) * triangle_areas(surface.points, surface.triangles) / squares


def test_a_coarser_sphere_is_near_the_fine_one_with_second_order() -> None:
    fine = shapes.sphere(4, 30.0)
    coarse = [check_closed(coarsen(fine, count)) for count in (250, 1000)]
    off = [distances(fine.points, surface).distance.mean() for surface in coarse]
    # Four times the triangles halve h and leave a quarter of the distance h^2 / (8 r), up to a third by their shapes.
    assert 3 < off[0] / off[1] < 5.3
    for surface in coarse:
        # What is missing after each shift is divided by about h / r squared: 1e-6 is left after three.
        assert_allclose(
            enclosed_volume(surface.points, surface.triangles), enclosed_volume(fine.points, fine.triangles), rtol=1e-5
        )
        assert _qualities(surface).min() > 0.4
    assert [len(surface.triangles) for surface in coarse] == [250, 1000]


@pytest.mark.parametrize("turn", [Rotation.identity(), Rotation.random(rng=np.random.default_rng(8))])
def test_a_coarser_box_keeps_planes_edges_and_corners(turn: Rotation) -> None:
    fine = shapes.skin(shapes.box((16, 12, 16), (80.0, 60.0, 80.0)))
    fine = fine.moved_to(turn.apply(fine.points))
    coarse = check_closed(coarsen(fine, len(fine.triangles) // 5))
    corners = turn.apply(np.array([[x, y, z] for x in (0, 80) for y in (0, 60) for z in (0, 80)]))
    # A twentieth of a mm on an edge of 10 mm: the inversion bends a plane by h^2 / (2 * 6 diagonals) = 0.03 mm over it.
    assert np.linalg.norm(coarse.points[:, None] - corners, axis=2).min(axis=0).max() < 0.05
    assert distances(coarse.points, fine).distance.max() < 0.05
    assert _qualities(coarse).min() > 0.4


def test_vertices_slide_along_planes_and_edges_only() -> None:
    body = shapes.skin(shapes.box((4, 4, 4), (4.0, 4.0, 4.0)))
    on_faces = np.isclose(body.points % 4, 0)
    rng = np.random.default_rng(9)
    shaken = body.points + np.where(on_faces, 0, rng.uniform(-0.2, 0.2, body.points.shape))
    slid = slide(shaken, body.triangles)
    assert_allclose(slid[on_faces], body.points[on_faces], atol=1e-12)
    assert not np.allclose(slid, shaken)


def test_a_plane_is_flipped_to_delaunay() -> None:
    # A pyramid on a long diamond whose base is split along the wrong diagonal.
    points = np.array([[-3.0, 0, 0], [3, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, -9]])
    sides = [[0, 3, 4], [3, 1, 4], [1, 2, 4], [2, 0, 4]]
    wrong = np.array([[0, 1, 3], [1, 0, 2], *sides])
    right = flip_edges(points, check_closed(Surface(points, wrong)).triangles)
    assert {tuple(sorted(triangle)) for triangle in right.tolist()} >= {(0, 2, 3), (1, 2, 3)}
    assert_allclose(enclosed_volume(points, right), abs(enclosed_volume(points, wrong)))
    assert flip_edges(points, right) is right


def test_flips_keep_a_closed_surface() -> None:
    ball = shapes.sphere(3)
    rng = np.random.default_rng(10)
    points = ball.points + 0.02 * rng.normal(size=ball.points.shape)
    flipped = flip_edges(points, ball.triangles)
    assert not np.array_equal(flipped, ball.triangles)
    assert_array_equal(check_closed(Surface(points, flipped)).triangles, flipped)


def test_inflating_gives_the_volume_asked_for() -> None:
    ball = shapes.sphere(3, 30.0)
    volume = 1.01 * enclosed_volume(ball.points, ball.triangles)
    # Each of three shifts leaves about a hundredth of what was missing.
    assert_allclose(enclosed_volume(inflate(ball.points, ball.triangles, volume), ball.triangles), volume, rtol=1e-6)
