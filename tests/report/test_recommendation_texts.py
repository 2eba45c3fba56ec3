"""A recommended setting in words: its error with the bar of the truth, and the reason where none is near enough."""

import math
from dataclasses import replace

import pytest

from fem_reference.assessment.fronts import LOAD, Point
from fem_reference.assessment.recommendation import recommend
from fem_reference.report.recommendation_texts import facts, text
from tests.assessment.test_recommendation import RMS, features, own_study


def said(bar: float, **limits: float) -> str:
    """The words on the case that was studied."""
    found = recommend(features(50), "bar", [own_study(features(50), bar=bar)], RMS, limits)
    return text(found, "bar", RMS, "mm", limits.get("error", math.inf))


@pytest.mark.parametrize(
    ("bar", "words"),
    [
        (
            2.0,
            "surface deviation, rms at most 7 mm (5 mm measured, and 2 mm, the error bar of the truth), 3 ms a frame",
        ),
        (0.0, "surface deviation, rms at most 5 mm (as measured: the truth has no error bar), 3 ms a frame"),
    ],
)
def test_an_error_is_shown_with_the_bar_and_without(bar: float, words: str) -> None:
    assert said(bar, error=7.0) == f"pbd: sweeps = 3\n{words}, measured on it"


def test_the_reason_is_the_bar_where_it_is() -> None:
    assert "without the bar, the error would be within 2.50 mm" in said(2.0, error=2.5, time=0.01)
    assert "the error bar of the truth is 2 mm" in said(2.0, error=1.0)
    nearest = said(2.0, time=0.0005)
    assert nearest.splitlines()[1] == "the nearest: pbd: sweeps = 1"
    assert "bar it would" not in nearest


def test_times_of_a_machine_that_was_busy_carry_a_warning() -> None:
    """Of those of the study, and of the setting itself; a load that is not known is none."""
    case = own_study(features(50))
    loads = dict(zip((1, 3, 10), (0.5, 0.05, 0.9), strict=True))

    def timed(point: Point) -> Point:
        load = loads.get(point.choice.get("sweeps"))
        return point if load is None else replace(point, costs=point.costs | {LOAD: load})

    busy = replace(case, points=tuple(map(timed, case.points)))
    count = sum(point.at(RMS, "seconds_per_frame") is not None for point in busy.certain)
    for limits, own in (({"time": 0.005}, ""), ({"time": 0.02}, " (this one: 90 %)")):
        found = recommend(features(50), "bar", [busy], RMS, limits)
        last = text(found, "bar", RMS, "mm", math.inf).splitlines()[-1]
        warning = f"2 of {count} times were measured while other processes kept 50 % to 90 % of the machine busy"
        assert last == f"{warning}: undisturbed runs take less time{own}"
        assert facts(found, RMS)["timed_under_load"] == 2
        assert facts(found, RMS)["load_by_others"] == (0.9 if own else 0.05)
    assert "busy" not in text(recommend(features(50), "bar", [case], RMS, {"time": 0.02}), "bar", RMS, "mm", math.inf)


def test_facts_have_the_nearest_where_none_is_good_enough() -> None:
    found = recommend(features(50), "bar", [own_study(features(50), bar=2.0)], RMS, {"error": 2.5, "time": 0.01})
    table = facts(found, RMS)
    assert (table["recommended"], table["error"], table["settings_considered"]) == (None, None, 4)
    assert table["nearest"] == {
        "choice": {"solver": "pbd", "sweeps": 10},
        "error": 3.0,
        "bar": 2.0,
        "seconds_per_frame": 0.01,
    }
