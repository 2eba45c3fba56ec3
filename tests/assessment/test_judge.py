"""Pass, fail and inconclusive, expectations read strictly, and reasons to doubt a reference, each from its own run."""

import math
from functools import partial
from types import SimpleNamespace

import numpy as np
import pytest

from fem_reference.assessment.judge import MET, check, doubted, doubts, judge, overall, resolved, verdict
from fem_reference.foundations.errors import InputError
from fem_reference.foundations.limits import ENERGY_GAP
from fem_reference.foundations.mesh import Surface
from fem_reference.metrics import Measure
from fem_reference.runs.store import Outcome, Run
from fem_reference.scenes.case import Expectation

NUMBERS = (0, 10, 20)
TRIANGLE = Surface(np.eye(3), np.array([[0, 1, 2]]))


def expectation(**changes) -> Expectation:
    keys = {
        "of": "reference",
        "metric": "volume",
        "statistic": "deviation",
        "frame": "any",
        "truth": "0 %",
        "within": "0.5 %",
    }
    return Expectation(**(keys | {"kind": "property", "because": "a test"} | changes))


def judged(values, unit="%", **changes):
    return verdict(expectation(**changes), [Measure("volume", "deviation", unit, np.array(values))], NUMBERS)


def checked(carries=("surface", "lines"), against=("reference", "itself"), **changes) -> None:
    case = {"carries": carries, "standards": lambda _: against, "numbers": NUMBERS, "place": "case.toml"}
    check(SimpleNamespace(expect=(expectation(**changes),), **case))


scalar = partial(checked, ("field",), ("itself", "exact"))


def test_pass_only_within_the_tolerance() -> None:
    assert judge(1.0, 1.0, 0.0) == "pass"
    assert judge(1.11, 1.0, 0.1) == "fail"
    assert judge(0.89, 1.0, 0.1) == "fail"


@pytest.mark.parametrize("word", ["pass", "doubtful pass", "fail", "inconclusive", "not judged"])
def test_doubts_change_a_pass_alone(word) -> None:
    assert doubted(word, []) == word
    assert doubted(word, ["unstable"]) == ("doubtful pass" if word == "pass" else word)
    assert (doubted(word, ["unstable"]) in MET) == (word in MET)


def test_the_worst_of_several_verdicts_counts() -> None:
    assert overall(["pass", "doubtful pass"]) == "doubtful pass"
    assert overall(["doubtful pass", "inconclusive"]) == "inconclusive"
    assert overall([]) == "not judged"


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
def test_what_is_not_a_number_never_passes(value) -> None:
    assert judge(value, 0.0, 1e9) == "fail"
    assert judged([0, value, 0]).word == "fail"
    assert judged([0, value, 0]).frame == 10


@pytest.mark.parametrize(
    ("value", "bar", "word"),
    [
        (0.25, 0.04, "pass"),  # from 0.21 to 0.29
        (0.25, 0.06, "inconclusive"),  # to 0.31
        (0.35, 0.06, "inconclusive"),
        (0.37, 0.06, "fail"),  # from 0.31
        (-5.0, 4.0, "fail"),  # a gross miss fails however wide the bar is
        (0.0, math.inf, "inconclusive"),
        (math.nan, math.nan, "fail"),
    ],
)
def test_the_truth_may_be_anywhere_in_its_bar(value, bar, word) -> None:
    assert judge(value, 0.0, 0.3, error_bar=bar) == word


def test_overall() -> None:
    assert overall(["pass", "inconclusive", "fail"]) == "fail"
    assert overall(["pass", "inconclusive"]) == "inconclusive"
    assert overall(["pass"]) == "pass"
    assert overall([]) == "not judged"


def test_any_frame_means_every_frame_and_shows_the_one_that_decides() -> None:
    assert judged([0.1, -0.4, 0.2]).word == "pass"
    assert (judged([0.1, -0.4, 0.2]).frame, judged([0.1, -0.4, 0.2]).value) == (10, -0.4)
    assert (judged([0.1, -0.4, 0.6]).word, judged([0.1, -0.4, 0.6]).frame) == ("fail", 20)


def test_one_frame() -> None:
    assert judged([9, 0.1, 9], frame=10).word == "pass"
    with pytest.raises(InputError, match=r'expect\[0\].frame: got 11, want "any" or one of 0, 10, ..., 20'):
        checked(frame=11)


def test_units_of_tolerances_are_those_of_the_measure() -> None:
    assert judged([0, 0.4, 0], unit="mm", truth="0 mm", within="0.05 cm").word == "pass"
    with pytest.raises(InputError, match=r'expect\[0\].within: got "0.5 %", want a volume'):
        checked(statistic="deviation_volume", truth="0 ml")


@pytest.mark.parametrize(
    ("unit", "truth", "value"),
    [
        ("mm", "1 cm", 10.0),
        ("%", "0.02", 2.0),
        ("mm3", "1 cm^3", 1000.0),
        ("deg", "0.5 rad", 90 / math.pi),
        ("kPa", "0.02 MPa", 20.0),
    ],
)
def test_a_truth_is_taken_into_the_unit_of_its_measure(unit, truth, value) -> None:
    found = judged([value] * 3, unit=unit, truth=truth, within=truth)
    assert (found.truth, found.within) == pytest.approx((value, value), rel=1e-12)
    assert judged([2.01 * value] * 3, unit=unit, truth=truth, within=truth).word == "fail"


def test_a_tolerance_below_zero_is_refused() -> None:
    with pytest.raises(InputError, match=r'expect\[0\].within: got "-0.5 %", want a tolerance of at least zero'):
        checked(within="-0.5 %")


def test_a_verdict_takes_the_error_bar_of_each_frame() -> None:
    def with_bars(values, bars, **changes):
        measure = Measure("volume", "deviation", "%", np.array(values), error_bars=np.array(bars))
        return verdict(expectation(**changes), [measure], NUMBERS)

    # 0.5 % are allowed.
    found = with_bars([0.1, -0.4, 0.2], [0.0, 0.1, 0.29])
    assert (found.word, found.frame, found.error_bar) == ("pass", 10, 0.1)
    found = with_bars([0.1, -0.4, 0.2], [0.0, 0.1, 0.31])
    assert (found.word, found.frame, found.error_bar) == ("inconclusive", 20, 0.31)
    found = with_bars([0.1, -0.4, 0.2], [0.3, np.nan, 0.17])
    assert (found.word, found.frame, np.isnan(found.error_bar)) == ("inconclusive", 10, True)
    # A frame that passes does not decide, however wide its bar is.
    found = with_bars([0.0, -0.4, 0.2], [0.4, 0.2, 0.1])
    assert (found.word, found.frame) == ("inconclusive", 10)
    # A miss by more than the bar fails, whatever other frames are known to.
    found = with_bars([0.1, -0.7, 0.2], [0.0, 0.1, 0.4])
    assert (found.word, found.frame) == ("fail", 10)
    assert with_bars([0.1, -0.4, 0.2], [0.0, 0.1, 9.0], frame=10).word == "pass"
    assert judged([0.1, -0.4, 0.2]).error_bar is None


def test_a_truth_known_to_nobody_knows_what_judges_nothing() -> None:
    assert judge(0.0, 0.0, 1.0, error_bar=float("nan")) == "inconclusive"


def test_a_measure_that_does_not_exist_is_named() -> None:
    with pytest.raises(
        InputError, match=r'expect\[0\]: metric and statistic: got "volume.median", want one of .*volume.deviation'
    ):
        checked(statistic="median")


def test_a_metric_with_one_number_needs_no_statistic_and_no_unit() -> None:
    one = {"metric": "nodal_error", "statistic": None, "truth": 0.0, "within": 1e-9}
    measures = [Measure("nodal_error", "max", "1", np.array([0.0, 2e-9, 0.0]))]
    found = verdict(resolved(expectation(**one)), measures, NUMBERS)
    assert (found.word, found.frame, found.within) == ("fail", 10, 1e-9)
    scalar(**one)
    scalar(**one | {"truth": "0.5"})
    with pytest.raises(InputError, match=r'expect\[0\].truth: got "1 mm", want a number, such as "0.5"'):
        scalar(**one | {"truth": "1 mm"})
    with pytest.raises(InputError, match=r"expect\[0\].within: got 0.5, want a fraction with its unit"):
        checked(within=0.5)
    with pytest.raises(
        InputError, match=r'expect\[0\]: metric and statistic: got "volume", want one of .*volume.deviation'
    ):
        checked(statistic=None)


def reference(status: str = "converged", **scalars: list[float]) -> Run:
    values = {name: np.array(each) for name, each in scalars.items()}
    positions = np.broadcast_to(TRIANGLE.points, (3, 3, 3))
    return Run("reference", "fenicsx", Outcome(status, ""), (0, 10, 20), TRIANGLE, positions, scalars=values)


def test_a_run_that_recorded_nothing_wrong_is_not_doubted() -> None:
    assert doubts(reference()) == []
    fine = {"negative_modes": [0, np.nan, 0], "min_det_F": [1, 0.5, 0.11], "outside_law": [0, 0, np.nan]}
    assert doubts(reference(**fine, energy_gap=[0, 0.9 * ENERGY_GAP, np.nan])) == []


@pytest.mark.parametrize(
    ("scalars", "why"),
    [
        ({"negative_modes": [0, 1, 2]}, "unstable equilibrium in 2 of 3 frames"),
        ({"min_det_F": [1, 0.5, 0.2], "min_det_F_quadrature": [1, 0.05, 0.4]}, "det F falls to 0.0500"),
        (
            {"outside_law": [0, 1, 1]},
            "cells are outside the intended range of a law in 2 of 3 frames, first in frame 10",
        ),
        ({"energy_gap": [0, -0.135, 0.1]}, "the energy changed by -13.5 % without work at frame 10"),
    ],
)
def test_each_reason_says_where(scalars: dict[str, list[float]], why: str) -> None:
    (found,) = doubts(reference(**scalars))
    assert found.startswith(why)


def test_what_ended_early_and_is_unstable_has_both_reasons() -> None:
    assert doubts(reference("timed out", negative_modes=[1, 0, 0])) == [
        "timed out",
        "unstable equilibrium in 1 of 3 frames",
    ]
