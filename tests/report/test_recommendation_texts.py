"""A recommended setting in words: its error, its time, and the reason where none meets the limit."""

import json

import pytest

from fem_reference.assessment.fronts import Point
from fem_reference.assessment.recommendation import Expected, Margins, Recommendation
from fem_reference.report import recommendation_texts

NAME = "surface_deviation.rms"
POINT = Point("hip", "pbd", "pbd", "sweeps", "8", {"solver": "pbd", "sweeps": 8}, "converged", "", {NAME: 1.5}, {})
ONE = Expected(POINT, 2.0, 0.25, ("hip",), 0.5)


def text(found: Recommendation, limit: float = float("inf")) -> list[str]:
    return recommendation_texts.text(found, "hip", NAME, "mm", limit).splitlines()


def test_a_setting_that_was_measured_on_the_case_has_its_error_in_parts() -> None:
    found = Recommendation(ONE, None, 7, Margins(), ("hip",), measured=True)
    parts = "(1.50 mm measured, and 0.500 mm, the error bar of the truth)"
    error = f"surface deviation, rms at most 2 mm {parts}, 250 ms a frame, measured on it"
    assert text(found) == ["pbd: sweeps = 8", error]
    facts = json.loads(json.dumps(recommendation_texts.facts(found, NAME), allow_nan=False))
    assert (facts["recommended"], facts["error"], facts["bar"], facts["nearest"]) == (POINT.choice, 2.0, 0.5, None)


def test_what_is_expected_from_other_cases_names_them_and_the_margins() -> None:
    found = Recommendation(ONE, None, 7, Margins(1.5, 2.0), ("knee", "jaw"), measured=False)
    *_, error, margins = text(found)
    assert error.endswith("expected from knee and jaw, the studied cases most like it")
    assert margins == "margins in it: 1.50 times the error, 2 times the time"
    assert recommendation_texts.facts(found, NAME)["bar"] is None


@pytest.mark.parametrize(
    ("limit", "reason"),
    [
        (0.4, "the truth is known no better than 0.500 mm: nothing can be said to be nearer than that"),
        (1.8, "without the bar it would be within the 1.80 mm: the truth is not known well enough to say so"),
    ],
)
def test_where_none_meets_the_limit_the_nearest_and_the_reason_are_named(limit: float, reason: str) -> None:
    lines = text(Recommendation(None, ONE, 7, Margins(), ("hip",), measured=True), limit)
    assert lines[0] == "none of 7 settings meets what is asked on hip (measured on it)"
    assert lines[1] == "the nearest: pbd: sweeps = 8"
    assert lines[-1] == reason


def test_without_any_setting_one_sentence_stands_there() -> None:
    found = Recommendation(None, None, 0, Margins(), ("hip",), measured=True)
    assert text(found) == ["none of 0 settings meets what is asked on hip (measured on it)"]
    assert recommendation_texts.facts(found, NAME)["recommended"] is None
