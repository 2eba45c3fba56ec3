"""The extension inward: exact for affine motion wherever the point lies, and equal to the integral that defines it.

On the surface it is interpolation, in a convex body its weights are positive.
"""

import numpy as np
import pytest
import shapes
from numpy.testing import assert_allclose, assert_array_equal

from fem_reference.foundations.mesh import TET_FACES, Surface, check_closed
from fem_reference.geometry.extension import Extension

OCTAHEDRON = Surface(
    np.array([[1.0, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1], [0, 0, -1]]),
    np.array([[0, 2, 4], [2, 1, 4], [1, 3, 4], [3, 0, 4], [2, 0, 5], [1, 2, 5], [3, 1, 5], [0, 3, 5]]),
)


def _directions(count: int) -> np.ndarray:
    """Unit vectors spread evenly over the sphere along a golden spiral, (count, 3)."""
    height = 1 - (2 * np.arange(count) + 1) / count
    angle = np.pi * (3 - np.sqrt(5)) * np.arange(count)
    across = np.sqrt(1 - height**2)
    return np.stack([across * np.cos(angle), across * np.sin(angle), height], axis=1)


def _bumpy() -> Surface:
    """A body with hollows, about 80 mm across, where the hip's coordinates are."""
    sphere = shapes.sphere(3)
    radius = 40 * (1 + 0.35 * np.sin(3 * sphere.points[:, 0]) * np.cos(4 * sphere.points[:, 1]))
    return check_closed(sphere.moved_to(sphere.points * radius[:, None] + (146, 238, -431)))


def _affine(points: np.ndarray) -> np.ndarray:
    slope = np.array([[1.2, -0.3, 0.1], [0.4, 0.8, -0.2], [0.0, 0.5, 1.1]])
    return points @ slope.T + (3, -2, 1)


def _inward(surface: Surface, points: np.ndarray, depth: float) -> np.ndarray:
    centre = surface.points.mean(axis=0)
    return points + depth * (centre - points) / np.linalg.norm(centre - points, axis=1)[:, None]


@pytest.mark.parametrize("depth", [0, 1e-7, 1e-5, 1e-3, 0.1, 1, 10, -0.01, -1])
@pytest.mark.parametrize("corners", [1, 2, 3])
def test_affine_motion_is_exact_near_vertices_edges_and_faces(corners: int, depth: float) -> None:
    surface = _bumpy()
    points = _inward(surface, surface.points[surface.triangles[::40, :corners]].mean(axis=1), depth)
    extension = Extension.to(points, surface)
    # 1e-11 of coordinates near 600 mm, which themselves give a depth of 1e-7 mm to 1e-6 only.
    assert_allclose(extension.apply(_affine(surface.points)), _affine(points), rtol=0, atol=6e-9)
    assert_allclose(extension.weights.sum(axis=1), 1, rtol=0, atol=1e-13)


def test_affine_motion_is_exact_in_the_planes_of_triangles() -> None:
    """Along an edge's line and in a triangle's plane beyond it the formula has zeros in its denominators."""
    cube = np.array([[x, y, z] for x in (0.0, 1) for y in (0.0, 1) for z in (0.0, 1)])
    lower = np.array([[0, 2, 1], [1, 2, 3], [4, 5, 6], [5, 7, 6], [0, 1, 4], [1, 5, 4], [2, 6, 3], [3, 6, 7]])
    sides = np.array([[0, 4, 2], [2, 4, 6], [1, 3, 5], [3, 7, 5]])
    box = check_closed(Surface(cube, np.concatenate([lower, sides])))
    beside = np.array([[1.2, 0.3, 0.0], [1.5, 0.0, 0.0], [0.5, -0.2, 1.0], [-0.1, 1.0, 1.0]])
    for surface, points in ((box, beside), (OCTAHEDRON, np.array([[0.3, 0.2, 0.0], [0.0, 0.0, 0.0], [0.0, 0.0, 0.4]]))):
        found = Extension.to(points, surface).apply(_affine(surface.points))
        assert_allclose(found, _affine(points), rtol=0, atol=1e-12)


def test_on_the_surface_it_is_interpolation_in_the_triangle() -> None:
    surface = _bumpy()
    corners = surface.triangles[[7, 70, 170]]
    shares = np.array([[1, 0, 0], [0.5, 0.5, 0], [0.2, 0.3, 0.5]])
    points = np.einsum("ij,ijk->ik", shares, surface.points[corners])
    wanted = np.zeros((3, len(surface.points)))
    wanted[np.arange(3)[:, None], corners] = shares
    assert_allclose(Extension.to(points, surface).weights, wanted, rtol=0, atol=1e-12)
    # Continuous: they change by the depth over the size of a triangle (about 5 mm), times a few.
    near = Extension.to(_inward(surface, points, 1e-4), surface).weights
    assert_allclose(near, wanted, rtol=0, atol=1e-3)


def test_symmetry_shares_equally() -> None:
    centre = np.zeros((1, 3))
    assert_allclose(Extension.to(centre, OCTAHEDRON).weights, 1 / 6, rtol=1e-13)
    tet = Surface(np.array([[1.0, 1, 1], [-1, -1, 1], [-1, 1, -1], [1, -1, -1]]), TET_FACES[:, ::-1])
    assert_allclose(Extension.to(centre, tet).weights, 1 / 4, rtol=1e-13)


def test_weights_are_positive_in_a_convex_body() -> None:
    points = np.random.default_rng(4).dirichlet(np.ones(6), 50) @ OCTAHEDRON.points
    assert Extension.to(points, OCTAHEDRON).weights.min() > 0


def test_it_is_the_mean_over_all_directions() -> None:
    """Independent: the mean of a surface value over all directions, weighted by one over the distance in each.

    The value is |x| on the octahedron (1 at two corners, 0 at four), the quadrature takes 200 000 rays; one from p
    along v ends at the t with |p + t v|_1 = 1.
    """
    point, rays = np.array([0.25, 0.1, -0.3]), _directions(200_000)
    signs = np.array([[a, b, c] for a in (1, -1) for b in (1, -1) for c in (1, -1)])
    speed = rays @ signs.T
    times = np.where(speed > 0, (1 - point @ signs.T) / np.where(speed > 0, speed, 1), np.inf).min(axis=1)
    values = np.abs(point + times[:, None] * rays)[:, 0]
    wanted = (values / times).sum() / (1 / times).sum()
    found = Extension.to(point[None], OCTAHEDRON).weights[0] @ np.abs(OCTAHEDRON.points[:, 0])
    assert_allclose(found, wanted, rtol=1e-4)  # twice as many rays change the quadrature by less than 1e-5


def test_it_does_not_depend_on_place_or_orientation_of_the_triangles() -> None:
    surface = _bumpy()
    points = _inward(surface, surface.points[::40], 12.0)
    flipped = Surface(surface.points, surface.triangles[:, ::-1])
    moved = Surface(surface.points - (146, 238, -431), surface.triangles)
    weights = Extension.to(points, surface).weights
    assert_allclose(Extension.to(points, flipped).weights, weights, rtol=0, atol=1e-13)
    assert_allclose(Extension.to(points - (146, 238, -431), moved).weights, weights, rtol=0, atol=1e-11)


def test_it_is_fixed_and_acts_on_displacement() -> None:
    surface = _bumpy()
    points = _inward(surface, surface.points[::80], 5.0)
    extension = Extension.to(points, surface)
    assert not extension.weights.flags.writeable
    assert_array_equal(extension.apply(surface.points), points)
    assert len(Extension.to(np.zeros((0, 3)), surface).apply(surface.points)) == 0
