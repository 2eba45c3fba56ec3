"""What to take within an error, at a rate of frames and at the knee: by the same choice as the verb recommend."""

from dataclasses import replace

import pytest
import studied

from fem_reference.assessment import answers
from fem_reference.assessment.recommendation import Expected, known_settings, recommend
from tests.assessment.test_recommendation import RMS, features, study


def settings(*pairs: tuple[float, float], solver: str = "pbd") -> list[Expected]:
    """Settings with an error and a time each."""
    return [
        Expected(studied.point(error, time, solver, value=str(time)), error, time, ("hip",)) for error, time in pairs
    ]


def test_each_request_is_answered_for_all_and_by_each_solver() -> None:
    one = settings((8.0, 0.01), (4.0, 0.02), (0.9, 0.5))
    other = settings((5.0, 0.001), (4.9, 0.015), (3.0, 0.1), solver="arap")
    fine, coarse, rate, _ = answers.answers([*one, *other])
    assert (fine.best, fine.by_solver) == (one[2], {"pbd": one[2]})
    assert (coarse.best, coarse.by_solver) == (other[0], {"pbd": one[1], "arap": other[0]})
    assert (rate.best, rate.by_solver) == (other[1], {"pbd": one[0], "arap": other[1]})  # within 16.7 ms


def test_where_none_meets_a_request_the_nearest_is_there() -> None:
    found = answers.answers(settings((2.0, 1.0), (20.0, 0.02)))
    assert [one.best is None for one in found] == [True, False, True, True]
    assert found[0].nearest.error == 2.0
    assert found[2].nearest.time == 0.02
    assert answers.answers([])[0].nearest is None


def test_they_are_those_of_recommend() -> None:
    case = study("a", 20)  # errors 4, 2 and 0.4 mm
    known = answers.answers(known_settings(features(20), "a", [case], RMS).settings)
    for one in known[:-1]:
        assert recommend(features(20), "a", [case], RMS, one.limits).best.point is one.best.point


def test_the_knee_is_the_corner_of_two_lines() -> None:
    """Slope -3 and then -1/3 in logarithms: the corner; what another setting beats is on no front."""
    times = (0.01, 0.02, 0.04, 0.08, 0.16)
    corner = 0.04
    pairs = [(5.0 * (time / corner) ** (-3 if time < corner else -1 / 3), time) for time in times]
    known = settings(*pairs, (30.0, 0.05), (4.9, 3.0))
    assert answers.knee(known[:-1]).time == corner
    # It is the same in other units of error and of time.
    scaled = [replace(one, error=1000 * one.error, time=60 * one.time) for one in known[:-1]]
    assert answers.knee(scaled).time == pytest.approx(60 * corner)


@pytest.mark.parametrize(
    "pairs",
    [
        [(4.0, 1.0), (2.0, 2.0)],
        [(1.0, 1.0)],
        [(4.0, 1.0), (3.9, 2.0), (1.0, 4.0)],  # above the line: more time pays late
        [(4.0, 1.0), (5.0, 2.0), (6.0, 4.0)],  # the fastest is the nearest
        [(4.0, 1.0), (4.0, 1.0), (2.0, 2.0)],
    ],
)
def test_no_knee(pairs) -> None:
    assert answers.knee(settings(*pairs)) is None
