"""The volume of a surface within a body: caps and lenses of closed form, shares of a surface, and what cannot overlap."""

import numpy as np
import pytest
import shapes
from numpy.testing import assert_allclose
from scipy.spatial.transform import Rotation

from fem_reference.foundations.mesh import Floats, Surface
from fem_reference.geometry import overlap
from fem_reference.geometry.rigid_bodies import Box, HalfSpace, Obstacle, Sphere

RADIUS = 50.0
BALL = shapes.sphere(5, RADIUS)  # its 20480 triangles lie up to 0.015 mm below the sphere


def shared(surface: Surface, body: Obstacle, counts: np.ndarray | None = None) -> float:
    everything = np.ones(len(surface.triangles), bool)
    return found(surface, body, everything if counts is None else counts).volume


def found(surface: Surface, body: Obstacle, counts: np.ndarray, *points: np.ndarray) -> overlap.Shared:
    return overlap.shared(surface, counts, lambda places: body.sample(places).distance, np.reshape(points, (-1, 3)))


def cap(radius: float, height: float) -> float:
    return np.pi * height**2 * (3 * radius - height) / 3


def lens(one: float, other: float, apart: float) -> float:
    """The volume that balls of two radii share whose centres are ``apart``."""
    heights = [r - (apart**2 + r**2 - q**2) / (2 * apart) for r, q in ((one, other), (other, one))]
    return cap(one, heights[0]) + cap(other, heights[1])


def floor(depth: float) -> HalfSpace:
    return HalfSpace((0, 0, depth - RADIUS), (0, 0, 1))


# 4000 to 8000 points, half of them inside: where all are on the border their number scatters by 1.5 %, tolerances are two of these,
# less where few are. The ball lies up to 0.015 mm inside the sphere, which takes up to 3 % from a depth of 1 mm and 1 % from 3 mm.
@pytest.mark.parametrize(("depth", "within"), [(1, 0.05), (3, 0.03), (10, 0.03), (50, 0.01), (90, 0.01)])
def test_a_ball_in_a_half_space_shares_a_cap(depth: float, within: float) -> None:
    assert_allclose(shared(BALL, floor(depth)), cap(RADIUS, depth), rtol=within)


@pytest.mark.parametrize(("apart", "within"), [(68, 0.04), (65, 0.03), (50, 0.01), (35, 0.01)])
def test_two_balls_share_a_lens(apart: float, within: float) -> None:
    centre = Rotation.from_euler("xyz", [0.3, 1.0, -0.7]).apply([0, 0, apart])
    assert_allclose(shared(BALL, Sphere(tuple(centre), 20.0)), lens(RADIUS, 20.0, apart), rtol=within)


def test_a_body_that_passes_right_through_is_counted_whole() -> None:
    # A square rod of 10 mm through the middle: its length in the ball is 2 sqrt(R^2 - x^2 - y^2), on average to second order
    # 2 R (1 - (x^2 + y^2) / 2 R^2) with means of x^2 and y^2 of 100 / 12 each.
    exact = 100 * 2 * RADIUS * (1 - (100 / 6) / (2 * RADIUS**2))
    assert_allclose(shared(BALL, Box((0, 0, 0), (200, 10, 10), 0)), exact, rtol=0.02)


def test_an_inclination_changes_nothing_but_the_draw() -> None:
    turn = Rotation.random(rng=np.random.default_rng(3))
    turned = BALL.moved_to(turn.apply(BALL.points) + [100, -300, 40])
    normal = turn.apply([0, 0, 1])
    plane = HalfSpace(tuple(turn.apply([0, 0, 5 - RADIUS]) + [100, -300, 40]), tuple(normal))
    assert_allclose(shared(turned, plane), cap(RADIUS, 5), rtol=0.03)


def test_only_what_is_nearest_to_triangles_that_count_is_counted() -> None:
    # The halves of a ball on either side of x = 0 are nearest to the triangles on that side.
    middles = BALL.points[BALL.triangles].mean(axis=1)
    halves = [shared(BALL, floor(20), side) for side in (middles[:, 0] > 0, middles[:, 0] <= 0)]
    assert_allclose(halves, cap(RADIUS, 20) / 2, rtol=0.03)
    assert shared(BALL, floor(20), np.zeros(len(middles), bool)) == 0
    assert shared(BALL, floor(20), middles[:, 2] > 0) == 0  # none of these comes into the floor


def test_bodies_apart_and_the_same_draw_twice() -> None:
    assert shared(BALL, floor(-0.01)) == 0
    assert shared(BALL, Sphere((0, 0, 70.1), 20.0)) == 0
    assert shared(BALL, floor(7)) == shared(BALL, floor(7))


def test_a_body_that_is_swallowed_is_counted_whole() -> None:
    # No vertex and no triangle comes into it, and none needs to count.
    stone = shapes.sphere(3, 20.0)
    nothing = np.zeros(len(BALL.triangles), bool)
    for z, inside in ((25.0, True), (29.0, True), (71.0, False)):  # at 30 it would touch from within
        whole = found(BALL, Sphere((0, 0, z), 20.0), nothing, stone.points + [0, 0, z])
        assert_allclose(whole.volume, 4 / 3 * np.pi * 20**3 * inside, rtol=0.02)
        assert_allclose(whole.deepest, 20.0 * inside, atol=2.0)  # of 4000 points and more the one next to its middle


def test_the_deepest_point_is_known_where_something_is_shared() -> None:
    # In a floor that is the lowest of the ball; of points drawn 4 mm apart.
    whole = found(BALL, floor(30), np.ones(len(BALL.triangles), bool))
    assert 26 < whole.deepest <= 30
    assert found(BALL, floor(-1), np.ones(len(BALL.triangles), bool)) == (0, 0)


def test_an_edge_that_no_vertex_meets_is_found() -> None:
    # A wedge of a box, its corner 0.5 mm within the middle of a face of 10 x 10 mm: a square pyramid's half on an edge,
    # a prism of triangle section 0.5 high and 1 wide, along the 4 mm of the box.
    cube = shapes.skin(shapes.box((1, 1, 1), (10.0, 10.0, 10.0)))
    turn = Rotation.from_euler("y", 45, degrees=True)

    class Wedge:
        def sample(self, points: Floats):
            return Box((0, 0, 0), (6, 4, 6), 0).sample(turn.inv().apply(points - [5, 4, 10 + 3 * 2**0.5 - 0.5]))

    assert_allclose(shared(cube, Wedge()), 0.5 * 0.5 * 1 * 4, rtol=0.05)


def test_a_flat_surface_contains_nothing() -> None:
    assert shared(BALL.moved_to(BALL.points * [1, 1, 0]), floor(RADIUS + 1)) == 0
    assert shared(BALL.moved_to(BALL.points * 0), floor(RADIUS + 1)) == 0
