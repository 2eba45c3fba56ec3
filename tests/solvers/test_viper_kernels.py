"""Quaternions against scipy, slopes against finite differences, and the volume of a cone."""

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.spatial.transform import Rotation

from fem_reference.solvers import viper_kernels as kernels

RANDOM = np.random.default_rng(5)
REST = np.cumsum(RANDOM.normal([0, 0, 3.0], 0.5, (2, 6, 3)), axis=1)
STEPS = np.diff(REST, axis=1)
STILL = np.tile([1.0, 0.0, 0.0, 0.0], (2, 7, 1))


def test_quaternions_are_those_of_scipy() -> None:
    one, other = (Rotation.random(7, rng=RANDOM) for _ in range(2))
    p, q, v = one.as_quat(scalar_first=True), other.as_quat(scalar_first=True), RANDOM.normal(size=(7, 3))
    both = Rotation.from_quat(kernels.product(p, q), scalar_first=True)
    assert_allclose(both.as_matrix(), (one * other).as_matrix(), atol=1e-12)
    assert_allclose(kernels.turned(p, v), one.apply(v), atol=1e-12)
    assert_allclose(kernels.matrices(p), one.as_matrix(), atol=1e-12)
    assert_allclose(kernels.product(p, kernels.conjugate(p)), np.tile([1.0, 0, 0, 0], (7, 1)), atol=1e-12)


def test_a_cone_has_its_volume() -> None:
    found = kernels.volumes(np.array([[[0, 0, 0], [0, 0, 3.0]]]), np.array([[1.0, 2.0]]))
    assert found == pytest.approx(7 * np.pi)


def disturbed() -> tuple[np.ndarray, np.ndarray]:
    points = REST + RANDOM.normal(0, 0.1, REST.shape)
    return points, kernels.unit(STILL + RANDOM.normal(0, 0.1, STILL.shape))


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_rest_stays_at_rest_whatever_the_sign_of_quaternions(sign: float) -> None:
    points, turns, radii = REST.copy(), STILL * sign, np.full((2, 6), 2.0)
    turns[:, 2] *= -1
    before = turns.copy()
    kernels.project_stretch(points, turns, STEPS, 1.0)
    kernels.project_bend(turns, 1.0)
    kernels.project_volume(points, radii, kernels.volumes(REST, radii), 1.0)
    assert_allclose(points, REST, atol=1e-12)
    assert_allclose(turns, before, atol=1e-12)
    assert_allclose(radii, 2.0, rtol=1e-12)


def test_a_step_of_stretch_is_along_the_slope_of_its_squares() -> None:
    """Steps of a small stiffness k change half the sum of squares by - k / 8 |slope|^2, slopes by finite differences."""
    points, turns = disturbed()
    lengths = np.linalg.norm(STEPS, axis=2, keepdims=True)

    def error(points: np.ndarray, turns: np.ndarray) -> float:
        return 0.5 * float(
            ((np.diff(points, axis=1) / lengths - kernels.turned(turns[:, 1:-1], STEPS / lengths)) ** 2).sum()
        )

    moved, turned = points.copy(), turns.copy()
    kernels.project_stretch(moved, turned, STEPS, 1e-3)
    bent = kernels.turned(turns[:, 1:-1], STEPS / lengths)
    assert error(moved, turned) < error(points, turns)
    # A segment's force on its end is C / l, times its mass of l^2: on the points, the step is that of the errors themselves.
    step = 1e-3 / 8 * (bent * lengths - np.diff(points, axis=1))
    assert_allclose((moved - points)[:, 1:-1], -np.diff(step, axis=1), atol=1e-12)
    # A frame turns towards its segment: by four times the part of the error across it, as 2 |dq| = angle.
    now = kernels.turned(turned[:, 1:-1], STEPS / lengths)
    across = np.diff(points, axis=1) / lengths - bent
    across -= np.sum(across * bent, axis=2, keepdims=True) * bent
    assert_allclose(now - bent, 4e-3 / 8 * across, atol=1e-6)
    assert_allclose(turned[:, [0, -1]], turns[:, [0, -1]])


def test_a_step_of_bends_takes_half_of_a_difference_of_neighbours() -> None:
    """One segment of five, or the first bone, turned by a small angle: neighbours go a quarter of the way, and it a half."""
    turns = STILL.copy()
    turns[0, 3, 1] = turns[1, 0, 1] = 1e-4
    kernels.project_bend(turns, 1.0)
    assert_allclose(turns[0, :, 1], np.array([0, 0, 0.25, 0.5, 0.25, 0, 0]) * 1e-4, atol=1e-10)
    assert_allclose(turns[1, :3, 1], np.array([1, 0.25, 0]) * 1e-4, atol=1e-10)


def test_steps_of_volume_go_down_the_slope_and_reach_the_volume_of_rest() -> None:
    points, radii = REST + RANDOM.normal(0, 0.1, REST.shape), RANDOM.uniform(1, 2, (2, 6))
    rest = kernels.volumes(REST, np.full((2, 6), 1.5))
    wanted = points.copy()
    for _ in range(400):
        kernels.project_volume(points, radii, rest, 1.0)
    # Five volumes for six radii: they can all be met, and the ends of rods stay where they are.
    assert_allclose(kernels.volumes(points, radii), rest, rtol=1e-9)
    assert_allclose(points[:, [0, -1]], wanted[:, [0, -1]])
