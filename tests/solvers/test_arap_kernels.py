"""Rotations, right side and energy of ARAP against singular values and slopes."""

import itertools

import numpy as np
import pytest
import shapes

from fem_reference.foundations.motion import apply
from fem_reference.solvers import arap
from tests.solvers.test_arap import TURN, WEIGHTS, by_singular_values, muscle


@pytest.mark.parametrize("weights", WEIGHTS)
def test_rotations_are_those_of_singular_values(weights):
    # Noise as wide as a cell turns some inside out: there singular values alone give a reflection.
    surface = muscle(noise=1.0)
    cells = arap.cells_of(surface, weights)
    points = apply(TURN, surface.points) + np.random.default_rng(1).normal(scale=6.0, size=surface.points.shape)
    found = arap.fit_rotations(points, cells)
    np.testing.assert_allclose(found, by_singular_values(surface.points, points, cells), atol=1e-10)
    np.testing.assert_allclose(np.linalg.det(found), 1, rtol=1e-13)


def test_a_mirrored_body_is_fitted_by_rotations():
    surface = muscle()
    found = arap.fit_rotations(surface.points * [1, 1, -1], arap.cells_of(surface, "cotangent"))
    np.testing.assert_allclose(np.linalg.det(found), 1, rtol=1e-13)


def test_cells_in_a_plane_and_without_size_have_a_rotation():
    # The corners of a cube are attached by three faces, its other vertices lie in a plane: least singular value 0.
    surface = shapes.skin(shapes.box((3, 3, 3), (3, 3, 3)))
    cells = arap.cells_of(surface, "kirchhoff")
    found = arap.fit_rotations(apply(TURN, surface.points), cells)
    np.testing.assert_allclose(found, np.broadcast_to(TURN[:3, :3], found.shape), atol=1e-12)
    nothing = arap.fit_rotations(np.zeros(surface.points.shape), cells)
    np.testing.assert_array_equal(nothing, np.broadcast_to(np.eye(3), nothing.shape))


@pytest.mark.parametrize("weights", ["cotangent", "kirchhoff"])
def test_the_equations_are_the_slope_of_the_energy(weights):
    # Quadratic in positions: central differences of step 1 mm have no error but rounding, of energies of about 1e4.
    surface, random = muscle(noise=1.0), np.random.default_rng(2)
    cells = arap.cells_of(surface, weights)
    points = surface.points + random.normal(size=surface.points.shape)
    rotations = arap.fit_rotations(points, cells)
    slope = 4 * (arap.laplacian(cells) @ points - arap.right_side(rotations, cells))
    for i, axis in zip(random.integers(0, len(points), 20), itertools.cycle(range(3)), strict=False):
        step = np.zeros(points.shape)
        step[i, axis] = 1
        difference = (arap.energy(points + step, rotations, cells) - arap.energy(points - step, rotations, cells)) / 2
        assert difference == pytest.approx(slope[i, axis], abs=1e-9)
