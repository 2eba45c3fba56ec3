"""Grades follow from comparisons, each comparison from its result, and the stated evidence names what exists."""

import math
from dataclasses import replace

import numpy as np
import pytest

from fem_reference.assessment.catalogue import Finding, Refinement, Result, result
from fem_reference.assessment.credibility import (
    Beside,
    Credibility,
    Evidence,
    Fitted,
    Row,
    claims,
    of_arms,
    of_result,
    row,
)
from fem_reference.assessment.experiments import facts, find
from fem_reference.assessment.moment_arms import ArmRange, ArmsBeside
from fem_reference.assessment.muscle_cubes import QUANTITIES
from fem_reference.verification import runner
from tests.verification.stand_ins import entry

CLAIM = Evidence(
    name="Stress", unit="kPa", verified=("blocks",), closed_forms="Blocks", other_codes="none", bar="1 kPa"
)
SARCOMERES = tuple(find("chen_2016", "sarcomere_length", f"{angle} deg") for angle in (110, 50))
QUOTED = (find("van_loocke_2006", "poisson_ratio", "both strains across"),)


def measured(value: float, truth: float = 1.0, known=SARCOMERES, source: str = "chen_2016") -> Result:
    one = entry("cube", truth=truth, kind="experiment", pinned=value, facts=known, source=source)
    return result(one, Finding(value), 0.0, with_negative_control=False)


def graded(*beside: Beside) -> Row:
    return Row(CLAIM, {}, (), (), beside)


def arms(low: float, high: float, published: tuple[float, float], muscle: str = "gluteus_maximus") -> ArmsBeside:
    at = np.arange(0.0, 20.0, 2.0)
    sides = [ArmRange(at, np.full(10, one), np.full(10, other)) for one, other in ((low, high), published)]
    names = ("case", muscle, "extension", "someone", "coarse")
    return ArmsBeside(*names, sides[0], np.full(10, (low + high) / 2), sides[1], 0.1)


def found() -> Credibility:
    """A small whole: a quantity of each grade, with arms, a fit and a case left out."""
    within, outside = of_result(measured(1.02)), of_result(measured(1.5))
    order = replace(within, name="cube_softest_midway", value=1.0, truth=1.0, within=0.5)
    quoted = of_result(measured(1.02, known=QUOTED))
    rows = [graded(within, order), graded(quoted), graded(within, outside, of_arms(arms(10, 20, (15, 15)))), graded()]
    named = [
        replace(one, claim=CLAIM.model_copy(update={"name": f"Q{i}", "arms": i == 2})) for i, one in enumerate(rows)
    ]
    fit = Fitted("two springs", {"k [MPa]": (0.5, (0.1, 0.2))}, {"cube": 1.04}, ("cube",))
    return Credibility(
        tuple(named), (arms(10, 20, (15, 15)), arms(10, 20, (15, 30), "iliacus")), {"lost": "why it was"}, (fit,)
    )


def test_a_grade_is_as_good_as_the_comparisons() -> None:
    within, outside, quoted = (
        of_result(measured(1.02)),
        of_result(measured(1.5)),
        of_result(measured(1.02, known=QUOTED)),
    )
    assert graded().grade == "verified only"
    asked = replace(graded(), claim=CLAIM.model_copy(update={"arms": True}))
    assert asked.grade == "not measured", "without the data a quantity is no better than with it"
    assert graded(within).grade == "validated"
    assert graded(quoted).grade == "indicative"
    assert graded(quoted, within).grade == "validated"
    assert graded(within, outside).grade == "outside"
    assert [one.grade for one in found().rows] == ["validated", "indicative", "outside", "verified only"]


@pytest.mark.parametrize(
    ("known", "source"),
    [((), "x"), (QUOTED, "x"), ((*SARCOMERES, *QUOTED), "x"), (SARCOMERES, "x; the model's arm from memory")],
)
def test_what_is_quoted_remembered_or_unknown_never_validates(known, source) -> None:
    one = of_result(measured(1.02, known=known, source=source))
    assert one.met
    assert not one.validates
    assert of_result(measured(1.02)).validates


def test_a_value_that_has_moved_or_is_not_a_number_is_not_met() -> None:
    moved = result(
        entry("cube", kind="experiment", pinned=1.0, facts=SARCOMERES), Finding(1.01), 0.0, with_negative_control=False
    )
    assert not of_result(moved).met
    assert not of_result(measured(math.nan)).met


def test_bias_and_scatter_are_over_the_uncertainties_without_orders() -> None:
    """Misses of 0.02 and 0.5 over 0.1: 0.2 and 5."""
    within, outside = of_result(measured(1.02)), of_result(measured(1.5))
    order = replace(within, truth=1.0, within=0.5)
    one = graded(within, outside, order)
    assert (one.bias, one.scatter) == pytest.approx((2.6, 2.4))
    assert math.isnan(graded().bias)


def test_arms_are_asked_for_what_others_reach_on_this_body() -> None:
    assert of_arms(arms(10, 20, (15, 15))).value == 100
    assert of_arms(arms(10, 20, (15, 15))).met
    assert not of_arms(arms(10, 20, (25, 25))).met
    assert of_arms(arms(10, 20, (15, 30), "iliacus")).value == pytest.approx(100 / 3)
    assert not of_arms(arms(10, 20, (15, 15))).validates
    assert not of_arms(arms(math.nan, 20, (15, 15))).met


def test_a_row_counts_the_entries_behind_it_and_their_orders() -> None:
    ladder = Refinement((1, 2), 1.0, order=2)
    behind = [entry("a"), entry("b", kind="property", refinement=ladder), entry("c", group="elsewhere")]
    one = row(CLAIM, behind, {}, ())
    assert (dict(one.kinds), one.orders) == ({"closed form": 1, "property": 1}, (2,))
    with pytest.raises(LookupError, match="no group"):
        row(CLAIM.model_copy(update={"verified": ("nowhere",)}), behind, {}, ())
    with pytest.raises(KeyError):
        row(CLAIM.model_copy(update={"experiments": ("nobody",)}), behind, {}, ())


def test_the_stated_evidence_is_there() -> None:
    catalogue, scale = runner.entries(), {one.quantity for one in facts() if one.experiment == "scale"}
    groups = {one.group for one in catalogue.values()}
    for one in claims():
        assert set(one.verified) <= groups
        assert set(one.experiments) <= set(catalogue)
        assert not one.band or one.band in scale
    named = {name for one in claims() for name in one.experiments}
    assert {one.name for one in QUANTITIES} <= named, "every measured quantity of cubes counts, met or not"


def test_parameters_are_inside_only_where_all_ranges_say_so() -> None:
    def inside(*parameters) -> bool | None:
        return Fitted("law", {str(i): one for i, one in enumerate(parameters)}, {}, ()).inside

    assert inside((1.0, (0.5, 2.0)), (9.0, None)) is True
    assert inside((1.0, (0.5, 2.0)), (9.0, (1.0, 2.0))) is False
    assert inside((1.0, None)) is None
