"""Triangles cut small: nothing is lost, none stays long, and long thin ones do not become thousands."""

import numpy as np
import pytest
import shapes
from numpy.testing import assert_allclose

from fem_reference.foundations.mesh import Surface, triangle_areas
from fem_reference.geometry.pieces import Pieces, corner_areas, cut, edge_lengths


def pieces_of(surface: Surface, apart: float) -> tuple[Pieces, np.ndarray]:
    found = cut(surface, np.arange(len(surface.triangles)), apart)
    return found, found.of(surface.points[surface.triangles])


@pytest.mark.parametrize("apart", [0.3, 1.0, 20.0])
def test_pieces_cover_their_triangles_and_none_is_long(apart: float) -> None:
    bar = shapes.skin(shapes.box((1, 1, 2), (4, 4, 20)))
    found, places = pieces_of(bar, apart)
    areas = np.bincount(found.parents, corner_areas(places))
    assert_allclose(areas, triangle_areas(bar.points, bar.triangles), rtol=1e-12)
    assert edge_lengths(places).mean(axis=1).max() <= apart
    assert edge_lengths(places).max() <= 1.5 * apart
    assert_allclose(found.corners.sum(axis=2), 1, rtol=1e-15)


def test_a_large_triangle_among_small_ones_is_cut_too() -> None:
    # A ball of 1280 triangles and one tetrahedron of edges of 30 mm beside: on average edges are short.
    ball, corner = shapes.sphere(3, 5.0), 30 * np.vstack([np.zeros(3), np.eye(3)])
    large = np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]]) + len(ball.points)
    both = Surface(np.concatenate([ball.points, corner]), np.concatenate([ball.triangles, large]))
    assert edge_lengths(both.points[both.triangles]).mean() < 1.0
    found, places = pieces_of(both, 1.0)
    assert edge_lengths(places).max() <= 2.0
    assert (found.parents < len(ball.triangles)).sum() == len(ball.triangles)  # those stay


def test_long_thin_triangles_become_fewer_pieces_than_by_quarters() -> None:
    # 80 mm by 0.1 mm, as long as a surface has any, in edges of 1.5 mm at most: three for each half, where quarters make 4^6.
    strip = Surface(np.array([[0.0, 0, 0], [80, 0, 0], [80, 0.1, 0]]), np.array([[0, 1, 2]]))
    found, _ = pieces_of(strip, 1.0)
    assert 53 <= len(found.parents) <= 3**6


def test_what_is_linear_in_triangles_is_carried_over() -> None:
    bar = shapes.skin(shapes.box((1, 2, 1), (4, 6, 5)))
    found, places = pieces_of(bar, 0.7)
    slope = np.array([[1.0, 2.0], [-3.0, 0.5], [0.2, 0.0]])
    assert_allclose(found.of((bar.points @ slope)[bar.triangles]), places @ slope, atol=1e-12)
    assert len(cut(bar, np.zeros(0, np.int64), 1.0).parents) == 0
