"""A Gaussian process beside functions with closed forms of their sensitivities, and where a polynomial fails."""

import numpy as np
import pytest

from fem_reference.assessment import chaos, gaussian_process
from fem_reference.assessment.bands import sampled


def test_a_straight_function_is_followed_exactly() -> None:
    points = sampled(3, 20, 1)
    found = gaussian_process.fit(points, points @ np.array([[4.0, 0], [6, 1], [0, 2]]) + [7, 8])
    assert found.error < 1e-12
    assert found(np.array([[0.5, -0.5, 1]])) == pytest.approx(np.array([[6, 9.5]]), abs=1e-6)
    shares = np.array([16, 37, 4]) / 57  # of both outputs together
    assert found.first == pytest.approx(shares, abs=2e-3)
    assert found.total == pytest.approx(shares, abs=2e-3)


def test_products_count_in_total_sensitivities() -> None:
    """Of x + y + 3 x y over -1..1 the variances are 1/3, 1/3 and 9/9: 1/5 by each alone and 4/5 with the other."""
    points = sampled(2, 24, 1)
    found = gaussian_process.fit(points, (points.sum(axis=1) + 3 * points.prod(axis=1))[:, None])
    assert found.error < 1e-4
    assert found.first == pytest.approx([0.2, 0.2], abs=0.01)
    assert found.total == pytest.approx([0.8, 0.8], abs=0.01)


def test_a_kink_is_followed_better_than_by_a_polynomial_and_noise_not_at_all() -> None:
    """Softplus of a tenth of the range: tension that begins. The error of noise is that of its mean and more."""
    points = sampled(3, 48, 1)
    kink = (np.logaddexp(0, 10 * points[:, 0]) / 10 * np.exp(points[:, 1]) * (2 + points[:, 2]))[:, None]
    polynomial = chaos.fit(points, kink)
    assert polynomial is not None
    found = gaussian_process.fit(points, kink)
    assert found.error < polynomial.error / 2
    fresh = np.random.default_rng(5).uniform(-1, 1, (2000, 3))
    truth = np.logaddexp(0, 10 * fresh[:, 0]) / 10 * np.exp(fresh[:, 1]) * (2 + fresh[:, 2])
    missed = ((found(fresh)[:, 0] - truth) ** 2).mean() / truth.var()
    assert found.error / 4 < missed < 4 * found.error, "the stated error is that at other points, within a factor"
    assert gaussian_process.fit(points[:24], np.random.default_rng(1).normal(size=(24, 2))).error > 0.9


def test_the_slopes_of_the_likelihood_lead_to_its_greatest_value() -> None:
    """Values of a process of known lengths give these back, to what 60 of them say."""
    rng, points = np.random.default_rng(2), sampled(2, 60, 3)
    distances = ((points[:, None] - points) ** 2 / np.array([0.5, 2.0]) ** 2).sum(axis=2)
    values = np.linalg.cholesky(np.exp(-distances / 2) + 1e-6 * np.eye(60)) @ rng.normal(size=(60, 4))
    found = gaussian_process.fit(points, values)
    assert np.exp(found.logs[:2]) == pytest.approx([0.5, 2.0], rel=0.15)
