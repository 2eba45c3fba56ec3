"""Closed surfaces by few Gaussians."""

import numpy as np
import pytest
import shapes

from fem_reference.foundations.errors import InputError
from fem_reference.foundations.mesh import Floats, Surface
from fem_reference.geometry.gaussian_surface import GaussianSurface, farthest_points, fit


def ellipsoid() -> Surface:
    ball = shapes.sphere(3, 1.0)
    return ball.moved_to(ball.points * [40.0, 14.0, 9.0])


def off(surface: Surface, fitted: GaussianSurface) -> Floats:
    """How far [mm] each vertex is from the fitted surface."""
    return np.linalg.norm(fitted.project(surface.points) - surface.points, axis=1)


@pytest.mark.parametrize("count", [2, 5])
def test_gaussians_in_one_place_are_a_sphere(count: int) -> None:
    """Their sum is 1 where count times exp(-r^2 / s^2) is: at s sqrt(log count)."""
    found = GaussianSurface(np.tile([1.0, 2.0, 3.0], (count, 1)), np.full(count, 10.0))
    ball = shapes.sphere(2, 6.0).points + [1.0, 2.0, 3.0]
    on = found.project(ball)
    np.testing.assert_allclose(np.linalg.norm(on - [1, 2, 3], axis=1), 10 * np.sqrt(np.log(count)), rtol=1e-12)
    np.testing.assert_allclose(found.level(on)[0], 0, atol=1e-12)


def test_two_gaussians_join_and_part() -> None:
    """As in the report's Figure 7.1: halfway between two of radius s the sum is 2 exp(-d^2 / 4 s^2), 1 at d = 2 s sqrt(log 2)."""
    edge = 2 * 5.0 * np.sqrt(np.log(2))
    for apart, joined in ((edge - 0.01, True), (edge + 0.01, False)):
        pair = GaussianSurface(np.array([[0.0, 0, 0], [apart, 0, 0]]), np.full(2, 5.0))
        assert (pair.level(np.array([[apart / 2, 0.0, 0.0]]))[0][0] > 0) == joined


def test_its_gradient_is_the_slope_of_its_level() -> None:
    """Central differences: their error is of the order of the step squared, 1e-8."""
    rng = np.random.default_rng(2)
    found = GaussianSurface(rng.normal(size=(6, 3)), rng.uniform(1, 2, 6))
    points, step = rng.normal(size=(20, 3)), 1e-4
    slopes = [(found.level(points + step * e)[0] - found.level(points - step * e)[0]) / (2 * step) for e in np.eye(3)]
    np.testing.assert_allclose(np.stack(slopes, axis=1), found.level(points)[1], atol=1e-6)


@pytest.mark.slow
def test_more_gaussians_fit_better_with_few_numbers() -> None:
    """642 vertices are 1926 numbers; 40 Gaussians are 160 and miss by a percent of the length at most."""
    surface = ellipsoid()
    errors = [float(np.sqrt(np.square(off(surface, fit(surface, count))).mean())) for count in (5, 15, 40)]
    assert errors[2] < errors[1] < errors[0] < 2.0
    assert errors[2] < 0.4


@pytest.mark.slow
def test_a_turned_scaled_and_reordered_surface_has_the_same_fit() -> None:
    surface, rng = ellipsoid(), np.random.default_rng(4)
    turn, order = np.linalg.qr(rng.normal(size=(3, 3))).Q, rng.permutation(len(surface.points))
    turn *= np.linalg.det(turn)
    back = np.argsort(order)
    moved = Surface(2 * surface.points[order] @ turn.T + [5, 6, 7], back[surface.triangles])
    one, other = off(surface, fit(surface, 12)), off(moved, fit(moved, 12))
    # The ellipsoid is symmetric, so that the first of its farthest points may be another one: fits are as good, not the same.
    assert np.sqrt(np.square(other).mean()) == pytest.approx(2 * np.sqrt(np.square(one).mean()), rel=0.3)


def test_a_fit_does_not_depend_on_axes_place_or_size() -> None:
    """Of a rough surface, which has axes of its own, the same fit up to rounding."""
    ball, rng = shapes.sphere(2, 20.0), np.random.default_rng(0)
    surface = ball.moved_to(ball.points * [1, 1, 1.5] + rng.normal(scale=0.5, size=ball.points.shape))
    turn = np.linalg.qr(rng.normal(size=(3, 3))).Q
    turn *= 2.5 * np.linalg.det(turn)
    moved = surface.moved_to(surface.points @ turn.T + [30, -50, 7])
    there, here = (fit(one, 12).project(one.points) for one in (moved, surface))
    np.testing.assert_allclose(there, here @ turn.T + [30, -50, 7], atol=1e-9)


def test_farthest_points_spread() -> None:
    line = np.linspace(0, 1, 101)[:, None] ** 2
    chosen = np.sort(line[farthest_points(line, 3), 0])
    np.testing.assert_allclose(chosen[[0, 2]], [0, 1])
    assert 0.4 < chosen[1] < 0.6


@pytest.mark.parametrize("count", [1, 10**5, 10**400], ids=["too_few", "too_many", "far_too_many"])
def test_too_few_or_more_gaussians_than_points_inside_are_refused(count: int) -> None:
    with pytest.raises(InputError, match=r"gaussians: got 1.*, want 2 to \d+, "):
        fit(ellipsoid(), count)
