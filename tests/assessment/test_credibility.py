"""Grades follow from comparisons, each comparison from its result, and the stated evidence names what exists."""

import math
import re
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
from fem_reference.scenes.case import HOME
from fem_reference.verification import runner
from tests.verification.stand_ins import entry

CLAIM = Evidence(
    name="Stress", unit="kPa", verified=("blocks",), closed_forms="Blocks", other_codes="none", bar="1 kPa"
)
SARCOMERES = tuple(find("chen_2016", "sarcomere_length", f"{angle} deg") for angle in (110, 50))
QUOTED = (find("van_loocke_2006", "poisson_ratio", "both strains across"),)


def measured(value: float, known=SARCOMERES, **changes) -> Result:
    one = entry("cube", kind="experiment", pinned=value, facts=known, **changes)
    return result(one, Finding(value), 0.0, with_negative_control=False)


def graded(*beside: Beside) -> Row:
    return Row(CLAIM, {}, (), (), beside)


def arms(low: float, high: float, published: tuple[float, float], muscle: str = "gluteus_maximus") -> ArmsBeside:
    """A measured curve where both sides of what was published are the same, else the range of a model."""
    at, kind = np.arange(0.0, 20.0, 2.0), "measurement" if published[0] == published[1] else "model"
    sides = [ArmRange(at, np.full(10, one), np.full(10, other)) for one, other in ((low, high), published)]
    names = ("case", muscle, "extension", "someone", "coarse")
    return ArmsBeside(*names, sides[0], np.full(10, (low + high) / 2), sides[1], 0.1, kind)


def found() -> Credibility:
    """A small whole: a quantity of each grade, with arms, a fit and a case left out."""
    within, outside = of_result(measured(1.02)), of_result(measured(1.5))
    order = of_result(measured(1.0, truth=1.0, within=0.5, is_order=True))
    order = replace(order, name="cube_softest_midway")
    quoted = of_result(measured(1.02, known=QUOTED))
    besides = [of_arms(arms(10, 20, (15, 15))), of_arms(arms(10, 20, (15, 30), "iliacus"))]
    rows = [graded(within, order), graded(quoted), graded(within, outside, *besides), graded()]
    named = [
        replace(one, claim=CLAIM.model_copy(update={"name": f"Q{i}", "arms": i == 2})) for i, one in enumerate(rows)
    ]
    fit = Fitted(
        "two springs", {"k [MPa]": (0.5, (0.1, 0.2))}, {"cube": 1.04}, ("cube",), converged=True, evaluations=9
    )
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
    assert asked.grade == "not compared", "without the data a quantity is no better than with it"
    assert graded(within).grade == "validated"
    assert graded(quoted).grade == "indicative"
    assert graded(quoted, within).grade == "validated"
    assert graded(within, outside).grade == "outside"
    assert [one.grade for one in found().rows] == ["validated", "indicative", "outside", "verified only"]


@pytest.mark.parametrize(
    ("known", "from_memory"),
    [((), False), (QUOTED, False), ((*SARCOMERES, *QUOTED), False), (SARCOMERES, True)],
)
def test_what_is_quoted_remembered_or_unknown_never_validates(known, from_memory) -> None:
    one = of_result(measured(1.02, known=known, from_memory=from_memory))
    assert one.met
    assert not one.validates
    assert of_result(measured(1.02)).validates


def test_what_a_comparison_rests_on_is_said() -> None:
    """The worst text that one of its numbers was read in; a tolerance where one has no deviation, but not of an order."""
    assert of_result(measured(1.0)).rests_on == "abstract"
    assert of_result(measured(1.0, from_memory=True)).rests_on == "abstract; a part of the model from memory"
    assert of_result(measured(1.0, known=(*SARCOMERES, *QUOTED))).rests_on == "quotation; ± chosen by us"
    assert of_result(measured(1.0, known=QUOTED, from_memory=True)).rests_on == "quotation; ± chosen by us", (
        "of the DOI"
    )
    assert of_result(measured(1.0, known=QUOTED, is_order=True)).rests_on == "quotation"
    assert of_result(measured(1.0, known=())).rests_on == "not known; ± chosen by us"
    assert [of_result(measured(1.0, known=known)).experiment for known in (QUOTED, ())] == ["van_loocke_2006", ""]


def test_neither_a_number_nor_a_word_of_a_source_is_a_mode() -> None:
    """A ratio of 1 known to a half is a number, and a source may bear the word memory."""
    one = of_result(measured(1.25, within=0.5, source="A memory of muscles"))
    assert not one.is_order
    assert one.validates
    assert graded(one).misses == (0.5,)
    order = of_result(measured(0.0, within=0.6, is_order=True))
    assert order.is_order
    assert graded(order).misses == ()


def test_what_is_from_memory_and_what_is_an_order_is_stated_by_the_catalogue() -> None:
    entries = [one for one in runner.entries().values() if one.kind == "experiment"]
    found = [result(one, Finding(one.pinned), 0.0, with_negative_control=False) for one in entries]
    beside = {one.entry.name: of_result(one) for one in found}
    orders = {"cube_softest_midway", "cube_stiffest_across", "cube_both_orders", "cube_both_orders_collagen"}
    assert {name for name, one in beside.items() if one.is_order} == orders
    assert not [name for name, one in beside.items() if one.validates]
    for one in entries:
        assert one.from_memory == ("memory" in one.source), one.name


def test_other_models_are_counted_apart_and_decide_no_grade() -> None:
    """The curve of a measurement is inside in all poses or outside, however many a model reaches; a model's range says neither."""
    near, far = of_arms(arms(10, 40, (15, 30), "iliacus")), of_arms(arms(10, 20, (15, 30), "iliacus"))
    inside, beyond = of_arms(arms(10, 20, (15, 15))), of_arms(arms(10, 20, (25, 25)))
    one = graded(inside, near, far)
    assert (one.measured, one.models, one.grade) == ((1, 1), (1, 2), "indicative")
    assert graded(beyond, near).grade == "outside"
    assert graded(near).grade == "verified only"
    assert replace(graded(far), claim=CLAIM.model_copy(update={"arms": True})).grade == "not compared"
    assert len(one.misses) == 1, "the bias is that from measurements"


def test_nine_tenths_of_the_poses_are_not_all() -> None:
    """The fibres of another model contain the measured arm in 91 % of poses; that is no measure of a muscle."""
    made = arms(10, 20, (15, 15))
    published = np.where(made.found.angles < 17, 15.0, 25.0)
    one = of_arms(replace(made, published=ArmRange(made.found.angles, published, published)))
    assert (one.value, one.truth, one.met) == (pytest.approx(90), 100, False)


def test_a_remark_has_the_values_of_coarser_meshes_and_the_source() -> None:
    one = replace(
        measured(1.02), finding=Finding(1.02, ladder=((2.0, 1.04), (1.0, 1.02)), note="Twice the load steps.")
    )
    assert of_result(one).remark == "Cells of 2 mm give 1.04. Twice the load steps. Compared with: by hand."
    assert of_result(measured(1.02)).remark == "Compared with: by hand."


def test_a_remark_counts_the_poses_in_which_the_published_arm_is_known() -> None:
    made = arms(10, 20, (15, 15))
    published = np.where(made.found.angles < 6, 15.0, np.nan)
    partly = replace(made, published=ArmRange(made.found.angles, published, published))
    assert partly.known == 3
    assert "over the 3 of 10 poses in which the published arm is known" in of_arms(partly).remark


def test_a_value_that_has_moved_or_is_not_a_number_is_not_met() -> None:
    moved = result(
        entry("cube", kind="experiment", pinned=1.0, facts=SARCOMERES), Finding(1.01), 0.0, with_negative_control=False
    )
    assert not of_result(moved).met
    assert not of_result(measured(math.nan)).met


def test_bias_and_scatter_are_over_the_uncertainties_without_orders() -> None:
    """Misses of 0.02 and 0.5 over 0.1: 0.2 and 5."""
    within, outside = of_result(measured(1.02)), of_result(measured(1.5))
    order = replace(within, is_order=True)
    one = graded(within, outside, order)
    assert (one.bias, one.scatter) == pytest.approx((2.6, 2.4))
    assert math.isnan(graded().bias)


def test_arms_are_asked_for_what_others_reach_on_this_body() -> None:
    assert of_arms(arms(10, 20, (15, 15))).value == 100
    assert of_arms(arms(10, 20, (15, 15))).met
    assert not of_arms(arms(10, 20, (25, 25))).met
    assert of_arms(arms(10, 20, (15, 30), "iliacus")).value == pytest.approx(100 / 3)
    assert not of_arms(arms(10, 20, (15, 15))).validates
    made = arms(10, 20, (15, 15))
    assert of_arms(replace(made, case="another")).title != of_arms(made).title, "two cases of one muscle are told apart"
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


def test_stated_bars_are_those_of_the_page_of_error_bars() -> None:
    """From the least to the greatest of the shipped cases in the table of that page; the stress of the one case in its text."""
    text = (HOME / "docs" / "error_bars.md").read_text(encoding="utf-8")
    table = text.partition("## The shipped cases\n")[2].partition("\n## ")[0]
    rows = [[cell.strip() for cell in line.strip("|").split("|")] for line in table.splitlines() if line[:1] == "|"]
    head, _, *cases = rows
    assert len(cases) == 7
    stated = {one.name: one.bar for one in claims()}
    columns = {"Volume": "volume", "Fibre length": "fibre length, rms", "Surface": "surface, rms"}
    for name, column in columns.items():
        (at,) = [i for i, title in enumerate(head) if title.endswith(column)]
        bars = sorted((row[at].removeprefix("± ").split()[0] for row in cases), key=float)
        assert stated[name].startswith(f"{bars[0]} to {bars[-1]} "), name
    bar, value, where = re.fullmatch(r"± (\S+) kPa on a mean of (\S+) kPa \((\w+)\)", stated["Stress"]).groups()
    (said,) = [one for one in text.split("\n\n") if "mean stress along the fibres" in one]
    assert f"the mean stress along the fibres is {value} ± {bar} kPa" in " ".join(said.split())
    assert f"`{where}`" in said
    assert {bar for name, bar in stated.items() if name not in (*columns, "Stress")} == {
        "measured by --error-bar for each case",
        "none: cubes are homogeneous",
    }


def test_parameters_are_inside_only_where_all_ranges_say_so() -> None:
    def inside(*parameters) -> bool | None:
        return Fitted("law", {str(i): one for i, one in enumerate(parameters)}, {}, (), True, 1).inside

    assert inside((1.0, (0.5, 2.0)), (9.0, None)) is True
    assert inside((1.0, (0.5, 2.0)), (9.0, (1.0, 2.0))) is False
    assert inside((1.0, None)) is None
