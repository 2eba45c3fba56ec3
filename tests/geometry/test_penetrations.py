"""Penetration of a body and a bone: known depths of balls and planes, of either in the other, and none where they are apart."""

import numpy as np
import pytest
import shapes

from fem_reference.geometry.penetrations import ClosedSurface, Depths, depths
from fem_reference.geometry.rigid_bodies import HalfSpace, Sphere
from fem_reference.geometry.tessellation import tessellated

BODY = shapes.sphere(3, 10.0)
BALL = Sphere((0, 0, 0), 4.0)
BONE = tessellated(BALL, BODY.points, "ball")


def posed(*shift: float) -> np.ndarray:
    pose = np.eye(4)
    pose[:3, 3] = shift
    return pose


def test_depths_in_a_ball_are_its_radius_less_the_distance_from_the_middle() -> None:
    points = np.random.default_rng(2).normal(size=(500, 3)) * 5
    found = ClosedSurface(BODY).depths(points)
    true = np.maximum(10 - np.linalg.norm(points, axis=1), 0)
    assert found == pytest.approx(true, abs=0.1)
    assert (found <= true + 1e-9).all()


@pytest.mark.parametrize("apart", [9.0, 12.0, 13.9])
def test_two_balls_are_as_deep_as_their_radii_are_more_than_apart(apart: float) -> None:
    deep, place = depths(ClosedSurface(BODY), BONE, BALL, posed(apart, 0, 0)).deepest()
    assert deep == pytest.approx(14 - apart, abs=0.15)
    assert place[0] == pytest.approx(10 if apart > 10 else apart - 4, abs=2)


def test_a_bone_within_the_body_is_found_where_no_surfaces_cross() -> None:
    # Of its vertices the nearest to the middle of the body is 1 mm beyond it.
    deep, place = depths(ClosedSurface(BODY), BONE, BALL, posed(0, 0, 3)).deepest()
    assert deep == pytest.approx(9, abs=0.2)
    assert np.linalg.norm(place) == pytest.approx(1, abs=0.1)


def test_nothing_is_deep_where_they_are_apart() -> None:
    found = depths(ClosedSurface(BODY), BONE, BALL, posed(14.1, 0, 0))
    assert found.deepest()[0] == 0
    assert found.deepest(found)[0] == 0


def test_a_half_space_is_entered_as_deep_as_the_body_reaches_below_it() -> None:
    plane = HalfSpace((0, 0, -7), (0, 0, 1))
    slab = tessellated(plane, BODY.points, "plane")
    deep, place = depths(ClosedSurface(BODY), slab, plane, np.eye(4)).deepest()
    assert deep == pytest.approx(3, abs=1e-9)
    assert place[2] == pytest.approx(-10)


def test_a_depth_at_rest_is_taken_off() -> None:
    places = np.array([[0.0, 0, 0], [1, 0, 0]])
    deep, place = Depths(np.array([3.0, 2.5]), places).deepest(Depths(np.array([2.0, 0.5]), places))
    assert deep == 2.0
    assert place.tolist() == [1, 0, 0]
