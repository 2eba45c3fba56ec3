"""Integrals over tetrahedra with quadratic displacements: those of the polynomials themselves, by Gauss' rule on the cube."""

import numpy as np
import pytest
import shapes
from numpy.testing import assert_allclose

from fem_reference.foundations.mesh import boundary
from fem_reference.geometry.quadratic import EDGES, Displaced, quadratic
from fem_reference.problems.body import reference_nodes

SIZE = (2.0, 3.0, 4.0)
MESH = shapes.box((2, 1, 2), SIZE)
SIDES = {"x0": (0, 0.0), "x1": (0, 2.0), "y0": (1, 0.0), "y1": (1, 3.0), "z0": (2, 0.0), "z1": (2, 4.0)}


def moved(X: np.ndarray) -> np.ndarray:
    x, y, z = np.moveaxis(X, -1, 0)
    return X + np.stack([0.1 * y**2 + 0.05 * z * x, 0.07 * z**2 - 0.1 * x, 0.3 + 0.08 * x * y], axis=-1)


def speed(X: np.ndarray) -> np.ndarray:
    x, y, z = np.moveaxis(X, -1, 0)
    return np.stack([x * y, 1 + z, x - y * z], axis=-1)


def meshed() -> Displaced:
    outer = boundary(MESH.tets)[0]
    on = {name: outer[(MESH.points[outer][..., axis] == at).all(axis=1)] for name, (axis, at) in SIDES.items()}
    on = {name: np.roll(facets[:, ::-1], 1, axis=0) for name, facets in on.items()}  # in any order, facing anywhere
    corners = MESH.points[MESH.tets]
    rest = np.concatenate([corners, corners[:, EDGES].mean(axis=2)], axis=1)
    mesh = type(MESH)(MESH.points, MESH.tets, on | {"all": outer})
    return Displaced(mesh, moved(rest) - rest, speed(rest))


def gauss(*lengths: float) -> tuple[np.ndarray, np.ndarray]:
    """Points (q, d) and weights (q,) on a box with a corner at 0, exact to degree 11 along each axis."""
    ticks, shares = np.polynomial.legendre.leggauss(6)
    grid = np.meshgrid(*((1 + ticks) / 2 * one for one in lengths), indexing="ij")
    weights = np.meshgrid(*(shares / 2 * one for one in lengths), indexing="ij")
    return np.stack([one.ravel() for one in grid], axis=1), np.prod([one.ravel() for one in weights], axis=0)


def test_the_middles_are_those_of_the_nodes_of_cells() -> None:
    nodes = reference_nodes("tetrahedron", 2)
    assert_allclose(nodes[4:], nodes[EDGES].mean(axis=1))


def test_integrals_over_the_volume() -> None:
    points, weights = gauss(*SIZE)
    now, velocity = moved(points), speed(points)
    volume, first = meshed().measure()
    assert_allclose(volume, 24, rtol=1e-14)
    assert_allclose(first, weights @ now, rtol=1e-13)
    momentum, spin = meshed().motion()
    assert_allclose(momentum, weights @ velocity, rtol=1e-13)
    assert_allclose(spin, weights @ np.cross(now, velocity), rtol=1e-12)


@pytest.mark.parametrize("side", SIDES)
def test_integrals_over_a_side(side) -> None:
    axis, at = SIDES[side]
    b, c = (axis + 1) % 3, (axis + 2) % 3
    flat, weights = gauss(SIZE[b], SIZE[c])
    points = np.zeros((len(flat), 3))
    points[:, axis], points[:, b], points[:, c] = at, flat[:, 0], flat[:, 1]
    step = 0.5  # central differences are exact for quadratic functions
    along, across = ((moved(points + step * one) - moved(points - step * one)) for one in (np.eye(3)[b], np.eye(3)[c]))
    areas = weights[:, None] * np.cross(along, across) * (1 if at else -1)
    area, first = meshed().measure(side)
    assert_allclose(area, weights.sum(), rtol=1e-14)
    assert_allclose(first, weights @ moved(points), rtol=1e-13)
    facing, moment = meshed().facing(side)
    assert_allclose(facing, areas.sum(axis=0), atol=1e-12)
    assert_allclose(moment, np.cross(moved(points), areas).sum(axis=0), atol=1e-11)


def test_a_closed_surface_has_neither_vector_area_nor_moment() -> None:
    assert_allclose(meshed().facing("all"), np.zeros((2, 3)), atol=1e-11)


def test_what_is_unknown_says_so() -> None:
    still = Displaced(meshed().mesh)
    assert still.facing("x0") is None
    assert still.motion() is None
    assert still.measure("x0")[0] == pytest.approx(12)
    assert np.isnan(still.measure()[1]).all()


def test_linear_displacements_are_quadratic_ones_too() -> None:
    matrix = np.array([[0.1, 0.2, 0], [0, -0.1, 0.3], [0.2, 0, 0]])
    given = meshed()
    rest = given.nodes - given.by
    assert_allclose(quadratic((rest @ matrix)[:, :4]), rest @ matrix, atol=1e-14)
    assert quadratic(given.by) is given.by
