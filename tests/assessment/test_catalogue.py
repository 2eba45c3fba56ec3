"""An entry is measured with what is given or what is wrong, over its refinement, and beside its truth."""

import math

import pytest

from fem_reference.assessment.catalogue import Finding, Refinement, Verification, order, result
from tests.verification.stand_ins import entry


def square(_, count, height, power=2):
    """``1 + height / count^power``."""
    return 1 + height / count**power


def test_what_is_wrong_replaces_a_part_of_what_is_given() -> None:
    one = entry("sum", lambda _, a, b: a + b, given={"a": 1.0, "b": 2.0}, wrong={"b": 4.0})
    assert one.find(None).value == 3.0
    assert one.find(None, with_negative_control=True).value == 5.0


def test_a_measurement_may_be_a_finding_with_a_note() -> None:
    assert entry("noted", lambda _: Finding(1.0, note="a note")).find(None).note == "a note"


def test_a_ladder_ends_with_its_finest_mesh() -> None:
    # 1 + h^2 of h = 2 and 1 falls at order 2 to 1.
    one = entry("bar", square, given={"height": 4.0}, wrong={}, refinement=Refinement((1, 2), 2.0, order=2))
    found = one.find(None)
    assert (found.value, found.order, found.ladder) == (2.0, 2.0, ((2.0, 5.0), (1.0, 2.0)))


def test_a_negative_control_is_measured_on_the_finest_mesh_alone() -> None:
    asked = []

    def noted(_, count, height):
        asked.append(count)
        return height

    one = entry(
        "bar", noted, given={"height": 1.0}, wrong={"height": 2.0}, refinement=Refinement((1, 2, 4), 1.0, order=2)
    )
    found = one.find(None, with_negative_control=True)
    assert (found.value, found.order, found.ladder, asked) == (2.0, None, (), [4])


def test_an_error_of_first_order_is_extrapolated_away() -> None:
    refinement = Refinement((1, 2, 4), 1.0, order=1, extrapolated=True, note="steps")
    one = entry("creep", square, given={"height": 3.0, "power": 1}, wrong={"height": 6.0}, refinement=refinement)
    found = one.find(None)
    assert (found.value, found.order, found.note) == (1.0, 1.0, "steps")
    assert [value for _, value in found.ladder] == [4.0, 2.5, 1.75]
    assert one.find(None, with_negative_control=True).value == 1.0


def test_without_an_order_none_is_measured() -> None:
    one = entry("bar", square, given={"height": 4.0}, wrong={}, refinement=Refinement((1, 2), 2.0, order=None))
    assert one.find(None).order is None


@pytest.mark.parametrize(("relative", "within"), [(False, 0.1), (True, 0.2)])
def test_the_tolerance_is_of_the_size_of_the_truth_where_it_is_relative(relative, within) -> None:
    one = entry("bar", truth=lambda: -2.0, relative=relative)
    found = result(one, Finding(-2.15), 1.0, with_negative_control=False)
    assert (found.truth, found.within, found.word) == (-2.0, within, "pass" if relative else "fail")
    assert found.error == pytest.approx(0.15, abs=1e-15)
    assert result(one, Finding(math.nan), 1.0, with_negative_control=False).word == "fail"


@pytest.mark.parametrize(
    ("value", "truth", "pinned", "word"),
    [
        (1.02, 1.0, 1.02, "within"),
        (1.2, 1.0, 1.2, "outside"),
        (1.02, 1.0, 1.03, "fail"),  # within, but not what it was
        (1.2, 1.0, 1.0, "fail"),
        (0.0, 1.0, 0.0, "outside"),
        (1e-9, 1.0, 0.0, "fail"),
        (math.nan, 1.0, 1.0, "fail"),
        (1.0, math.nan, 1.0, "inconclusive"),
        (1.02, 1.0, math.nan, "fail"),
    ],
)
def test_an_experiment_is_met_or_not_and_fails_only_where_its_value_has_moved(value, truth, pinned, word) -> None:
    one = entry("cube", truth=truth, kind="experiment", pinned=pinned)
    assert result(one, Finding(value), 1.0, with_negative_control=False).word == word


def test_a_verification_with_experiments_outside_passes_and_says_how_many_are_met() -> None:
    ones = [
        entry("a", truth=1.0),
        *(entry(name, truth=1.0, kind="experiment", pinned=v) for name, v in (("b", 1.0), ("c", 9.0))),
    ]
    found = [
        result(one, Finding(v), 1.0, with_negative_control=False) for one, v in zip(ones, (1.0, 1.0, 9.0), strict=True)
    ]
    whole = Verification(tuple(found), 1.0, {})
    assert (whole.word, whole.failed) == ("pass", ())
    assert "1 of 1 pass, 1 of 2 experiments agree within their uncertainty" in whole.summary
    assert "experiments" not in Verification(tuple(found[:1]), 1.0, {}).summary


def test_the_order_is_the_slope_of_the_last_two_errors() -> None:
    # An error of 3 h^2.5 about a truth of 2; rounding of numbers near 2 over the smaller error, 3e-16 / 3e-3.
    ladder = tuple((h, 2 + 3 * h**2.5) for h in (0.25, 0.125, 0.0625))
    assert order(ladder, 2.0) == pytest.approx(2.5, abs=1e-12)
    assert order(((1.0, 2.5), (0.5, 2.0)), 2.0) is None
