"""Powers fitted to costs: exact ones, known noise, and what is no power."""

import math

import numpy as np
import pytest

from benchmarks.power_law import PowerLaw, fit

SIZES = (1e3, 1e4, 3e4, 1e5)


@pytest.mark.parametrize("exponent", [1.0, 4 / 3, 2.0])
def test_an_exact_power_is_found(exponent) -> None:
    found = fit(SIZES, [2e-6 * size**exponent for size in SIZES])
    assert (found.exponent, found.uncertainty) == pytest.approx((exponent, 0), abs=1e-9)
    assert found.at(1e7) == pytest.approx([2e-6 * 1e7**exponent] * 3, rel=1e-6)


def test_the_standard_error_is_that_of_a_line() -> None:
    # In logarithms: (0, 0), (1, 1 + e), (2, 2) has slope 1, residuals -e/3, 2e/3, -e/3, and squared error (6/9 e^2) / 1 / 2.
    off = 0.3
    found = fit(np.exp([0, 1, 2]), np.exp([0, 1 + off, 2]))
    assert (found.exponent, found.uncertainty) == pytest.approx((1, off / math.sqrt(3)))
    middle, low, high = found.at(math.e**3)
    spread = math.sqrt(6 / 9 * off**2 * (1 + 1 / 3 + 2**2 / 2))
    reach = math.tan(math.pi * 0.475) * spread  # of Student's distribution with one degree of freedom, Cauchy's
    assert np.log([middle, low, high]) == pytest.approx([3 + off / 3, 3 + off / 3 - reach, 3 + off / 3 + reach])


def test_intervals_cover_as_often_as_they_say() -> None:
    draw, sizes, exponent, noise = np.random.default_rng(1), np.geomspace(1e3, 1e5, 6), 1.2, 0.1
    errors, uncertainties, hits = [], [], []
    for _ in range(2000):
        values, there = sizes**exponent * np.exp(noise * draw.normal(size=6)), math.exp(noise * draw.normal())
        found = fit(sizes, values)
        _, low, high = found.at(1e7)
        hits.append(low <= 1e7**exponent * there <= high)
        errors.append(found.exponent - exponent)
        uncertainties.append(found.uncertainty**2)
    assert np.mean(hits) == pytest.approx(0.95, abs=0.015)
    assert np.std(errors) == pytest.approx(math.sqrt(np.mean(uncertainties)), rel=0.05)


def test_what_is_no_number_is_left_out() -> None:
    found = fit((*SIZES, 2e5, 3e5, 4e5), [*SIZES, 0.0, math.nan, math.inf])
    assert [size for size, _ in found.points] == list(SIZES)
    assert fit(SIZES[:2], SIZES[:2]) is None
    assert fit((1, 1, 1, 2), (1, 2, 3, 4)) is None  # two sizes are no slope with an error
    assert PowerLaw(((1.0, 1e-3), (2.0, 1.0), (4.0, 1e-3)), 300.0, 100.0).at(1e9)[2] == math.inf
