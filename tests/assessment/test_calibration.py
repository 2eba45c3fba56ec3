"""Calibration beside data of known parameters: a fibre at a material point, and what data do not determine."""

import json
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy import stats

from fem_reference import effects
from fem_reference.assessment.calibration import Calibration, Measurement, facts, fit, read
from fem_reference.assessment.uncertainty import Parameter
from fem_reference.foundations.errors import InputError
from fem_reference.foundations.material_point import fibre_tension

STRETCHES = np.linspace(1.02, 1.35, 15)
P1 = Parameter("effect[0].p1", "fibre_passive p1", "", 0.03, 0.01, 0.1, "log-uniform", "")
P2 = Parameter("effect[0].p2", "fibre_passive p2", "", 8.0, 5.0, 12.0, "uniform", "")
TRUTH = {"p1": 0.05, "p2": 6.6}
SD = 1e-3


def tension(p1: float, p2: float) -> np.ndarray:
    """The stress [MPa] of passive fibres, as the energy of the effect gives it."""
    law = effects.make("fibre_passive", stress="300 kPa", p1=p1, p2=p2, optimal_stretch=1.0, linear_from=1.4)
    assert isinstance(law, effects.Energy)
    return np.array([fibre_tension(law.energy, float(stretch)) for stretch in STRETCHES])


def forward(points: Sequence[np.ndarray]) -> list[np.ndarray]:
    return [tension(P1.at(float(one)), P2.at(float(other))) for one, other in points]


def data(values: np.ndarray, sd: float = SD) -> list[Measurement]:
    return [Measurement(i, "stress", float(value), "MPa", sd, f"row {i}") for i, value in enumerate(values)]


def noisy(seed: int) -> Calibration:
    noise = SD * np.random.default_rng(seed).standard_normal(len(STRETCHES))
    return fit(forward, (P1, P2), data(tension(**TRUTH) + noise), "fibre")


@pytest.mark.slow
def test_parameters_are_inside_their_intervals_in_19_of_20_trials() -> None:
    """Of 40 trials with 2 intervals each 76 are expected, with a standard deviation of 2.8 (errors are correlated)."""
    found = [noisy(seed) for seed in range(40)]
    inside = [
        one.low <= truth <= one.high
        for result in found
        for one, truth in zip(result.estimates, TRUTH.values(), strict=True)
    ]
    assert sum(inside) >= 70
    assert sum(inside[:40]) >= 38, "the first twenty"
    assert np.mean([one.scatter for one in found]) == pytest.approx(1, abs=0.08)
    assert all(one.is_known and not one.at for result in found for one in result.estimates)


def test_exact_data_give_the_exact_parameters() -> None:
    found = fit(forward, (P1, P2), data(tension(**TRUTH)), "fibre")
    assert [one.value for one in found.estimates] == pytest.approx([0.05, 6.6], rel=1e-4)
    assert found.scatter < 1e-2
    assert found.fitted == pytest.approx(tension(**TRUTH), abs=1e-5)
    assert found.runs < 60


def test_correlated_parameters_are_named() -> None:
    """Size and rate of a toe can hardly be told apart."""
    ((one, other, correlation),) = noisy(0).pairs
    assert (one, other) == ("fibre_passive p1", "fibre_passive p2")
    assert -1 < correlation < -0.95


def line(points: Sequence[np.ndarray]) -> list[np.ndarray]:
    """Springs in parallel: only their sum is felt, and of the third nothing."""
    at = np.arange(1.0, 11.0)
    return [(K1.at(float(p[0])) + K2.at(float(p[1]))) * at for p in points]


K1, K2, K3 = (Parameter(f"k{i}", f"spring {i}", "N/mm", 1.5, 1.0, 3.0, "uniform", "") for i in (1, 2, 3))


def test_the_interval_of_a_line_is_that_of_regression() -> None:
    """The slope is sum(x y) / sum(x^2), and half its interval t s / sqrt(sum(x^2)), s^2 = sum((y - k x)^2) / (n - 1)."""
    x = np.arange(1.0, 11.0)
    y = 1.7 * x + 0.3 * np.random.default_rng(5).standard_normal(10)
    (one,) = fit(lambda points: [K1.at(float(p[0])) * x for p in points], (K1,), data(y, 0.1), "k").estimates
    slope = x @ y / (x @ x)
    half = stats.t.ppf(0.975, 9) * np.sqrt(((y - slope * x) ** 2).sum() / 9 / (x @ x))
    assert [one.low, one.value, one.high] == pytest.approx([slope - half, slope, slope + half], abs=1e-5)


def test_what_only_acts_together_is_not_determined_and_named() -> None:
    noise = 0.01 * np.random.default_rng(1).standard_normal(10)
    found = fit(line, (K1, K2, K3), data(3.5 * np.arange(1.0, 11.0) + noise, 0.01), "springs")
    assert [one.is_known for one in found.estimates] == [False, False, False]
    assert all(np.isinf(one.high) for one in found.estimates)
    assert [(one, other) for one, other, _ in found.pairs] == [("spring 1", "spring 2")]
    assert sum(one.value for one in found.estimates[:2]) == pytest.approx(3.5, abs=0.01)
    assert found.singular[1] < 1e-6 * found.singular[0]


def test_a_parameter_at_its_bound_is_said() -> None:
    alone = fit(
        lambda points: [K1.at(float(p[0])) * np.arange(1.0, 11.0) for p in points],
        (K1,),
        data(9 * np.arange(1.0, 11.0)),
        "k",
    )
    (one,) = alone.estimates
    assert (one.at, one.value) == ("high", pytest.approx(3.0, rel=1e-3))
    assert alone.scatter > 100


def test_a_fit_says_whether_it_holds() -> None:
    """A straight line does not follow a square, whatever its slope; nor does one hold that is told to stop before its best."""
    x = np.arange(1.0, 11.0)
    good, bad = (
        fit(lambda points: [K1.at(float(p[0])) * x for p in points], (K1,), data(y, 0.1), "k")
        for y in (1.7 * x, 0.2 * x**2)
    )
    assert good.converged
    assert good.is_followed
    assert good.holds
    assert bad.converged
    assert not bad.is_followed
    assert not bad.holds
    assert not replace(good, converged=False).holds
    assert not replace(good, estimates=(replace(good.estimates[0], at="low"),)).holds


def test_a_point_without_an_answer_is_stepped_back_from() -> None:
    """The springs have no answer from 2.5 N/mm on, as runs that diverge; a fit from 1.01 that jumps there comes back to 2."""
    x, asked = np.arange(1.0, 11.0), list[float]()

    def halting(points: Sequence[np.ndarray]) -> list[np.ndarray | None]:
        slopes = [K1.at(float(p[0])) for p in points]
        asked.extend(slopes)
        return [None if k > 2.5 else x * k**0.25 for k in slopes]

    soft = replace(K1, nominal=1.0)
    found = fit(halting, (soft,), data(x * 2**0.25, 1e-3), "k")
    assert found.ended == ""
    assert found.holds
    assert found.estimates[0].value == pytest.approx(2.0, rel=1e-4)


def test_a_start_without_an_answer_ends_a_fit_and_nothing_is_claimed() -> None:
    found = fit(lambda points: [None for _ in points], (K1,), data(np.arange(1.0, 11.0)), "k")
    assert (found.ended, found.estimates, found.converged) == ("a run that the fit needs has no result", (), False)
    assert np.isnan(found.scatter)
    assert not found.holds
    assert found.runs == 2
    json.dumps(facts(found), allow_nan=False)


def test_the_best_point_is_kept_where_a_fit_cannot_go_on() -> None:
    """Answers at the start, beside it, and at the point of the first step: there no sensitivities are known. The step goes most of
    the way along a line from 1.5 to 1.6.
    """
    x, asked = np.arange(1.0, 11.0), list[float]()

    def some(points: Sequence[np.ndarray]) -> list[np.ndarray | None]:
        asked.extend(float(p[0]) for p in points)
        return [x * K1.at(float(p[0])) if len(asked) <= 3 else None for p in points]

    found = fit(some, (K1,), data(1.6 * x, 0.1), "k")
    assert found.ended
    (one,) = found.estimates
    assert one.value == pytest.approx(1.6, abs=0.02)
    assert (one.low, one.high) == (-np.inf, np.inf)
    assert not one.is_known


def test_too_few_rows_are_refused() -> None:
    with pytest.raises(InputError, match="data: got 2 rows for 2 parameters, want more rows than parameters"):
        fit(forward, (P1, P2), data(tension(**TRUTH))[:2], "fibre")


def test_values_that_are_not_numbers_end_it() -> None:
    with pytest.raises(InputError, match="calibrate: got values that are not numbers"):
        fit(lambda points: [np.full(15, np.nan) for _ in points], (P1, P2), data(tension(**TRUTH)), "fibre")


def units(quantity: str, place: str) -> str:
    if quantity == "force.lid":
        return "N"
    if quantity == "volume.deviation":
        return "%"
    raise InputError(place, f'"{quantity}"', "one that is known")


def written(folder: Path, *rows: str, head: str = "frame,quantity,value,unit,sd") -> Path:
    (folder / "data.csv").write_text("\n".join([head, *rows]) + "\n")
    return folder / "data.csv"


def test_rows_are_read_in_the_units_of_their_quantities(tmp_path: Path) -> None:
    path = written(tmp_path, "10, force.lid, 2, kN, 0.1", "20,volume.deviation,0.5,%,0.1")
    one, other = read(path, units)
    assert (one.frame, one.value, one.sd, one.unit) == (10, 2000, 100, "N")
    assert (other.value, other.sd) == pytest.approx((0.5, 0.1))
    assert other.place == f"{path}: row 3"


@pytest.mark.parametrize(
    ("row", "message"),
    [
        ("10,force.lid,2,mm,0.1", r'row 2: value: got "2 mm", want a number with a unit like N'),
        ("10,force.lid,2,,0.1", r'row 2: value: got "2 ", want a number with a unit like N'),
        ("10,force.lid,nan,N,0.1", r"row 2: value: got"),
        ("10,force.lid,2,N,0", r'row 2: sd: got "0", want more than 0'),
        ("10,force.lid,2,N,-1", r'row 2: sd: got "-1", want more than 0'),
        ("10,stress,2,N,1", r'row 2: quantity: got "stress", want one that is known'),
        ("first,force.lid,2,N,1", r'row 2: frame: got "first", want a frame number'),
        ("10,force.lid,2,N", r"row 2: got 4 entries, want 5"),
    ],
)
def test_a_wrong_row_is_named(tmp_path: Path, row: str, message: str) -> None:
    with pytest.raises(InputError, match=message):
        read(written(tmp_path, row), units)


def test_an_unknown_column_is_named(tmp_path: Path) -> None:
    with pytest.raises(
        InputError, match=r'got the first row "frame,metric,value", want a CSV file whose first row is frame,q'
    ):
        read(written(tmp_path, head="frame,metric,value"), units)
