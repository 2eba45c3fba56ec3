"""Signed distance to analytic bodies: closed forms, fine triangulations measured by libigl, finite differences."""

import itertools
import pickle

import igl
import numpy as np
import pytest
import shapes
from numpy.testing import assert_allclose
from scipy.spatial import ConvexHull

from fem_reference.foundations.errors import InputError
from fem_reference.foundations.mesh import Floats
from fem_reference.geometry.rigid_bodies import Box, Capsule, Cylinder, HalfSpace, Obstacle, Sphere

START, END = (1.0, 2.0, -1.0), (3.0, -1.0, 5.0)  # of length 7
AXIS = np.subtract(END, START) / 7
BODIES = {
    "half_space": HalfSpace((1.0, 2.0, 3.0), (1.0, -2.0, 2.0)),
    "sphere": Sphere((1.0, -1.0, 2.0), 3.0),
    "capsule": Capsule(START, END, 2.0),
    "box": Box((1.0, 0.0, 2.0), (4.0, 6.0, 3.0), 0.0),
    "rounded_box": Box((1.0, 0.0, 2.0), (4.0, 6.0, 3.0), 1.0),
    "cylinder": Cylinder(START, END, 2.0),
}
any_body = pytest.mark.parametrize("body", BODIES.values(), ids=BODIES)


def _points(seed: int, count: int = 4000) -> Floats:
    return np.random.default_rng(seed).uniform(-6, 9, (count, 3))


def _perpendicular() -> Floats:
    """Two unit vectors (2, 3) that stand on the axis and on each other."""
    return np.linalg.svd(AXIS[None])[2][1:]


def _ball(radius: float) -> Floats:
    """Points (n, 3) of a sphere about the origin."""
    return shapes.sphere(4, radius).points


def _rims(radius: float) -> Floats:
    """Points (n, 3) of the circles about START and END."""
    angle = np.linspace(0, 2 * np.pi, 1000, endpoint=False)
    circle = radius * np.column_stack([np.cos(angle), np.sin(angle)]) @ _perpendicular()
    return np.concatenate([circle + START, circle + END])


def _corners(half: tuple[float, float, float]) -> Floats:
    """The corners (8, 3) of a box about (1, 0, 2)."""
    return np.array([1, 0, 2]) + np.array(half) * np.array(list(itertools.product((-1, 1), repeat=3)))


def _hull_distance(points: Floats, corners: Floats) -> Floats:
    """The signed distance (n,) to the convex hull of ``corners``, by libigl from the triangles of qhull."""
    hull = ConvexHull(corners)
    a, b, c = (corners[hull.simplices[:, k]] for k in range(3))
    inward = np.einsum("ij,ij->i", np.cross(b - a, c - a), hull.equations[:, :3]) < 0
    triangles = np.where(inward[:, None], hull.simplices[:, ::-1], hull.simplices).astype(np.int64)
    squares, _, _ = igl.point_mesh_squared_distance(points, corners, triangles)
    outside = (points @ hull.equations[:, :3].T + hull.equations[:, 3]).max(axis=1) > 0
    return np.where(outside, 1, -1) * np.sqrt(squares)


# The triangles of a ball of radius r have edges e up to 0.083 r and lie up to e^2 / 6 r = 1.15e-3 r below it; the chords
# of the rims r (2 pi / 1000)^2 / 8 = 1e-5. A box is its own hull: round-off.
@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "corners", "within"),
    [
        ("sphere", _ball(3.0) + [1, -1, 2], 3.5e-3),
        ("capsule", np.concatenate([_ball(2.0) + START, _ball(2.0) + END]), 2.3e-3),
        ("box", _corners((2.0, 3.0, 1.5)), 1e-12),
        ("rounded_box", np.concatenate([_ball(1.0) + corner for corner in _corners((1.0, 2.0, 0.5))]), 1.2e-3),
        ("cylinder", _rims(2.0), 2e-5),
    ],
)
def test_distance_to_a_fine_triangulation(name: str, corners: Floats, within: float) -> None:
    points = _points(1)
    distance = BODIES[name].sample(points).distance
    expected = _hull_distance(points, corners)
    assert_allclose(distance, expected, rtol=0, atol=within)
    assert (distance[np.abs(expected) > within] < 0).any()


def test_distance_to_a_plane_and_its_normal() -> None:
    found = BODIES["half_space"].sample(np.array([[1.0, 2, 3], [2, 2, 3], [1, 5, 3]]))
    # By hand: the unit normal is (1, -2, 2) / 3.
    assert_allclose(found.distance, [0, 1 / 3, -2], atol=1e-15)
    assert_allclose(found.gradient, np.tile([1 / 3, -2 / 3, 2 / 3], (3, 1)))
    assert not found.curvature.any()


@any_body
def test_gradient_is_a_unit_vector_that_leads_to_the_surface(body: Obstacle) -> None:
    points = _points(2)
    found = body.sample(points)
    assert_allclose(np.linalg.norm(found.gradient, axis=1), 1, rtol=1e-12)
    on_surface = points - found.distance[:, None] * found.gradient
    assert_allclose(body.sample(on_surface).distance, 0, atol=1e-12)  # round-off of lengths near 10


@any_body
def test_gradient_and_curvature_are_the_slopes_of_the_distance(body: Obstacle) -> None:
    points, step = _points(3), 1e-5
    found = body.sample(points)
    steps = [(body.sample(points + step * axis), body.sample(points - step * axis)) for axis in np.eye(3)]
    slopes = np.stack([(after.distance - before.distance) / (2 * step) for after, before in steps], axis=1)
    bends = np.stack([(after.gradient - before.gradient) / (2 * step) for after, before in steps], axis=2)
    # Central differences are wrong by step^2 / curvature radius^3; on 4000 points few radii are below 0.02: 1e-5.
    # A ridge or an edge within a step of a point harms that point alone: the chance is some 1e-5 per point.
    smooth = np.abs(bends - found.curvature).max(axis=(1, 2)) < 1e-5 * (
        1 + np.abs(found.curvature).max(axis=(1, 2)) ** 3
    )
    assert smooth.mean() > 0.999
    assert_allclose(slopes[smooth], found.gradient[smooth], atol=1e-6)
    assert_allclose(found.curvature, found.curvature.transpose(0, 2, 1), atol=1e-12)
    # Along the gradient the distance grows evenly.
    assert_allclose(np.einsum("nij,nj->ni", found.curvature, found.gradient), 0, atol=1e-9)


def test_mean_curvature_of_a_ball_of_a_pipe_and_of_flats() -> None:
    directions = shapes.sphere(1).points
    # The trace is 2 / r beside a point and 1 / r beside a line, at the distance r from it.
    for r in (0.5, 3.0, 7.0):
        curvature = BODIES["sphere"].sample(r * directions + [1, -1, 2]).curvature
        assert_allclose(np.trace(curvature, axis1=1, axis2=2), 2 / r)
        beside = np.array([START]) + 3.5 * AXIS + r * _perpendicular()
        assert_allclose(np.trace(BODIES["capsule"].sample(beside).curvature, axis1=1, axis2=2), 1 / r)
    beside = np.array([START]) + 3.5 * AXIS + 1.5 * _perpendicular()
    assert_allclose(np.trace(BODIES["cylinder"].sample(beside).curvature, axis1=1, axis2=2), 1 / 1.5)
    assert_allclose(BODIES["cylinder"].sample(np.array([END]) + 0.2 * AXIS).curvature, 0, atol=1e-12)
    assert not BODIES["box"].sample(np.array([[1.5, 0.5, 4.0], [1.5, 0.5, 3.4]])).curvature.any()


def test_rounding_takes_its_share_of_a_corner_and_leaves_the_faces() -> None:
    corner, face = np.array([[3.0, 3.0, 3.5]]), np.array([[3.0, 0, 2]])
    # By hand: a ball of radius 1 touches three faces; the corner of its cube is sqrt(3) - 1 beyond it.
    assert_allclose(BODIES["rounded_box"].sample(corner).distance, 3**0.5 - 1)
    assert_allclose(BODIES["box"].sample(corner).distance, 0, atol=1e-15)
    assert_allclose(BODIES["rounded_box"].sample(face).distance, 0, atol=1e-15)


@pytest.mark.parametrize(
    ("name", "place", "depth"),
    [
        ("sphere", (1.0, -1.0, 2.0), -3.0),
        ("capsule", tuple(START + 3.5 * AXIS), -2.0),
        ("box", (1.0, 0.0, 2.0), -1.5),
        ("cylinder", tuple(START + 3.5 * AXIS), -2.0),
    ],
)
def test_centres_and_axes_have_some_normal_and_no_curvature(name: str, place: tuple, depth: float) -> None:
    found = BODIES[name].sample(np.array([place]))
    assert_allclose(found.distance, depth, atol=1e-12)
    assert_allclose(np.linalg.norm(found.gradient), 1)
    assert np.isfinite(found.curvature).all()


@any_body
def test_nothing_is_deeper_than_half_the_thickness(body: Obstacle) -> None:
    deepest = -body.sample(_points(3, 20000)).distance.min()
    assert deepest <= body.half_thickness
    assert deepest > 0.8 * body.half_thickness or not np.isfinite(body.half_thickness)


@any_body
def test_not_a_number_stays_so(body: Obstacle) -> None:
    assert np.isnan(body.sample(np.array([[0.0, np.nan, 0.0]])).distance).all()
    assert [len(part) for part in body.sample(np.zeros((0, 3)))] == [0, 0, 0]


@any_body
def test_bodies_travel_between_processes(body: Obstacle) -> None:
    assert pickle.loads(pickle.dumps(body)) == body


@pytest.mark.parametrize(
    ("make", "printed"),
    [
        (lambda: HalfSpace((0, 0, 0), (0, 0, 0)), r"half space: normal: got \(0, 0, 0\), want a direction"),
        (lambda: Sphere((0, 0, 0), 0.0), "sphere: radius: got 0.0, want a length above 0 mm"),
        (lambda: Sphere((0, 0, 0), np.nan), "sphere: radius: got nan, want a length above 0 mm"),
        (lambda: Capsule(START, END, -1.0), "capsule: radius: got -1.0"),
        (lambda: Capsule(START, START, 1.0), "capsule: end: got .*, want a point other than the start"),
        (lambda: Cylinder(START, END, np.inf), "cylinder: radius: got inf"),
        (lambda: Cylinder(START, START, 1.0), "cylinder: end: got .*, want a point other than the start"),
        (lambda: Box(START, (1.0, 0.0, 1.0), 0.0), "box: size: got 0.0"),
        (lambda: Box(START, (1.0, 2.0, 1.0), 0.6), "box: rounding: got 0.6, want from 0 to half of the shortest edge"),
        (lambda: Box(START, (1.0, 2.0, 1.0), np.nan), "box: rounding: got nan"),
    ],
)
def test_what_is_no_body(make, printed: str) -> None:
    with pytest.raises(InputError, match=printed):
        make()
