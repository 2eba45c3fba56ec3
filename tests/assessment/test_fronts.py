"""Fronts of error against cost: which points none other beats, what half the error costs, who is best at the same cost or error."""

import math

import pytest
from studied import COST, ERROR, point

from fem_reference.assessment.fronts import levels, match, pareto, price, solvers


def test_a_point_is_on_the_front_unless_another_is_as_cheap_and_nearer() -> None:
    best, middle, fast = point(1, 10), point(3, 2), point(8, 1)
    dominated, failed, unknown = point(4, 2), point(0.1, 0.1, status="diverged"), point(math.nan, 0.1)
    assert pareto([dominated, best, failed, fast, unknown, middle], ERROR, COST) == (fast, middle, best)


def test_a_point_as_good_as_another_is_not_on_the_front_twice() -> None:
    assert len(pareto([point(1, 1), point(1, 1), point(1, 2)], ERROR, COST)) == 1


@pytest.mark.parametrize("order", [0.5, 1.0, 2.0])
def test_half_the_error_costs_two_to_the_inverse_order(order) -> None:
    # error = cost^-order, so that half the error takes 2^(1/order) times the cost.
    points = [point(cost**-order, cost) for cost in (1, 3, 10, 40)]
    found = price(points, "pbd", ERROR, COST)
    assert found is not None
    assert found.factor == pytest.approx(2 ** (1 / order))
    assert (found.best, found.worst) == pytest.approx((40**-order, 1))


def test_there_is_no_price_where_more_cost_does_not_help() -> None:
    found = price([point(5, 1), point(5.5, 2), point(4.9, 30)], "pbd", ERROR, COST)
    assert found is not None
    assert math.isnan(found.factor)
    assert price([point(5, 1)], "xpbd", ERROR, COST) is None


def test_solvers_are_compared_at_most_at_what_is_asked() -> None:
    points = [point(8, 1), point(2, 4), point(1, 100), point(3, 3, "arap"), point(0.5, 50, "fem")]
    at_five = match(points, ERROR, COST, same=COST, at=5)
    assert {name: one.errors[ERROR] for name, one in at_five.best.items()} == {"pbd": 2, "arap": 3}
    at_four = match(points, ERROR, COST, same=COST, at=4)  # what costs just as much is within it
    assert at_four.best["pbd"].errors[ERROR] == 2
    within_two = match(points, ERROR, COST, same=ERROR, at=2)
    assert {name: one.costs[COST] for name, one in within_two.best.items()} == {"pbd": 4, "fem": 50}
    assert solvers(points) == ("pbd", "arap", "fem")
    alike = [point(2, 9), point(2, 3)]  # equally near
    assert match(alike, ERROR, COST, same=COST, at=10).best["pbd"] is alike[1]


def test_levels_are_round_and_within_the_range() -> None:
    points = [point(0.03, 1), point(7, 0.001)]
    assert levels(points, ERROR, COST, same=ERROR, count=9) == pytest.approx((0.05, 0.1, 0.2, 0.5, 1, 2, 5))
    assert levels([], ERROR, COST, same=ERROR) == ()
