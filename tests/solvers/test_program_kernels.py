"""The report's own program, kernel by kernel: edges, volume, folds and voxels by hand."""

import math
from dataclasses import replace

import numpy as np
import pytest

from fem_reference.foundations.mesh import enclosed_volume
from fem_reference.solvers import pbd_program
from fem_reference.solvers.pbd_kernels import dihedral
from fem_reference.solvers.program_kernels import (
    add_dot,
    are_inside,
    flood,
    march_out,
    mark,
    project_folds,
    project_volume,
    six_volumes,
)
from tests.solvers.test_pbd_program import SETTINGS, TETRAHEDRON, attached_setup, ball

pytestmark = pytest.mark.slow


def test_a_step_takes_a_sixth_of_the_error_in_volume():
    # To first order: grown by e the ball has a relative error of 3 e, and what is of second order is below 10 e of it.
    surface, grown = ball(), 1e-6
    rest = pbd_program.constraints_of(attached_setup(None, None), SETTINGS)
    points = (1 + grown) * surface.points
    volumes = [enclosed_volume(surface.points, surface.triangles), enclosed_volume(points, surface.triangles)]
    pbd_program.project(points, replace(rest, share=0 * rest.share), 0.0)
    left = (enclosed_volume(points, surface.triangles) - volumes[0]) / (volumes[1] - volumes[0])
    assert left == pytest.approx(5 / 6, rel=10 * grown)


def test_the_order_in_which_the_program_adds_up():
    # Half the last digit of 1 is lost beside it, and two halves are not: first the last product comes to the total.
    a, b = 2.0**-26, 2.0**-27
    assert add_dot(1.0, (a, a, a), (b, b, b)) == 1 + 2**-52
    assert add_dot(1.0, (a, 0.0, a), (b, b, b)) == 1


def test_six_volumes_and_their_gradient():
    # Value: the mesh's own. Gradient: the volume is cubic in the points, so central differences of step 1e-3 are off by 1e-6.
    surface = ball()
    points, triangles = np.array(surface.points), np.array(surface.triangles)
    value, gradient = six_volumes(points, triangles)
    assert value == pytest.approx(6 * enclosed_volume(points, triangles), rel=1e-12)
    direction = np.random.default_rng(2).normal(size=points.shape)
    up, down = (six_volumes(points + step * direction, triangles)[0] for step in (1e-3, -1e-3))
    assert (gradient * direction).sum() == pytest.approx((up - down) / 2e-3, rel=1e-5)


def test_points_without_volume_stay():
    points = np.zeros((4, 3))
    project_volume(points, TETRAHEDRON, 1.0)
    assert not points.any()


def hinge(angle, size=2.0):
    """Two triangles at a common edge, opened by ``angle``."""
    return size * np.array([[0, 0, 0], [0, 0, 1], [1, 0, 0.4], [math.cos(angle), math.sin(angle), 0.7]])


def folded(angle, rest, size=2.0):
    """By how much a hinge is moved that has ``rest`` for its angle, (4, 3)."""
    points = hinge(angle, size)
    project_folds(points, np.array([[0, 1, 2, 3]]), np.array([rest]), 0.9)
    return points - hinge(angle, size)


def test_a_fold_that_is_too_sharp_is_opened():
    # Mueller 2007 (4) with q = -d cos / dp, here by central differences of step 1e-5: good to 1e-9.
    angle, rest, step = 1.2, 1.6, 1e-5
    gradients = np.zeros((4, 3))
    for corner, axis in np.ndindex(4, 3):
        for sign in (1, -1):
            points = hinge(angle)
            points[corner, axis] += sign * step
            gradients[corner, axis] -= sign * math.cos(dihedral(*map(tuple, points))[0]) / (2 * step)
    ratio = 0.9 * math.sin(angle) * (rest - angle) / (gradients**2).sum()
    assert 0.1 < ratio < 10
    np.testing.assert_allclose(folded(angle, rest), ratio * gradients, atol=1e-8)


@pytest.mark.parametrize(
    ("angle", "rest", "size"),
    [
        (1.6, 1.2, 2.0),  # less sharp than at rest
        (1.2, 1.21, 2.0),  # a ratio of 0.03
        (1.2, 1.6, 100.0),  # a ratio of 2500
        (1e-6, 1.2, 2.0),  # folded shut
    ],
)
def test_other_folds_are_left(angle, rest, size):
    assert not folded(angle, rest, size).any()


def test_voxels_that_a_triangle_marks_by_hand():
    # In the plane y = 1/2, half a voxel from corners at 0 and 1; beyond its long side by at most (3^(1/2) + 0.001) 2^(1/2) = 2.45.
    points = np.array([[0, 0.5, 0], [60, 0.5, 0], [0, 0.5, 60]])
    border = np.zeros((64, 64, 64), bool)
    mark(border, points, points, np.array([[0, 1, 2]]))
    x, y, z = np.indices(border.shape)
    np.testing.assert_array_equal(border, (x + z <= 62) & (y <= 1) & (x <= 60) & (z <= 60))


def test_the_flood_does_not_lead_back():
    # From the corner both paths within x = 0 are barred. By x = 1 it gets everywhere but to x = 0.
    border = np.zeros((3, 3, 3), bool)
    border[0, 0, 1] = border[0, 1, 0] = True
    expected = np.ones((3, 3, 3), bool)
    expected[0] = False
    expected[0, 0, 0] = True
    np.testing.assert_array_equal(flood(border), expected)


def test_marching_out_by_hand():
    goals = np.array([[2, 2.5, 2], [0.5, 2.25, 2]])
    directions = np.array([[0, -5.5, 0], [6.5, 0, 0]])
    reached, too_far = march_out(np.ones((4, 4, 4), bool), goals, directions)
    np.testing.assert_allclose(reached, [[2, -0.5, 2], [4.5, 2.25, 2]], atol=1e-12)
    assert not too_far.any()


def test_marching_past_the_start_is_too_far():
    # The only voxels outside have x = y = 2. Both steps of 1 from the goal, past the start at 0.71, come to be beside them.
    inside = np.ones((4, 4, 4), bool)
    inside[2, 2] = False
    start, goal = np.array([[2.05, 2.05, 1.0]]), np.array([[2.55, 1.55, 1.0]])
    assert not are_inside(inside, start)[0]
    assert march_out(inside, goal, start - goal)[1].tolist() == [True]
