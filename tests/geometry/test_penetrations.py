"""Penetration of a body and a bone: known depths of balls and planes, of either in the other, and none where they are apart."""

import numpy as np
import pytest
import shapes
from crossings import BLOCK, ball
from numpy.testing import assert_allclose

from fem_reference.foundations.mesh import Surface
from fem_reference.foundations.motion import apply
from fem_reference.geometry.intersections import crossings
from fem_reference.geometry.penetrations import Depths, depths, depths_within
from fem_reference.geometry.rigid_bodies import Box, HalfSpace, Sphere
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
