"""A Gaussian process beside functions with closed forms of their sensitivities."""

import numpy as np
import pytest

from fem_reference.assessment import gaussian_process
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


def between(points: np.ndarray, low: list[float], high: list[float]) -> np.ndarray:
    return np.array(low) + (points + 1) / 2 * (np.array(high) - np.array(low))


def test_springs_in_series_have_the_closed_form() -> None:
    """1/k1 + 1/k2 + 1/k3: E[1/k] = ln(b/a) / (b - a), E[1/k^2] = 1/(ab); samples of the shares are good to 0.002."""
    points, low, high = sampled(3, 64, 1), [2.0, 5.0, 1.0], [4.0, 6.0, 3.0]
    found = gaussian_process.fit(points, (1 / between(points, low, high)).sum(axis=1)[:, None])
    a, b = np.array(low), np.array(high)
    variances = 1 / (a * b) - (np.log(b / a) / (b - a)) ** 2
    assert found.first == pytest.approx(variances / variances.sum(), abs=0.01)
    assert found.total == pytest.approx(found.first, abs=0.01)
    assert found.error < 1e-4


def test_interactions_count_in_total_sensitivities() -> None:
    """Ishigami: a = 7, b = 0.1 (Ishigami and Homma 1990): V1 = (1 + b pi^4/5)^2 / 2, V2 = a^2/8, V13 = 8 b^2 pi^8 / 225."""
    points = sampled(3, 200, 1)
    x = np.pi * points
    values = np.sin(x[:, 0]) + 7 * np.sin(x[:, 1]) ** 2 + 0.1 * x[:, 2] ** 4 * np.sin(x[:, 0])
    found = gaussian_process.fit(points, values[:, None])
    one, two, both = (1 + 0.1 * np.pi**4 / 5) ** 2 / 2, 49 / 8, 8 * 0.01 * np.pi**8 / 225
    whole = one + two + both
    assert found.first == pytest.approx(np.array([one, two, 0]) / whole, abs=0.02)
    assert found.total == pytest.approx(np.array([one + both, two, both]) / whole, abs=0.02)


@pytest.mark.parametrize("bad", [np.nan, np.inf])
def test_a_run_without_a_value_is_refused(bad: float) -> None:
    outputs = np.ones((8, 1))
    outputs[3] = bad
    with pytest.raises(ValueError, match="leave out runs without a value"):
        gaussian_process.fit(sampled(1, 8, 1), outputs)


def test_what_does_not_vary_has_no_process() -> None:
    assert gaussian_process.fit(sampled(2, 8, 1), np.full((8, 3), 4.2)) is None


def test_a_kink_is_followed_and_noise_is_not() -> None:
    """Softplus of a tenth of the range: tension that begins. The error of noise is that of its mean and more."""
    points = sampled(3, 48, 1)
    kink = (np.logaddexp(0, 10 * points[:, 0]) / 10 * np.exp(points[:, 1]) * (2 + points[:, 2]))[:, None]
    found = gaussian_process.fit(points, kink)
    assert found.error < 0.05
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
