"""Fronts of error against cost: which points none other beats, what half the error costs, who is best at the same cost or error."""

import math
from dataclasses import replace

import pytest

from fem_reference.assessment.cost_study import CaseStudy
from fem_reference.assessment.fronts import Point, at_same_cost, at_same_error, levels, pareto, price, solvers
from fem_reference.assessment.transfer import transfers

ERROR, COST = "surface_deviation.rms", "seconds_per_frame"


def point(
    error: float, cost: float, solver: str = "pbd", case: str = "hip", value: str = "", status: str = "converged"
) -> Point:
    found = {"errors": {ERROR: error}, "costs": {COST: cost}}
    return Point(case, solver, solver, "sweeps" if value else "", value, {"sweeps": value}, status, "", **found)


def studies(points: list[Point]) -> list[CaseStudy]:
    """What was measured on each case, whose tetrahedra are of other sizes."""
    cases = sorted({one.case for one in points})
    return [
        CaseStudy(
            case,
            case,
            "",
            tuple(one for one in points if one.case == case),
            {ERROR: "mm"},
            {},
            (),
            1000,
            1.0,
            {"tet_size": 6.0 + i, "refinements": 1.0},
        )
        for i, case in enumerate(cases)
    ]


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
    at_five = at_same_cost(points, ERROR, COST, 5)
    assert {name: one.errors[ERROR] for name, one in at_five.best.items()} == {"pbd": 2, "arap": 3}
    at_four = at_same_cost(points, ERROR, COST, 4)  # what costs just as much is within it
    assert at_four.best["pbd"].errors[ERROR] == 2
    within_two = at_same_error(points, ERROR, COST, 2)
    assert {name: one.costs[COST] for name, one in within_two.best.items()} == {"pbd": 4, "fem": 50}
    assert solvers(points) == ("pbd", "arap", "fem")
    alike = [point(2, 9), point(2, 3)]  # equally near
    assert at_same_cost(alike, ERROR, COST, 10).best["pbd"] is alike[1]


def test_levels_are_round_and_within_the_range() -> None:
    points = [point(0.03, 1), point(7, 0.001)]
    assert levels(points, ERROR, COST, of_error=True, count=9) == pytest.approx((0.05, 0.1, 0.2, 0.5, 1, 2, 5))
    assert levels([], ERROR, COST, of_error=True) == ()


def test_settings_chosen_on_other_cases_lose_what_is_best_on_this_one() -> None:
    # On a and b eight sweeps are best, on c two are; chosen on the others, eight are tried on c.
    table = {"a": (4.0, 1.0), "b": (3.0, 1.0), "c": (1.0, 2.0)}
    points = [
        point(error, 1, case=case, value=value)
        for case, errors in table.items()
        for value, error in zip("28", errors, strict=True)
    ]
    found = {one.left_out: one for one in transfers(studies(points), ERROR)}
    assert found["c"].chosen.endswith("sweeps = 8")
    assert found["c"].loss == pytest.approx(1.0)
    assert found["a"].loss == pytest.approx(0.0)


def test_a_case_left_out_has_no_say_in_what_is_chosen_for_it() -> None:
    # On a and b eight sweeps are a little better, on c two are a hundred times: with a say, c would have two.
    table = {"a": (1.0, 0.9), "b": (1.0, 0.9), "c": (0.01, 1.0)}
    points = [
        point(error, 1, case=case, value=value)
        for case, errors in table.items()
        for value, error in zip("28", errors, strict=True)
    ]
    (found,) = (one for one in transfers(studies(points), ERROR) if one.left_out == "c")
    assert found.chosen.endswith("sweeps = 8")
    assert found.loss == pytest.approx(99.0)


def test_settings_that_failed_on_a_case_are_not_chosen() -> None:
    points = [point(1, 1, case=case, value="2") for case in "abc"]
    points += [point(0.1, 1, case=case, value="8", status="diverged" if case == "c" else "converged") for case in "abc"]
    assert all(one.chosen.endswith("sweeps = 2") for one in transfers(studies(points), ERROR))


def test_tetrahedra_are_the_same_setting_where_they_are_as_large_in_those_of_the_case() -> None:
    def coarse(case: str, size: float, error: float) -> Point:
        choice = {"solver": "fem", "scene": {"muscle.tet_size": f"{2 * size:g} mm", "muscle.refinements": 1}}
        return Point(
            case, "fem", "fem", "tetrahedra", f"{size:g} mm", choice, "converged", "", {ERROR: error}, {COST: 1.0}
        )

    points = [coarse(case, 6.0 + i, 1.0 + i) for i, case in enumerate("abc")]
    found = {one.left_out: one for one in transfers(studies(points), ERROR)}
    assert {case: one.error for case, one in found.items()} == {"a": 1.0, "b": 2.0, "c": 3.0}
    assert found["b"].chosen == "tetrahedra = 7 mm"


def test_a_value_of_the_scene_itself_is_no_setting_of_another_case() -> None:
    softer = [
        replace(point(1, 1, case=case, value="0.1 MPa/mm"), choice={"scene": {"effect[1].stiffness": "0.1 MPa/mm"}})
        for case in "abc"
    ]
    assert transfers(studies(softer), ERROR) == ()
