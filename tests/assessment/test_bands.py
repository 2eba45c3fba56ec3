"""Bands beside distributions that are known, and no band of what is missing."""

from dataclasses import replace

import numpy as np
import pytest

from fem_reference.assessment import bands
from fem_reference.assessment.bands import Design, of_field, of_values, sampled
from fem_reference.assessment.uncertainty import Band, Parameter

FRAMES = (0, 10, 20)


def design(runs: int, variables: int = 2, lost: int = 0) -> Design:
    known = tuple(Parameter(f"k{i}", f"k{i}", "", 0.5, 0.0, 1.0, "uniform", "") for i in range(variables))
    return Design(known, sampled(variables, runs, 1)[lost:], runs)


def empty(nominal: tuple[float, ...] = (0.0, 1.0, 2.0), *, distance: bool = False) -> Band:
    unknown = np.full(3, np.nan)
    return Band("q", "Quantity", "mm", FRAMES, np.array(nominal), unknown, unknown, unknown, None, distance)


def test_the_band_of_a_linear_problem_is_exact() -> None:
    """x/2 + y over -1..1: its density is a trapezoid of half widths 1.5 and 0.5, whose tail beyond q has the area (1.5 - q)^2 / 4.
    The percentiles of 2^15 points that are spread by chance have a standard error of 0.005 times the scale.
    """
    own = design(12)
    values = (own.points @ [0.5, 1.0])[:, None] * [0.0, 1.0, 2.0] + 3
    found = of_values(empty(), own, values)
    tail = 1.5 - np.sqrt(4 * 0.05)
    assert (found.by, found.refused) == ("process", "")
    assert found.low == pytest.approx([3, 3 - tail, 3 - 2 * tail], abs=5e-3)
    assert found.median == pytest.approx([3, 3, 3], abs=5e-3)
    assert found.high == pytest.approx([3, 3 + tail, 3 + 2 * tail], abs=5e-3)
    assert list(found.first.values()) == pytest.approx([0.2, 0.8], abs=2e-3)
    assert found.width == pytest.approx(4 * tail, abs=0.01)


def test_the_band_of_a_field_is_that_of_its_distance() -> None:
    """A field of three points that moves by x along one and by 2y along another: rms sqrt(x^2 + 4 y^2) / sqrt(3), with a kink at 0,
    which no smooth surrogate follows; the field itself is linear.
    """
    own = design(16)
    x, y = own.points.T
    fields = np.stack([x, 2 * y, 0 * x], axis=1) / np.sqrt(3)
    products = np.array([scale**2 * fields @ fields.T for scale in (0.0, 0.5, 1.0)])
    found = of_field(empty((0.0, 0.0, 0.0), distance=True), own, products)
    x, y = np.random.default_rng(3).uniform(-1, 1, (2, 10**6))
    sampled_there = np.quantile(np.sqrt((x**2 + 4 * y**2) / 3), [0.05, 0.5, 0.95])
    assert [found.low[2], found.median[2], found.high[2]] == pytest.approx(sampled_there, rel=0.01)
    assert found.high == pytest.approx(np.array([0, 0.5, 1]) * found.high[2])
    assert found.error < 1e-12
    assert list(found.total.values()) == pytest.approx([0.2, 0.8], abs=2e-3)


def test_a_run_that_is_not_a_number_makes_no_band() -> None:
    own = design(30)
    values = np.ones((30, 3)) * own.points[:, :1]
    values[7, 1] = np.nan
    found = of_values(empty(), own, values)
    assert found.refused == "1 values of runs are not numbers"
    assert np.isnan(found.high).all()
    assert np.isnan(found.width)
    assert found.first == {}
    products = np.full((3, 30, 30), np.nan)
    assert "not numbers" in of_field(empty(), own, products).refused


def test_a_frame_in_which_the_quantity_is_not_defined_has_no_band() -> None:
    own = design(12)
    values = np.stack([np.full(12, np.nan), own.points[:, 0], own.points[:, 0]], axis=1)
    found = of_values(empty((np.nan, 1.0, 1.0)), own, values)
    assert np.isnan(found.high).tolist() == [True, False, False]


@pytest.mark.parametrize(("lost", "there"), [(3, True), (4, False)])
def test_a_band_out_of_too_few_runs_is_refused(lost: int, there: bool) -> None:
    """Of 64 runs 3 are less than a twentieth and 4 more: those might all lie beyond the 95th percentile."""
    own = design(64, lost=lost)
    found = of_values(empty(), own, own.points[:, :1] * [1.0, 1.0, 1.0])
    assert (found.refused == "") is there
    assert there or "4 of 64 runs have no result: they might all lie beyond" in found.refused


def test_fewer_runs_than_parameters_need_are_refused() -> None:
    own = design(7, variables=3)
    assert "3 parameters need at least 8" in of_values(empty(), own, own.points).refused


@pytest.mark.slow
def test_what_no_surrogate_follows_has_no_sensitivities() -> None:
    """Noise: its own percentiles where there are runs enough, no band where there are not."""
    noise = np.random.default_rng(1).standard_normal((200, 3))
    found = of_values(empty(), design(200), noise)
    assert found.first == found.total == {}
    assert "of the variance at runs that it was not fitted to, more than 5 %" in found.unreliable
    assert found.by == "runs"
    assert found.high == pytest.approx(np.quantile(noise, 0.95, axis=0))
    few = of_values(empty(), design(15), noise[:15])
    assert "15 runs are too few for percentiles without it" in few.refused
    assert np.isnan(few.low).all()


def test_a_steep_step_is_followed() -> None:
    """In x, times 2 + y: of the variance 4 of 4 1/3 parts are by x alone and the rest with y, whatever the step."""
    own = design(32)
    x, y = own.points.T
    found = of_values(empty(), own, (np.tanh(8 * x) * (2 + y))[:, None] * [0.5, 1.0, 1.0])
    assert found.by == "process"
    assert list(found.first.values()) == pytest.approx([12 / 13, 0], abs=0.02)
    assert list(found.total.values()) == pytest.approx([1, 1 / 13], abs=0.02)


def test_what_does_not_vary_has_a_band_without_width() -> None:
    found = of_values(empty(), design(12), np.ones((12, 3)))
    assert (found.refused, found.width, found.first) == ("", 0.0, {})
    still = of_field(replace(empty(), distance=True), design(12), np.zeros((3, 12, 12)))
    assert still.high.tolist() == [0, 0, 0]
    assert bands.WORST < 0.1
