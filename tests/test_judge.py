"""Pass, fail and cannot say; and that what is expected is read strictly."""

from types import SimpleNamespace

import numpy as np
import pytest

from fem_reference.assessment.judge import check, judge, overall, verdict
from fem_reference.foundations.errors import InputError
from fem_reference.metrics import Measure
from fem_reference.scenes.muscle import Expectation

NUMBERS = (0, 10, 20)


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


def checked(**changes) -> None:
    check(SimpleNamespace(expect=(expectation(**changes),), place="case.toml", frames=SimpleNamespace(numbers=NUMBERS)))


def test_pass_only_within_the_tolerance() -> None:
    assert judge(1.0, 1.0, 0.0) == "pass"
    assert judge(1.11, 1.0, 0.1) == "fail"
    assert judge(0.89, 1.0, 0.1) == "fail"


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
def test_what_is_not_a_number_never_passes(value) -> None:
    assert judge(value, 0.0, 1e9) == "fail"
    assert judged([0, value, 0]).word == "fail"
    assert judged([0, value, 0]).frame == 10


def test_cannot_say_when_the_truth_is_known_too_badly() -> None:
    assert judge(5.0, 0.0, 0.3, error_bar=0.11) == "cannot say"
    assert judge(5.0, 0.0, 0.3, error_bar=0.09) == "fail"


def test_overall() -> None:
    assert overall(["pass", "cannot say", "fail"]) == "fail"
    assert overall(["pass", "cannot say"]) == "cannot say"
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


def test_a_tolerance_below_zero_is_refused() -> None:
    with pytest.raises(InputError, match=r'expect\[0\].within: got "-0.5 %", want a tolerance of at least zero'):
        checked(within="-0.5 %")


def test_a_verdict_is_only_on_frames_whose_error_bar_is_a_third_of_the_tolerance() -> None:
    def with_bars(values, bars, **changes):
        measure = Measure("volume", "deviation", "%", np.array(values))
        return verdict(expectation(**changes), [measure], NUMBERS, np.array(bars))

    found = with_bars([0.1, -0.4, 0.2], [0.0, 0.1, 0.16])
    assert (found.word, found.frame, found.error_bar) == ("pass", 10, 0.1)
    found = with_bars([0.1, -0.4, 0.2], [0.0, 0.1, 0.17])
    assert (found.word, found.frame, found.error_bar) == ("cannot say", 20, 0.17)
    found = with_bars([0.1, -0.4, 0.2], [0.3, np.nan, 0.17])
    assert (found.word, found.frame, np.isnan(found.error_bar)) == ("cannot say", 10, True)
    # What is told apart from the truth in one frame is told.
    found = with_bars([0.1, -0.6, 0.2], [0.0, 0.1, 0.3])
    assert (found.word, found.frame) == ("fail", 10)
    assert with_bars([0.1, -0.4, 0.2], [0.0, 0.1, 9.0], frame=10).word == "pass"
    assert judged([0.1, -0.4, 0.2]).error_bar is None


def test_a_truth_known_to_nobody_knows_what_judges_nothing() -> None:
    assert judge(0.0, 0.0, 1.0, error_bar=float("nan")) == "cannot say"


def test_a_measure_that_does_not_exist_is_named() -> None:
    with pytest.raises(
        InputError, match=r'expect\[0\]: metric and statistic: got "volume.median", want one of .*volume.deviation'
    ):
        checked(statistic="median")
