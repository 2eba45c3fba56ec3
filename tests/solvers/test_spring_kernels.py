"""Masses on springs against closed forms, and what they conserve."""

import math

import numpy as np
import pytest
from numpy.testing import assert_allclose

from fem_reference.solvers import mass_spring
from fem_reference.solvers.spring_kernels import Network, PrescribedPath, advance, forces
from tests.solvers.test_mass_spring import FREE, MASS, STIFFNESS, network, on_a_line, tangle


def still(points: np.ndarray, *fixed: int) -> PrescribedPath:
    return PrescribedPath(np.array(fixed), points[list(fixed)], points[list(fixed)])


def vibrated(time_step: float, duration: float) -> float:
    """The extension, from 1 mm, of two masses on one spring; a step before the first it was what it was by the closed form."""
    rate = math.sqrt(2 * STIFFNESS / MASS)
    points, previous = (on_a_line(-half, half) for half in (5.5, 5 + math.cos(rate * time_step) / 2))
    advance(points, previous, network([0, 1], [10], 2), FREE, time_step, round(duration / time_step))
    return points[1, 2] - points[0, 2] - 10


def test_two_masses_on_a_spring_oscillate_with_the_closed_form_frequency() -> None:
    # e(t) = cos(w t) with w^2 = 2 k / m; position Verlet is of second order, so that half the step has a quarter of the error.
    rate = math.sqrt(2 * STIFFNESS / MASS)
    duration = 1.3 * 2 * math.pi / rate
    errors = [vibrated(duration / steps, duration) - math.cos(rate * duration) for steps in (200, 400, 800)]
    assert abs(errors[-1]) < 1e-4
    orders = np.log2(np.divide(errors[:-1], errors[1:]))
    assert_allclose(orders, 2, atol=0.02)


@pytest.mark.parametrize("share", [0.2, 1.0, 3.0])
def test_a_damped_mass_comes_to_rest_as_the_closed_form_says(share) -> None:
    """Of m x'' + c x' + k x = 0 with c = share 2 sqrt(m k): below, at and above the critical damping."""
    rate = math.sqrt(STIFFNESS / MASS)
    duration, decay = 4 / rate, share * rate
    root = np.emath.sqrt(decay**2 - rate**2)

    def exact(t: float) -> float:
        slope = t if root == 0 else complex(np.sinh(root * t) / root)
        return complex(math.exp(-decay * t) * (np.cosh(root * t) + decay * slope)).real

    errors = []
    for steps in (2000, 4000):
        time_step = duration / steps
        points = on_a_line(0, 11)
        previous = on_a_line(0, 10 + exact(-time_step))
        springs = network([0, 1], [10], 2, 2 * share * math.sqrt(MASS * STIFFNESS))
        advance(points, previous, springs, still(points, 0), time_step, steps)
        errors.append(points[1, 2] - 10 - exact(duration))
    # The velocity of eq. 5.7 is that of half a step before: an error of first order.
    assert abs(errors[-1]) < 2e-3
    assert_allclose(errors[0] / errors[1], 2, atol=0.05)


def energy(points: np.ndarray, previous: np.ndarray, springs: Network, time_step: float) -> float:
    """Kinetic and elastic energy [mJ] between two steps."""
    middle = (points + previous) / 2
    lengths = np.linalg.norm(middle[springs.springs[:, 1]] - middle[springs.springs[:, 0]], axis=1)
    kinetic = MASS / 2 * np.sum((points - previous) ** 2) / time_step**2
    return float(kinetic + STIFFNESS / 2 * np.sum((lengths - springs.lengths) ** 2))


@pytest.mark.parametrize("damping", [0.0, 1e-4])
def test_energy_is_kept_without_damping_and_lost_with_it(damping) -> None:
    points, springs = tangle(1, damping)
    previous, time_step = points.copy(), 0.02 * mass_spring.stable_time_step(springs, FREE.fixed)
    energies = []
    for _ in range(200):
        advance(points, previous, springs, FREE, time_step, 20)
        energies.append(energy(points, previous, springs, time_step))
    if damping:
        assert (np.diff(energies) < 0).all()
        assert energies[-1] < 0.5 * energies[0]
    else:  # of second order: a fiftieth of the stable step leaves some 1e-3
        assert_allclose(energies, energies[0], rtol=3e-3)


def test_momentum_and_angular_momentum_are_kept() -> None:
    points, springs = tangle(2)
    previous = points - np.random.default_rng(3).normal(0, 1e-3, points.shape)
    momentum, turn = np.sum(points - previous, axis=0), np.sum(np.cross(previous, points), axis=0)
    advance(points, previous, springs, FREE, 0.5 * mass_spring.stable_time_step(springs, FREE.fixed), 1000)
    # Springs pull both ends alike and along themselves: only rounding of 1000 steps of numbers near 10 is left.
    assert_allclose(np.sum(points - previous, axis=0), momentum, atol=1e-10)
    assert_allclose(np.sum(np.cross(previous, points), axis=0), turn, atol=1e-9)


def test_forces_are_the_slope_of_the_energy() -> None:
    points, springs = tangle(4)
    springs = springs._replace(gravity=np.array([0, 100.0, -9810]))

    def stored(flat: np.ndarray) -> float:
        at = flat.reshape(-1, 3)
        lengths = np.linalg.norm(at[springs.springs[:, 1]] - at[springs.springs[:, 0]], axis=1)
        return float(STIFFNESS / 2 * np.sum((lengths - springs.lengths) ** 2) - MASS * np.sum(at @ springs.gravity))

    steps = 1e-5 * np.eye(points.size)
    slopes = [(stored(points.ravel() + step) - stored(points.ravel() - step)) / 2e-5 for step in steps]
    # Central differences: 1e-10 from the step, 1e-9 from rounding of energies near 100.
    assert_allclose(forces(points, springs), -np.reshape(slopes, (-1, 3)), atol=1e-7)


def settled(points: np.ndarray, springs: Network, *fixed: int) -> np.ndarray:
    points, time_step = points.copy(), 0.5 * mass_spring.stable_time_step(springs, np.array(fixed))
    advance(points, points.copy(), springs, still(points, *fixed), time_step, 20_000)
    return points


def test_a_hanging_chain_is_stretched_by_what_hangs_below() -> None:
    # Spring j of 6 carries the weight of the masses below it.
    springs = network([(j, j + 1) for j in range(6)], [10] * 6, 7, 1e-4, (0, 0, -9810.0))
    points = settled(on_a_line(*(-10.0 * j for j in range(7))), springs, 0)
    carried = MASS * 9810 * np.arange(6, 0, -1)
    assert_allclose(-np.diff(points[:, 2]), 10 + carried / STIFFNESS, rtol=1e-9)


def test_a_chain_between_two_fixed_ends_has_one_tension() -> None:
    lengths = np.array([4.0, 10, 6, 8])
    springs = network([(j, j + 1) for j in range(4)], lengths, 5, 1e-4)
    points = settled(on_a_line(0, 5, 12, 20, 36), springs, 0, 4)
    assert_allclose(np.diff(points[:, 2]), lengths + 2, rtol=1e-9)  # 36 less 28 in four parts


def test_ends_that_coincide_pull_nowhere() -> None:
    assert (forces(np.zeros((2, 3)), network([0, 1], [10], 2)) == 0).all()
