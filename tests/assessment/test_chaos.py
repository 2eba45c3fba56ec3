"""Polynomial chaos beside closed forms of sensitivities, and beside scipy's Saltelli sampling."""

import numpy as np
import pytest
from scipy.stats import qmc, sobol_indices, uniform

from fem_reference.assessment import chaos
from fem_reference.assessment.chaos import Chaos, fit


def design(runs: int, variables: int, seed: int = 1) -> np.ndarray:
    return 2 * qmc.LatinHypercube(variables, rng=np.random.default_rng(seed)).random(runs) - 1


def fitted(points: np.ndarray, outputs: np.ndarray) -> Chaos:
    found = fit(points, outputs.reshape(len(points), -1))
    assert found is not None
    return found


def between(points: np.ndarray, low: list[float], high: list[float]) -> np.ndarray:
    return np.array(low) + (points + 1) / 2 * (np.array(high) - np.array(low))


LOW, HIGH = [2.0, 5.0, 1.0], [4.0, 6.0, 3.0]


def test_springs_in_parallel_have_the_closed_form() -> None:
    """k1 + k2 + k3 of uniform stiffnesses: the variance of each is (high - low)^2 / 12."""
    points = design(16, 3)
    found = fitted(points, between(points, LOW, HIGH).sum(axis=1))
    shares = (np.array(HIGH) - LOW) ** 2
    assert found.first == pytest.approx(shares / shares.sum(), abs=1e-9)
    assert found.total == pytest.approx(found.first, abs=1e-9)
    assert found.error < 1e-20


def test_few_runs_of_something_straight_are_followed_exactly() -> None:
    """Ten runs of two variables, of which terms of high degree fit as well by chance."""
    for seed in range(10):
        points = design(10, 2, seed)
        found = fitted(points, points @ [4.0, 6.0] + 1e-4 * points[:, 0] ** 2)
        assert found.error < 1e-6
        assert found.first == pytest.approx([16 / 52, 36 / 52], rel=1e-3)


def test_springs_in_series_have_the_closed_form() -> None:
    """1/k1 + 1/k2 + 1/k3: E[1/k] = ln(b/a) / (b - a), E[1/k^2] = 1/(ab), within 1 %."""
    points = design(64, 3)
    found = fitted(points, (1 / between(points, LOW, HIGH)).sum(axis=1))
    a, b = np.array(LOW), np.array(HIGH)
    variances = 1 / (a * b) - (np.log(b / a) / (b - a)) ** 2
    assert found.first == pytest.approx(variances / variances.sum(), rel=0.01)
    assert found.total == pytest.approx(found.first, rel=0.01)
    assert found.error < 1e-4
    assert (found.coefficients[1:, 0] ** 2).sum() == pytest.approx(variances.sum(), rel=0.01)


def test_interactions_count_in_total_sensitivities() -> None:
    """Ishigami: a = 7, b = 0.1 (Ishigami and Homma 1990): V1 = (1 + b pi^4/5)^2 / 2, V2 = a^2/8, V13 = 8 b^2 pi^8 / 225."""
    points = design(256, 3)
    x = np.pi * points
    found = fitted(points, np.sin(x[:, 0]) + 7 * np.sin(x[:, 1]) ** 2 + 0.1 * x[:, 2] ** 4 * np.sin(x[:, 0]))
    one, two, both = (1 + 0.1 * np.pi**4 / 5) ** 2 / 2, 49 / 8, 8 * 0.01 * np.pi**8 / 225
    whole = one + two + both
    assert found.first == pytest.approx(np.array([one, two, 0]) / whole, abs=0.02)
    assert found.total == pytest.approx(np.array([one + both, two, both]) / whole, abs=0.02)


def test_sensitivities_agree_with_saltelli_sampling_of_the_polynomial() -> None:
    points = design(60, 3)
    found = fitted(points, np.exp(points[:, 0]) * (2 + points[:, 1]) + points[:, 2] ** 3)
    sampled = sobol_indices(
        func=lambda x: found(x.T).T, n=2**13, dists=[uniform(-1, 2)] * 3, rng=np.random.default_rng(2)
    )
    assert found.first == pytest.approx(sampled.first_order.ravel(), abs=0.01)
    assert found.total == pytest.approx(sampled.total_order.ravel(), abs=0.01)


def test_noise_has_an_error_of_its_whole_variance() -> None:
    """Nothing can be learned from noise: a surrogate that follows it would claim an error far below 1."""
    for seed in range(5):
        noise = np.random.default_rng(seed).standard_normal(64)
        assert fitted(design(64, 4, seed), noise).error > 0.7


def test_the_error_is_that_at_other_points() -> None:
    """Of a kink, which no polynomial follows: within a factor of 3 of the error at many other points, not below it by more."""
    function = lambda x: np.abs(x[:, 0] - 0.3) + 0.5 * np.abs(x[:, 1] + 0.2)  # noqa: E731
    points, others = design(40, 2), design(4000, 2, 5)
    found = fitted(points, function(points))
    true = np.mean((found(others)[:, 0] - function(others)) ** 2) / function(others).var()
    assert true / 3 < found.error < 3 * true


def test_several_outputs_share_their_terms_and_weigh_by_variance() -> None:
    points = design(30, 2)
    found = fitted(points, np.stack([points[:, 0], 3 * points[:, 1]], axis=1))
    assert found.first == pytest.approx([0.1, 0.9], abs=1e-9)


@pytest.mark.parametrize("bad", [np.nan, np.inf])
def test_a_run_without_a_value_is_refused(bad: float) -> None:
    outputs = np.ones((8, 1))
    outputs[3] = bad
    with pytest.raises(ValueError, match="a run without a value has no place"):
        fit(design(8, 1), outputs)


def test_what_does_not_vary_has_no_polynomial() -> None:
    assert fit(design(8, 2), np.full((8, 3), 4.2)) is None
    assert chaos.DEGREE >= 2
