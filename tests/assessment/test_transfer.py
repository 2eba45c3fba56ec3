"""Settings that are the same on several cases, and good ones of some cases on the case that was left out."""

from dataclasses import replace

import pytest
from studied import COST, ERROR, point

from fem_reference.assessment.cost_study import CaseStudy
from fem_reference.assessment.fronts import Point
from fem_reference.assessment.recommendation import is_elsewhere, setting, tetrahedra, transfers


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


def chosen(**choice) -> Point:
    return Point("bar", "fenicsx", "fenicsx", "knob", "value", {"solver": "fenicsx"} | choice, "converged", "")


def sized(tet_size: float, refinements: float) -> CaseStudy:
    features = {"tet_size": tet_size, "refinements": refinements}
    return CaseStudy("bar", "A bar", "its reference", (), {}, {}, (), 100, 1.0, features)


def on(size: float, refinements: int) -> Point:
    return chosen(scene={"muscle.tet_size": f"{size} mm", "muscle.refinements": refinements})


def test_tetrahedra_count_by_their_size_in_that_of_the_case() -> None:
    assert tetrahedra(on(12.0, 0), sized(6.0, 1.0)) == (2.0, 1.0)
    assert setting(on(12.0, 0), sized(6.0, 1.0)) == setting(on(8.0, 1), sized(4.0, 2.0))
    assert setting(on(12.0, 0), sized(6.0, 1.0)) != setting(on(12.0, 0), sized(4.0, 1.0))


def test_values_of_a_scene_are_its_own_but_for_its_mesh() -> None:
    assert is_elsewhere(chosen(iterations=4))
    assert is_elsewhere(on(8.0, 1))
    assert is_elsewhere(chosen(scene={"triangles": "4 times"}))
    own = chosen(scene={"effect[0].mu": "10 kPa"})
    assert not is_elsewhere(own)
    assert setting(own, sized(6.0, 1.0)) == "bar: knob = value"


def test_settings_are_named_in_one_order() -> None:
    one, other = chosen(iterations=4, first=1.0), chosen(first=1.0, iterations=4)
    assert setting(one, sized(6.0, 1.0)) == setting(other, sized(4.0, 1.0)) == "fenicsx: first = 1.0, iterations = 4"
    assert setting(chosen(scene={"triangles": "4 times"}), sized(6.0, 1.0)).startswith(
        "fenicsx: 4 times as many triangles"
    )
