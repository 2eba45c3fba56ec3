"""Bones that keep vertices out: the distance that compiled code samples, whom it is asked for, and the path out."""

import numpy as np
import pytest
import shapes
from numpy.testing import assert_allclose, assert_array_equal

from fem_reference.foundations.motion import RigidMotion, apply
from fem_reference.geometry.rigid_bodies import HalfSpace, Sphere
from fem_reference.geometry.signed_distance import FAR, Grid, build
from fem_reference.problems.setup import Bone
from fem_reference.solvers import collision_kernels as collision

BALL = shapes.sphere(2, 20.0)


@pytest.fixture(scope="module")
def grid() -> Grid:
    return build(BALL, 2.0, 6.0)


def floor(height: float = 0.0, motion: RigidMotion | None = None, normal=(0, 0, 1)) -> Bone:
    """All below z = ``height`` [mm]; its surface is not asked."""
    return Bone("floor", BALL, motion, solid=HalfSpace((0, 0, height), normal))


def gridded(grid: Grid, motion: RigidMotion | None) -> Bone:
    body = Bone("ball", BALL, motion)
    vars(body)["shape"] = grid  # as if it had been read from the kept distances
    return body


def compiled_sample(grid: Grid, points):
    return collision.sample(np.array(grid.coefficients), np.array(grid.origin), grid.spacing, points)


def test_compiled_code_samples_what_the_grid_says(grid) -> None:
    # The same sum of 64 products in another order, of coefficients up to 30 mm.
    random = np.random.default_rng(1)
    points = random.uniform(-32, 32, (5000, 3))
    nodes = np.array(grid.origin) + grid.spacing * random.integers(0, grid.coefficients.shape, (500, 3))
    ends = np.array(grid.origin) + grid.spacing * (np.array(grid.coefficients.shape) - 2)
    points = np.vstack([points, nodes, ends, np.array(grid.origin) + grid.spacing])
    wanted = grid.sample(points)
    distance, gradient = compiled_sample(grid, points)
    assert 0.1 < np.mean(wanted.distance == FAR) < 0.9
    assert_array_equal(distance == FAR, wanted.distance == FAR)
    assert_allclose(distance, wanted.distance, rtol=0, atol=1e-12)
    assert_allclose(gradient, wanted.gradient, rtol=0, atol=1e-12)


@pytest.mark.parametrize("lost", [np.nan, np.inf])
def test_no_number_has_no_distance(grid, lost) -> None:
    distance, gradient = compiled_sample(grid, np.array([[1.0, 2, 3], [lost, 0, 0]]))
    assert np.isfinite(distance[0])
    assert np.isnan(distance[1])
    assert_array_equal(gradient[1], 0)


def test_who_has_come_near_is_reported_in_the_frame_of_the_bone() -> None:
    random = np.random.default_rng(2)
    pose = RigidMotion((1, 2, 3), (5, -4, 7), (0.0, 1.0), (0.0, 2.0)).pose(1)
    points, asked_at = random.normal(size=(200, 3)), random.normal(size=(200, 3)) - [9, 1, -4]
    clear = random.uniform(0, 25, 200)
    clear[:3] = np.inf
    there = apply(np.linalg.inv(pose), points)
    wanted = np.flatnonzero(np.linalg.norm(there - asked_at, axis=1) >= clear)
    found, places = collision.approached(points, pose, asked_at, clear)
    assert 0 < len(wanted) < 197
    assert_array_equal(found, wanted)
    assert_allclose(places, there[wanted], atol=1e-14 * 20)  # roundings of coordinates below 20 mm


@pytest.mark.parametrize("kind", ["grid", "closed form"])
def test_nobody_inside_a_bone_is_missed_and_few_are_asked(grid, kind) -> None:
    # Points that wander while the ball turns about an axis beside it: after each step those asked are all that are inside.
    random = np.random.default_rng(3)
    turn = RigidMotion((0, 1, 1), (40, 0, 0), (0.0, 60.0), (0.0, 3.0))
    body = gridded(grid, turn) if kind == "grid" else Bone("ball", BALL, turn, solid=Sphere((0, 0, 0), 20.0))
    points = 60 * random.normal(size=(3000, 3))
    points = points[body.shape.sample(points).distance > 0]
    obstacle = collision.CollidingBone(body, points, np.ones(len(points), bool), 0.0)
    asked = inside = 0
    for frame in range(1, 61):
        points = points + random.normal(scale=0.5, size=points.shape)
        obstacle.move(frame)
        near = obstacle.near(points)
        distance = body.shape.sample(apply(np.linalg.inv(body.pose(frame)), points)).distance
        assert_array_equal(near.vertices[near.value < 0], np.flatnonzero(distance < 0))
        assert_allclose(near.value, distance[near.vertices], atol=1e-9)
        asked, inside = asked + len(near.vertices), inside + np.sum(distance < 0)
    assert inside > 500
    assert asked < (0.7 if kind == "grid" else 0.3) * 60 * len(points)  # of 6 mm, where the bone goes 3 mm a frame


def test_a_vertex_takes_the_shortest_path_out() -> None:
    ball = Bone("ball", BALL, RigidMotion((1, 0, 0), None, (0.0, 1.0), (0.0, 30.0)), solid=Sphere((0, 0, 0), 20.0))
    rest = np.array([[40.0, 0, 0], [40, 5, 0], [80, 0, 0], [40, 0, 5]])
    obstacle = collision.CollidingBone(ball, rest, np.array([True, True, True, False]), 0.0)
    obstacle.move(1)
    points = rest.copy()
    collision.move_out(points, [obstacle], 1.0)
    centre = np.array([30.0, 0, 0])
    wanted = centre + 20 * (rest[:2] - centre) / np.linalg.norm(rest[:2] - centre, axis=1)[:, None]
    assert_allclose(points, [*wanted, *rest[2:]], atol=1e-13)  # a few roundings of 50 mm


def test_stiffness_is_the_share_of_the_depth() -> None:
    points = np.array([[0.0, 0, 5]])
    obstacle = collision.CollidingBone(floor(), points, np.ones(1, bool), 0.0)
    points[0, 2] = -2.0
    collision.move_out(points, [obstacle], 0.25)
    assert_allclose(points, [[0, 0, -1.5]], atol=1e-15)


def test_several_obstacles_add_up() -> None:
    # Havlicek's response in report 6.1.1: in the corner of a floor and a wall both act at once.
    points = np.array([[5.0, 0, 5]])
    free = np.ones(1, bool)
    corner = [collision.CollidingBone(floor(normal=normal), points, free, 0.0) for normal in ((0, 0, 1), (1, 0, 0))]
    points[:] = [[-3.0, 0, -1]]
    collision.move_out(points, corner, 1.0)
    assert_allclose(points, 0, atol=1e-15)


def test_what_is_near_at_rest_may_stay_as_near() -> None:
    rest = np.array([[0.0, 0, -1.5], [0, 0, 0.3], [0, 0, 9]])
    obstacle = collision.CollidingBone(floor(), rest, np.ones(3, bool), 1.0)
    points = rest.copy()
    collision.move_out(points, [obstacle], 1.0)
    assert_array_equal(points, rest)
    points[:, 2] -= 20
    collision.move_out(points, [obstacle], 1.0)
    assert_allclose(points[:, 2], [-1.5, 0.3, 1.0], atol=1e-14)  # roundings of 20 mm


def test_watched_vertices_are_asked_again() -> None:
    points = np.array([[0.0, 0, 5], [0, 0, 6]])
    obstacle = collision.CollidingBone(floor(), points, np.ones(2, bool), 0.0)
    assert_array_equal(obstacle.near(points).vertices, [0, 1])
    assert len(obstacle.near(points).vertices) == 0
    obstacle.watch(np.array([1]))
    assert_array_equal(obstacle.near(points).vertices, [1])


def test_in_the_middle_of_a_ball_there_is_no_path_out_but_no_harm() -> None:
    # The gradient of a spline vanishes on a ridge; nothing goes farther than it is deep.
    rest = np.array([[50.0, 0, 0]])
    obstacle = collision.CollidingBone(
        Bone("ball", BALL, None, solid=Sphere((0, 0, 0), 20.0)), rest, np.ones(1, bool), 0.0
    )
    points = np.zeros((1, 3))
    collision.move_out(points, [obstacle], 1.0)
    assert np.linalg.norm(points) <= 20 + 1e-12


def test_vertices_that_are_no_number_stay_so(grid) -> None:
    rest = np.array([[50.0, 0, 0], [0, 50, 0]])
    obstacle = collision.CollidingBone(gridded(grid, None), rest, np.ones(2, bool), 0.0)
    points = np.array([[np.nan, 0, 0], [0, 19.0, 0]])
    collision.move_out(points, [obstacle], 1.0)
    assert np.isnan(points[0, 0])
    # To what the grid rounds of the triangles of the ball, 20 mm wide: its error is below 0.5 mm.
    assert np.linalg.norm(points[1]) == pytest.approx(20, abs=0.5)
