"""Sectors between sharp edges, and how much of the triangles around them attached vertices take."""

import numpy as np
import pytest
import shapes
from numpy.testing import assert_allclose

from fem_reference.foundations.mesh import vertex_areas
from fem_reference.geometry.sectors import attached_area, attached_shares, sectors, shares_at

BLOCK = shapes.skin(shapes.box((10, 8, 2), (20.0, 16.0, 4.0)))


def test_a_block_has_a_sector_for_each_vertex_of_each_face() -> None:
    # 11 x 9, 11 x 3 and 9 x 3 vertices on two faces each: those on edges count twice, corners three times.
    assert sectors(BLOCK).max() + 1 == 2 * (11 * 9 + 11 * 3 + 9 * 3)


def test_a_smooth_surface_has_one_sector_for_each_vertex() -> None:
    ball = shapes.sphere(3)
    number = sectors(ball)
    assert number.max() + 1 == len(ball.points)
    assert np.array_equal(np.unique(number, return_index=True)[1].size, len(ball.points))


def test_the_vertices_of_a_face_attach_that_face_and_nothing_beside() -> None:
    face = np.flatnonzero(BLOCK.points[:, 2] == 0)
    shares = attached_shares(BLOCK, face)
    on_face = (BLOCK.points[BLOCK.triangles][:, :, 2] == 0).all(axis=1)
    assert np.array_equal(shares, np.repeat(on_face[:, None], 3, axis=1))
    assert_allclose(attached_area(BLOCK, shares), 20 * 16)


@pytest.mark.parametrize("point", [(0, 0, 0), (10, 0, 0), (10, 8, 0)])
def test_a_vertex_without_a_whole_triangle_attaches_all_around_it(point: tuple[float, ...]) -> None:
    alone = np.flatnonzero((BLOCK.points == point).all(axis=1))
    areas = vertex_areas(BLOCK.points, BLOCK.triangles)
    assert_allclose(attached_area(BLOCK, attached_shares(BLOCK, alone)), areas[alone])


def test_on_a_smooth_surface_every_vertex_attaches_all_around_it() -> None:
    ball = shapes.sphere(3, 30.0)
    cap = np.flatnonzero(ball.points[:, 2] > 20)
    areas = vertex_areas(ball.points, ball.triangles)
    assert_allclose(attached_area(ball, attached_shares(ball, cap)), areas[cap].sum())


def test_without_vertices_nothing_is_attached() -> None:
    assert not attached_shares(BLOCK, np.zeros(0, np.int64)).any()


def test_shares_are_linear_in_a_triangle_and_those_of_the_nearest_one() -> None:
    shares = BLOCK.points[BLOCK.triangles][:, :, 0] / 20
    points = np.array([[3.3, 5.1, -2.0], [17.7, 4.2, 9.0]])
    assert_allclose(shares_at(points, BLOCK, shares), points[:, 0] / 20)
