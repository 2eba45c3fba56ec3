"""Each constraint of position based dynamics alone: value, gradient, projection."""

import math
from pathlib import Path

import numba
import numpy as np
import pytest

from fem_reference.foundations.mesh import TET_FACES, Surface
from fem_reference.foundations.motion import RigidMotion, apply
from fem_reference.solvers import pbd_kernels as kernels
from fem_reference.solvers.compiled_kernels import kept_code
from fem_reference.solvers.pbd import PbdConstraints, hinges_of

TET = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]])
TURN = RigidMotion((1, 2, 3), (5, -4, 7), (0.0, 1.0), (0.0, 2.0)).pose(1)


def icosahedron():
    """Vertices (12, 3) with edges of length 2, and outward triangles (20, 3)."""
    golden = (1 + math.sqrt(5)) / 2
    points = np.array([np.roll([0, one, two], k) for k in range(3) for one in (-1, 1) for two in (-golden, golden)])
    apart = np.linalg.norm(points[:, None] - points, axis=2)
    near = np.isclose(apart, 2)
    triples = ((i, j, k) for i in range(12) for j in range(i) for k in range(j))
    triangles = [(i, j, k) for i, j, k in triples if near[i, j] and near[j, k] and near[k, i]]
    outward = [t if np.linalg.det(points[list(t)]) > 0 else t[::-1] for t in triangles]
    return points, np.array(outward)


def bulky():
    """An icosahedron 19 mm wide and 57 mm long, so that no two of its constraints look alike."""
    points, triangles = icosahedron()
    return Surface(points * [5, 5, 15] + [1, 2, 3], triangles)


def slopes(value, points, step):
    """Gradient of ``value`` at ``points`` by central differences."""
    found = np.zeros(points.shape)
    for index in np.ndindex(points.shape):
        there, back = points.copy(), points.copy()
        there[index] += step
        back[index] -= step
        found[index] = (value(there) - value(back)) / (2 * step)
    return found


def rows(points):
    return [tuple(map(float, point)) for point in points]


def folded(angle):
    """Two triangles of different shape about the x axis whose dihedral angle is ``angle``."""
    return np.array([[0, 0, 0], [2, 0, 0], [0.5, 1.5, 0], [1.2, math.cos(angle), math.sin(angle)]])


# Central differences with step h err by h^2/6 times a third derivative and by rounding, 1e-16/h;
# with h = 1e-5 and third derivatives below 50 at these points of size 1 both stay below 1e-9.


def test_gradient_of_distance():
    points = np.random.default_rng(1).normal(size=(2, 3))
    at_first = np.array(kernels.distance(*rows(points))[1])
    expected = slopes(lambda moved: kernels.distance(*rows(moved))[0], points, 1e-5)
    np.testing.assert_allclose([at_first, -at_first], expected, atol=1e-9)


@pytest.mark.parametrize("angle", [0.3, 1.2, 2.0, 3.0, -1.2])
def test_gradient_of_dihedral(angle):
    points = apply(TURN, folded(angle))
    value, *gradients = kernels.dihedral(*rows(points))
    assert value == pytest.approx(abs(angle), abs=1e-14)  # blind to the sign
    expected = slopes(lambda moved: kernels.dihedral(*rows(moved))[0], points, 1e-5)
    np.testing.assert_allclose(gradients, expected, atol=1e-8)  # at 3.0 rounding grows by 1/sin(3.0) = 7


@pytest.mark.parametrize("angle", [1e-7, math.pi - 1e-7])
def test_dihedral_is_exact_near_flat(angle):
    # Normals are rounded by 1e-16; arccos of their product would be off by 1e-16 / 1e-7.
    assert kernels.dihedral(*rows(apply(TURN, folded(angle))))[0] == pytest.approx(angle, abs=1e-14)


def test_gradient_of_volume():
    # The volume is linear in each coordinate, so that a difference over any step is exact but for rounding.
    points, triangles = icosahedron()
    points = points + np.random.default_rng(2).normal(scale=0.2, size=points.shape)
    expected = slopes(lambda moved: kernels.volume(moved, triangles)[0], points, 0.1)
    np.testing.assert_allclose(kernels.volume(points, triangles)[1], expected, atol=1e-12)


def test_values_are_the_closed_forms():
    points, triangles = icosahedron()
    hinges = hinges_of(triangles)
    np.testing.assert_allclose(kernels.distances(points, hinges[:, :2].copy()), 2, rtol=1e-14)
    np.testing.assert_allclose(kernels.dihedrals(points, hinges), math.acos(-math.sqrt(5) / 3), rtol=1e-14)
    inside = 5 / 12 * (3 + math.sqrt(5)) * 2**3
    assert kernels.volume(points, triangles)[0] == pytest.approx(6 * inside, rel=1e-14)


def test_volume_far_from_the_origin():
    # Coordinates of 1e6 are rounded by 1e-10, and the volume with them; about the world's origin it is off by 100.
    assert kernels.volume(TET + 1e6, TET_FACES)[0] == pytest.approx(1, abs=1e-9)


@pytest.mark.parametrize(
    "points",
    [
        folded(math.pi),
        folded(0),
        folded(math.pi - 0.9e-5),
        [[0, 0, 0], [2, 0, 0], [1, 0, 0], [0, 1, 1]],  # no area
    ],
)
def test_flat_pairs_have_no_gradient(points):
    angle, *gradients = kernels.dihedral(*rows(points))
    assert math.isfinite(angle)
    assert not np.any(gradients)


def test_points_that_coincide_have_no_gradient():
    assert kernels.distance((1.0, 2.0, 3.0), (1.0, 2.0, 3.0)) == (0, (0, 0, 0))


def test_one_projection_restores_a_distance():
    points = np.array([[1.0, 2, 3], [4, -1, 5]])
    kernels.project_distances(points, np.array([1.0, 0.25]), np.array([[0, 1]]), np.array([2.0]), np.ones(1))
    assert np.linalg.norm(points[1] - points[0]) == pytest.approx(2, rel=1e-15)


def test_one_projection_of_volume_is_a_newton_step():
    # On an icosahedron the gradient is radial, so that its size s goes as Newton's method for s^3 = 1 does.
    points, triangles = icosahedron()
    size = 1.3
    moved = points * size
    kernels.project_volume(moved, np.ones(12), triangles, kernels.volume(points, triangles)[0], 1.0)
    np.testing.assert_allclose(moved, points * (size - (size**3 - 1) / (3 * size**2)), rtol=1e-13, atol=1e-13)


@pytest.mark.parametrize("name", ["volume", "dihedral"])
def test_one_projection_removes_the_error_to_first_order(name):
    # What remains is of second order: it falls to a quarter as the error is halved (to 0.05 with errors of 1 %).
    remains = [abs(_error_left(name, error)) for error in (0.02, 0.01)]
    assert remains[0] / remains[1] == pytest.approx(4, abs=0.2)
    assert remains[0] < 0.02 * 0.05


def _error_left(name, error):
    masses = np.array([1.0, 2.0, 0.5, 0.7])
    if name == "volume":
        points = TET.copy()
        kernels.project_volume(points, masses, TET_FACES, 1 + error, 1.0)
        return kernels.volume(points, TET_FACES)[0] - 1 - error
    points, hinges = folded(2.0), np.array([[0, 1, 2, 3]])
    kernels.project_dihedrals(points, masses, hinges, np.array([2.0 + error]), 1.0)
    return kernels.dihedrals(points, hinges)[0] - 2.0 - error


@pytest.mark.parametrize(("angle", "rest"), [(0.1, 3.0), (3.0, 0.1)])
def test_one_projection_turns_a_pair_no_further_than_it_may(angle, rest):
    # The displacement along the gradient, sum g . dp, is the change of the angle to first order.
    before, hinges = folded(angle), np.array([[0, 1, 2, 3]])
    after = before.copy()
    kernels.project_dihedrals(after, np.ones(4), hinges, np.array([rest]), 1.0)
    gradients = np.array(kernels.dihedral(*rows(before))[1:])
    turned = np.sum(gradients * (after - before))
    assert turned == pytest.approx(math.copysign(kernels.LARGEST_TURN, rest - angle), rel=1e-12)


def projections(surface):
    """The three projections of a surface that changed its shape, each a function of points and inverse masses."""
    rest = PbdConstraints.at_rest(surface.points, surface.triangles, [])
    return {
        "distance": lambda points, masses: kernels.project_distances(
            points, masses, rest.edges, rest.lengths, 0.8 * rest.share
        ),
        "volume": lambda points, masses: kernels.project_volume(points, masses, rest.triangles, rest.six_volumes, 0.8),
        "dihedral": lambda points, masses: kernels.project_dihedrals(points, masses, rest.hinges, rest.angles, 0.8),
    }


@pytest.mark.parametrize("name", ["distance", "volume", "dihedral"])
def test_projections_conserve_momentum(name):
    # The gradients of a constraint sum to zero because it feels no translation; 1e-11 is a thousand roundings of 30 mm.
    surface = bulky()
    generator = np.random.default_rng(3)
    before = surface.points + generator.normal(scale=0.3, size=surface.points.shape)
    inverse_masses = generator.uniform(0.5, 2, len(before))
    after = before.copy()
    projections(surface)[name](after, inverse_masses)
    momentum = (after - before) / inverse_masses[:, None]
    assert np.abs(momentum).max() > 1e-3
    np.testing.assert_allclose(momentum.sum(axis=0), 0, atol=1e-11)


def test_values_feel_no_rigid_motion():
    # A few roundings of coordinates of 30 mm, relative to values of 3 mm, 0.1 rad from flat and 1e4 mm3.
    surface = bulky()
    here = surface.points * [1.1, 0.9, 1.2]
    there = apply(TURN, here)
    hinges = hinges_of(surface.triangles)
    edges, triangles = hinges[:, :2].copy(), np.array(surface.triangles)
    np.testing.assert_allclose(kernels.distances(there, edges), kernels.distances(here, edges), rtol=1e-13)
    np.testing.assert_allclose(kernels.dihedrals(there, hinges), kernels.dihedrals(here, hinges), rtol=1e-12)
    assert kernels.volume(there, triangles)[0] == pytest.approx(kernels.volume(here, triangles)[0], rel=1e-13)


@pytest.mark.parametrize("name", ["distance", "volume", "dihedral"])
def test_attached_points_are_not_moved(name):
    surface = bulky()
    points = surface.points * [1.1, 0.9, 1.2]
    inverse_masses = np.ones(len(points))
    inverse_masses[:5] = 0
    before = points.copy()
    projections(surface)[name](points, inverse_masses)
    np.testing.assert_array_equal(points[:5], before[:5])
    assert np.abs(points[5:] - before[5:]).max() > 1e-3
    projections(surface)[name](before, np.zeros(len(points)))
    np.testing.assert_array_equal(before, surface.points * [1.1, 0.9, 1.2])


@pytest.mark.parametrize("name", ["distance", "volume", "dihedral"])
def test_rigid_motion_costs_nothing(name):
    # 1e-12 mm is a few hundred roundings of coordinates of 30 mm.
    surface = bulky()
    turned = apply(TURN, surface.points)
    after = turned.copy()
    projections(surface)[name](after, np.ones(len(after)))
    np.testing.assert_allclose(after, turned, atol=1e-12)


def test_machine_code_is_kept_by_what_all_loops_are_and_numba_is_left_as_it_was() -> None:
    assert Path(kernels.distance.machine_code.stats.cache_path).parent == kept_code()
    assert not numba.config.CACHE_DIR


def test_a_segment_ends_at_both_ends() -> None:
    """Beyond an end the distance is that from the end, however near the line passes."""
    starts, ends = np.array([[0.0, 0, 0], [4.0, 3, 0]]), np.array([[2.0, 0, 0], [6.0, 3, 0]])
    points = np.array([[5.0, 0.5, 0], [-3.0, 0.5, 0], [1.0, 0.5, 0]])
    assert kernels.to_segment((5.0, 0.5, 0.0), (0.0, 0.0, 0.0), (2.0, 0.0, 0.0)) == pytest.approx(np.hypot(3, 0.5))
    assert kernels.to_segment((-3.0, 0.5, 0.0), (0.0, 0.0, 0.0), (2.0, 0.0, 0.0)) == pytest.approx(np.hypot(3, 0.5))
    assert kernels.nearest_segments(points, starts, ends, 1e-9).tolist() == [1, 0, 0]
