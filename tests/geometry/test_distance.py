"""Distance to a surface: against closed forms on a cube and on one triangle."""

import numpy as np
import pytest
import shapes
from numpy.testing import assert_allclose
from scipy.spatial.transform import Rotation

from fem_reference.foundations.mesh import Surface
from fem_reference.geometry.distance import depth_within, distances, farthest_points, flattened, inside, outer_windings

HIP = np.array([146.0, 238.0, -431.0])  # [mm]
CUBE = shapes.skin(shapes.box((3, 3, 3), (2.0, 2.0, 2.0)))


def _distance_to_cube(points: np.ndarray) -> np.ndarray:
    """Distance to the surface of the cube from 0 to 2."""
    outside = np.linalg.norm(np.maximum(np.abs(points - 1) - 1, 0), axis=1)
    inside = np.minimum(points, 2 - points).min(axis=1)
    return np.where(outside > 0, outside, inside)


def test_distance_to_a_cube_inside_and_outside() -> None:
    points = np.random.default_rng(1).uniform(-2, 4, (500, 3))
    found = distances(points, CUBE)
    # 1e-12: round-off of squares of lengths below 10.
    assert_allclose(found.distance, _distance_to_cube(points), atol=1e-12)
    assert_allclose(np.linalg.norm(found.closest - points, axis=1), found.distance, atol=1e-12)


def test_barycentric_coordinates_give_the_closest_point() -> None:
    points = np.random.default_rng(2).uniform(-2, 4, (500, 3))
    turn = Rotation.random(rng=np.random.default_rng(3))
    surface = CUBE.moved_to(turn.apply(CUBE.points) + HIP)
    found = distances(turn.apply(points) + HIP, surface)
    corners = surface.points[surface.triangles[found.triangle]]
    # 1e-10: coordinates near 500 with 16 digits, divided by triangle heights near 0.5.
    assert_allclose(np.einsum("nk,nkd->nd", found.barycentric, corners), found.closest, atol=1e-10)
    assert_allclose(found.barycentric.sum(axis=1), 1, rtol=1e-12)
    assert found.barycentric.min() >= 0


def test_vertices_edges_and_middles_have_their_own_weights() -> None:
    surface = Surface(np.eye(3), np.array([[0, 1, 2]]))
    weights = np.array([[1, 0, 0], [0, 1, 0], [0, 0.5, 0.5], [0.2, 0.3, 0.5]])
    assert_allclose(distances(weights @ surface.points, surface).barycentric, weights, atol=1e-12)


def test_a_triangle_without_area_still_has_weights() -> None:
    surface = Surface(np.array([[0.0, 0, 0], [1, 0, 0], [2, 0, 0]]), np.array([[0, 1, 2]]))
    found = distances(np.array([[1.0, 3, 0]]), surface)
    assert_allclose(found.distance, 3)
    assert_allclose(found.barycentric.sum(), 1)


def test_no_points_have_no_distances() -> None:
    found = distances(np.zeros((0, 3)), CUBE)
    assert [len(part) for part in (found.distance, found.triangle, found.closest, found.barycentric)] == [0, 0, 0, 0]


@pytest.mark.filterwarnings("ignore::RuntimeWarning")
def test_where_squares_overflow_everything_is_far() -> None:
    found = distances(np.array([[0.0, 0, 0], [1e300, 0, 0]]), Surface(np.full((3, 3), 1e300), np.array([[0, 1, 2]])))
    assert (found.distance == np.inf).all()
    assert (found.triangle == 0).all()
    assert (found.closest == 1e300).all()


@pytest.mark.parametrize("bad", [np.nan, np.inf])
def test_what_is_not_finite_has_no_distance(bad: float) -> None:
    points = np.ones((3, 3))
    points[1, 2] = bad
    with pytest.raises(ValueError, match="distances: the points are not all finite"):
        distances(points, CUBE)
    with pytest.raises(ValueError, match="distances: the points of the surface are not all finite"):
        distances(np.ones((1, 3)), Surface(points, np.array([[0, 1, 2]])))


BALL = shapes.sphere(2, 10.0)
COUNT = len(BALL.triangles)


def together(*surfaces: Surface) -> Surface:
    """Surfaces as parts of one."""
    before = np.cumsum([0, *(len(one.points) for one in surfaces)])
    triangles = [one.triangles + first for one, first in zip(surfaces, before, strict=False)]
    return Surface(np.concatenate([one.points for one in surfaces]), np.concatenate(triangles))


def test_points_are_inside_where_the_surface_winds_round_them() -> None:
    points = np.array([[0.0, 0, 0], [9, 0, 0], [11, 0, 0]])
    assert inside(BALL, points).tolist() == [True, True, False]
    assert inside(BALL, points[:0]).tolist() == []


def test_nothing_winds_round_the_outside_of_a_sound_body() -> None:
    assert not outer_windings(BALL).any()
    assert not outer_windings(BALL.moved_to(BALL.points * [1, 2, 0.1] + 1e3)).any()


def test_a_body_that_is_inside_out_is_negative() -> None:
    assert (outer_windings(Surface(BALL.points, BALL.triangles[:, ::-1])) == -1).all()


def test_a_part_within_another_is_above_zero() -> None:
    found = outer_windings(together(BALL, BALL.moved_to(BALL.points / 2)))
    assert (found[:COUNT] == 0).all()
    assert (found[COUNT:] == 1).all()


def test_a_cavity_is_sound() -> None:
    assert not outer_windings(together(BALL, Surface(BALL.points / 2, BALL.triangles[:, ::-1]))).any()


def test_what_has_no_normal_has_no_number() -> None:
    points = np.array(BALL.points)
    points[BALL.triangles[7]] = points[BALL.triangles[7, 0]]
    assert np.isnan(outer_windings(BALL.moved_to(points))[7])
    points[0] = np.nan
    assert np.isnan(outer_windings(BALL.moved_to(points))).all()


def test_farthest_points_spread() -> None:
    line = np.stack([np.arange(101.0), np.zeros(101), np.zeros(101)], axis=1)
    # An end, the other, the middle, the quarters: each furthest from those before.
    assert farthest_points(line, 5).tolist() == [0, 100, 50, 25, 75]
    assert sorted(farthest_points(line[:3], 5)) == [0, 1, 2]


def test_a_flat_triangle_is_off_a_round_surface_by_its_edges() -> None:
    # Corners of an equilateral triangle of edge 1 on a sphere of radius 10: R - sqrt(R^2 - 1/3), times R; the next term of the
    # series is 1/12 of R^-2 of it.
    points = np.vstack([np.eye(3), 2 * np.eye(3)[:1]]) / np.sqrt(2)
    surface = Surface(points, np.array([[0, 1, 2], [1, 2, 3]]))
    assert flattened(surface, np.array([0.0, 0.4, 0.4])) == pytest.approx(10 * (10 - np.sqrt(100 - 1 / 3)), rel=1e-3)


@pytest.mark.parametrize("deep", [0.6, 0.1, 0.0, -0.1])
def test_a_surface_is_as_deep_within_itself_as_it_was_pushed(deep: float) -> None:
    # Two cubes of 2 mm as one surface, askew in their plane: the middles of facets that face each other are in the planes.
    count, above = len(CUBE.points), CUBE.points + [0.313, 0.217, 2.0 - deep]
    both = Surface(np.concatenate([CUBE.points, above]), np.concatenate([CUBE.triangles, CUBE.triangles + count]))
    every = np.full(len(both.triangles), True)
    assert depth_within(both, every) == pytest.approx(max(deep, 0.0), abs=1e-9)
    assert depth_within(both, ~every) == 0
    assert depth_within(CUBE, every[: len(CUBE.triangles)]) == 0
