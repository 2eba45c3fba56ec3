"""Penetration of a body and a bone: known depths of balls and planes, of either in the other, and none where they are apart;
and the volume within a bone: caps and lenses of closed form, shares of a surface, and what cannot overlap.
"""

import numpy as np
import pytest
import shapes
from crossings import BLOCK, ball
from numpy.testing import assert_allclose
from scipy.spatial.transform import Rotation

from fem_reference.foundations.mesh import Floats, Surface
from fem_reference.foundations.motion import apply
from fem_reference.geometry import penetrations
from fem_reference.geometry.intersections import crossings
from fem_reference.geometry.penetrations import Depths, depths, depths_within
from fem_reference.geometry.rigid_bodies import Box, HalfSpace, Obstacle, Sphere
from fem_reference.geometry.tessellation import tessellated

BODY = shapes.sphere(3, 10.0)
BALL = Sphere((0, 0, 0), 4.0)
BONE = tessellated(BALL, BODY.points, "ball")
STILL = np.eye(4)


def posed(*shift: float) -> np.ndarray:
    pose = np.eye(4)
    pose[:3, 3] = shift
    return pose


def test_depths_in_a_ball_are_its_radius_less_the_distance_from_the_middle() -> None:
    points = np.random.default_rng(2).normal(size=(500, 3)) * 5
    found = depths_within(BODY, points, np.arange(len(BODY.triangles)))
    true = np.maximum(10 - np.linalg.norm(points, axis=1), 0)
    assert found == pytest.approx(true, abs=0.1)
    assert (found <= true + 1e-9).all()


@pytest.mark.parametrize("apart", [9.0, 12.0, 13.9])
def test_two_balls_are_as_deep_as_their_radii_are_more_than_apart(apart: float) -> None:
    deep, place = depths(BODY, BONE, BALL, posed(apart, 0, 0)).deepest()
    assert deep == pytest.approx(14 - apart, abs=0.15)
    assert place[0] == pytest.approx(10 if apart > 10 else apart - 4, abs=2)


def test_a_bone_within_the_body_is_found_where_no_surfaces_cross() -> None:
    # Of its vertices the nearest to the middle of the body is 1 mm beyond it.
    deep, place = depths(BODY, BONE, BALL, posed(0, 0, 3)).deepest()
    assert deep == pytest.approx(9, abs=0.2)
    assert np.linalg.norm(place) == pytest.approx(1, abs=0.1)


def test_nothing_is_deep_where_they_are_apart() -> None:
    found = depths(BODY, BONE, BALL, posed(14.1, 0, 0))
    assert found.deepest()[0] == 0
    assert found.deepest(found)[0] == 0


def test_a_half_space_is_entered_as_deep_as_the_body_reaches_below_it() -> None:
    plane = HalfSpace((0, 0, -7), (0, 0, 1))
    slab = tessellated(plane, BODY.points, "plane")
    deep, place = depths(BODY, slab, plane, np.eye(4)).deepest()
    assert deep == pytest.approx(3, abs=1e-9)
    assert place[2] == pytest.approx(-10)


def test_a_depth_at_rest_is_taken_off() -> None:
    places = np.array([[0.0, 0, 0], [1, 0, 0]])
    found = Depths(np.array([4, 7]), np.array([3.0, 2.5]), places)
    deep, place = found.deepest(Depths(np.array([2, 4, 7]), np.array([9.0, 2.0, 0.5]), places[[0, 0, 1]]))
    assert deep == 2.0
    assert place.tolist() == [1, 0, 0]
    # What was not within at rest counts in full.
    assert found.deepest(Depths(np.array([7]), np.array([2.0]), places[1:]))[0] == 3.0


@pytest.mark.parametrize("known", [[0], [0, 700], []])
def test_depths_do_not_depend_on_what_is_known_to_be_near(known) -> None:
    points = np.random.default_rng(3).normal(size=(200, 3)) * 6
    every = depths_within(BODY, points, np.arange(len(BODY.triangles)))
    assert_allclose(depths_within(BODY, points, np.array(known, np.int64)), every, rtol=0, atol=1e-12)


def test_a_triangle_without_area_hides_nothing() -> None:
    # On the edge between two triangles: what is nearest to it is as deep and on the same side.
    a, b = BODY.triangles[0, :2]
    sliver = Surface(BODY.points, np.concatenate([BODY.triangles, [[a, b, a]]]))
    points = np.array([BODY.points[[a, b]].mean(axis=0) * share for share in (0.9, 1.1)])
    known = np.arange(len(BODY.triangles))
    assert_allclose(depths_within(sliver, points, known), depths_within(BODY, points, known), atol=1e-12)


def test_depths_of_a_body_and_a_bone_turn_with_both() -> None:
    pose = posed(9.0, 0, 0)
    turn = np.eye(4)
    turn[:3, :3], turn[:3, 3] = [[0, -1, 0], [1, 0, 0], [0, 0, 1]], [3.0, -7.0, 2.0]
    deep, place = depths(BODY, BONE, BALL, pose).deepest()
    turned, there = depths(BODY.moved_to(apply(turn, BODY.points)), BONE, BALL, turn @ pose).deepest()
    assert turned == pytest.approx(deep, abs=1e-9)
    assert_allclose(there, apply(turn, place[None])[0], atol=1e-9)


@pytest.mark.parametrize("count", [3, 40])
def test_parts_of_a_bone_are_inside_however_many_there_are(count) -> None:
    # Small balls beside each other: every second one is in the body, 1 mm of it 2 mm at least below the surface.
    small = shapes.sphere(0, 0.5)
    middles = [(0.0, 0.2 * i - 4, 0.0) if i % 2 else (40.0 + 2 * i, 0.0, 0.0) for i in range(count)]
    points = np.concatenate([small.points + middle for middle in middles])
    starts = np.arange(count).repeat(len(small.triangles))[:, None] * len(small.points)
    bone = Surface(points, np.tile(small.triangles, (count, 1)) + starts)
    found = depths(BODY, bone, Sphere((100.0, 0, 0), 1.0), STILL)
    inner = [
        found.values[np.isin(found.at - len(BODY.points) - len(BODY.triangles), part)].max(initial=0)
        for part in np.arange(len(points)).reshape(count, -1)
    ]
    assert [deep > 2 for deep in inner] == [bool(i % 2) for i in range(count)]


@pytest.mark.parametrize("within", [False, True])
def test_a_part_within_counts_beside_one_that_crosses(within: bool) -> None:
    """A ball of 2 mm across the side of the body, and one 5 mm from its middle: up to 7 mm deep; outside only the first counts."""
    ball, count = shapes.sphere(2, 2.0), len(shapes.sphere(2, 2.0).points)
    middles = [(9.0, 0.0, 0.0), (-5.0 if within else -15.0, 0.0, 0.0)]
    points = np.concatenate([ball.points + middle for middle in middles])
    bone = Surface(points, np.concatenate([ball.triangles, ball.triangles + count]))
    assert len(crossings(BODY, bone))
    assert_allclose(
        depths(BODY, bone, Sphere((100.0, 0, 0), 1.0), STILL).deepest()[0], 7.0 if within else 3.0, atol=0.15
    )


def deepest(body: Surface, radius: float, at) -> float:
    surface, form = ball(radius, at)
    return depths(body, surface, form, STILL).deepest()[0]


@pytest.mark.parametrize("at", [-3.0, -2.0, -1.0, 0.0, 1.5])
def test_a_ball_in_the_side_of_a_coarse_block_is_as_deep_as_it_is(at) -> None:
    # Its lowest point is at + radius inside the side x = 0, and nothing of the block but that side is as near.
    assert_allclose(deepest(BLOCK, 2.5, (at, 4.1, 19.3)), max(at + 2.5, 0.0), atol=2.5 * 0.0036)


def test_a_ball_wholly_inside_crosses_no_surface_and_is_deep() -> None:
    surface, _ = ball(2.0, (5.0, 5.0, 20.0))
    assert len(crossings(BLOCK, surface)) == 0
    assert 3.0 <= deepest(BLOCK, 2.0, (5.0, 5.0, 20.0)) <= 5.0  # all of it is 3 to 5 mm deep
    assert deepest(BLOCK, 2.0, (-9.0, 5.0, 20.0)) == 0


def test_a_thin_needle_between_the_vertices_of_a_coarse_block_is_found_all_along() -> None:
    # 0.2 mm thick: no vertex of either is in the other but those of its tip, 7 mm deep.
    needle = shapes.skin(shapes.box((1, 1, 60), (0.2, 0.2, 12.0)))
    turned = needle.moved_to(needle.points[:, [2, 0, 1]] + [-5.0, 3.3, 17.7])
    low, high = turned.points.min(axis=0), turned.points.max(axis=0)
    form = Box(tuple((low + high) / 2), tuple(high - low), 0.0)
    found, place = depths(BLOCK, turned, form, STILL).deepest()
    # The nearest side of the block: y = 0 from 3.3, or the way back along x.
    assert_allclose(found, 3.4, atol=0.2)
    assert place[0] > 3.0


RADIUS = 50.0
ROUND = shapes.sphere(5, RADIUS)  # its 20480 triangles lie up to 0.015 mm below the sphere


def shared(surface: Surface, body: Obstacle, counts: np.ndarray | None = None) -> float:
    everything = np.ones(len(surface.triangles), bool)
    return found(surface, body, everything if counts is None else counts).volume


def found(surface: Surface, body: Obstacle, counts: np.ndarray, *points: np.ndarray) -> penetrations.Shared:
    def distance(places: Floats) -> Floats:
        return body.sample(places).distance

    return penetrations.shared(surface, counts, distance(surface.points), distance, np.reshape(points, (-1, 3)))


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
    assert_allclose(shared(ROUND, floor(depth)), cap(RADIUS, depth), rtol=within)


@pytest.mark.parametrize(("apart", "within"), [(68, 0.04), (65, 0.03), (50, 0.01), (35, 0.01)])
def test_two_balls_share_a_lens(apart: float, within: float) -> None:
    centre = Rotation.from_euler("xyz", [0.3, 1.0, -0.7]).apply([0, 0, apart])
    assert_allclose(shared(ROUND, Sphere(tuple(centre), 20.0)), lens(RADIUS, 20.0, apart), rtol=within)


def test_a_body_that_passes_right_through_is_counted_whole() -> None:
    # A square rod of 10 mm through the middle: its length in the ball is 2 sqrt(R^2 - x^2 - y^2), on average to second order
    # 2 R (1 - (x^2 + y^2) / 2 R^2) with means of x^2 and y^2 of 100 / 12 each.
    exact = 100 * 2 * RADIUS * (1 - (100 / 6) / (2 * RADIUS**2))
    assert_allclose(shared(ROUND, Box((0, 0, 0), (200, 10, 10), 0)), exact, rtol=0.02)


def test_an_inclination_changes_nothing_but_the_draw() -> None:
    turn = Rotation.random(rng=np.random.default_rng(3))
    turned = ROUND.moved_to(turn.apply(ROUND.points) + [100, -300, 40])
    normal = turn.apply([0, 0, 1])
    plane = HalfSpace(tuple(turn.apply([0, 0, 5 - RADIUS]) + [100, -300, 40]), tuple(normal))
    assert_allclose(shared(turned, plane), cap(RADIUS, 5), rtol=0.03)


def test_only_what_is_nearest_to_triangles_that_count_is_counted() -> None:
    # The halves of a ball on either side of x = 0 are nearest to the triangles on that side.
    middles = ROUND.points[ROUND.triangles].mean(axis=1)
    halves = [shared(ROUND, floor(20), side) for side in (middles[:, 0] > 0, middles[:, 0] <= 0)]
    assert_allclose(halves, cap(RADIUS, 20) / 2, rtol=0.03)
    assert shared(ROUND, floor(20), np.zeros(len(middles), bool)) == 0
    assert shared(ROUND, floor(20), middles[:, 2] > 0) == 0  # none of these comes into the floor


def test_bodies_apart_and_the_same_draw_twice() -> None:
    assert shared(ROUND, floor(-0.01)) == 0
    assert shared(ROUND, Sphere((0, 0, 70.1), 20.0)) == 0
    assert shared(ROUND, floor(7)) == shared(ROUND, floor(7))


def test_a_body_that_is_swallowed_is_counted_whole() -> None:
    # No vertex and no triangle comes into it, and none needs to count.
    stone = shapes.sphere(3, 20.0)
    nothing = np.zeros(len(ROUND.triangles), bool)
    for z, inside in ((25.0, True), (29.0, True), (71.0, False)):  # at 30 it would touch from within
        whole = found(ROUND, Sphere((0, 0, z), 20.0), nothing, stone.points + [0, 0, z])
        assert_allclose(whole.volume, 4 / 3 * np.pi * 20**3 * inside, rtol=0.02)
        assert_allclose(whole.deepest, 20.0 * inside, atol=2.0)  # of 4000 points and more the one next to its middle


def test_the_deepest_point_is_known_where_something_is_shared() -> None:
    # In a floor that is the lowest of the ball; of points drawn 4 mm apart.
    whole = found(ROUND, floor(30), np.ones(len(ROUND.triangles), bool))
    assert 26 < whole.deepest <= 30
    assert found(ROUND, floor(-1), np.ones(len(ROUND.triangles), bool)) == (0, 0)


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
    assert shared(ROUND.moved_to(ROUND.points * [1, 1, 0]), floor(RADIUS + 1)) == 0
    assert shared(ROUND.moved_to(ROUND.points * 0), floor(RADIUS + 1)) == 0
