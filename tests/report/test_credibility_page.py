"""The page of credibility and its numbers."""

import html
import json
from dataclasses import replace

import numpy as np

from fem_reference import report
from fem_reference.assessment.credibility import of_result
from fem_reference.assessment.experiments import experiments
from fem_reference.assessment.moment_arms import ArmRange
from fem_reference.report import credibility_page
from tests.assessment.test_credibility import QUOTED, arms, found, graded, measured


def test_the_page_and_its_numbers(tmp_path) -> None:
    path = report.write(credibility_page.page(found()), tmp_path / "new", "credibility")
    text, numbers = html.unescape(path.read_text()), json.loads((path.parent / "credibility.json").read_text())
    assert [one["grade"] for one in numbers["rows"]] == ["validated", "indicative", "outside", "verified only"]
    assert numbers["missing"] == {"lost": "why it was"}
    assert "why it was" in text
    assert (len(numbers["arms"]), text.count("<svg")) == (2, 2)
    assert numbers["arms"][0]["share"] == 1
    assert numbers["fits"][0]["inside"] is False
    for grade in ("validated", "indicative", "outside", "verified only"):
        assert f'">{grade}</span>' in text
    for name, record in experiments().items():
        assert name in text
        assert record.title in text
    assert "(published 0.100 to 0.200, outside)" in text
    assert ">yes</td>" in text, "an order is met or not, and no number"


def test_the_first_thing_said_is_what_is_validated_and_what_is_not(tmp_path) -> None:
    of = {grade: names for grade, names, _ in credibility_page.by_grade(found())}
    assert list(of) == ["validated", "indicative", "outside", "verified only"]
    assert sum(map(len, of.values())) == len(found().rows), "each quantity once"
    none = replace(found(), rows=found().rows[2:])
    assert credibility_page.by_grade(none)[0][:2] == ("validated", [])
    text = html.unescape(report.write(credibility_page.page(none), tmp_path / "new", "credibility").read_text())
    assert '<span class="badge validated">validated</span> <b>no quantity</b>' in text


def test_what_it_says_in_a_line() -> None:
    """Measurements apart from other models."""
    said = "4 quantities: 1 validated, 1 indicative, 1 outside, 1 verified only; 5 of 6 measurements within their uncertainty, "
    assert credibility_page.said(found()) == said + "0 of 1 other models within the tolerance"


def test_measurements_and_other_models_are_counted_apart(tmp_path) -> None:
    page = credibility_page.page(found())
    row = credibility_page.facts(found())["rows"][2]
    assert (row["measurement"], row["model"]) == ({"met": 2, "of": 3}, {"met": 0, "of": 1})
    assert [one["kind"] for one in row["beside"]] == ["measurement"] * 3 + ["model"]
    text = html.unescape(report.write(page, tmp_path / "new", "credibility").read_text())
    assert "2 of 3 measurements within their uncertainty; 0 of 1 other models within the tolerance" in text
    assert "converged in 9 evaluations from one start" in text


def test_each_difference_has_its_direction_and_orders_stand_apart() -> None:
    """Around 1 +- 0.1: 1.5 and 1.8 are 5 and 8 uncertainties above, 0.7 is 3 below; what is within has no direction."""
    values = {"a": 1.02, "b": 1.5, "c": 1.8, "d": 0.7, "e": np.nan}
    numbers = [replace(of_result(measured(value)), name=name) for name, value in values.items()]
    order = of_result(measured(0.0, truth=1.0, within=0.5, is_order=True))
    said = credibility_page.differences(graded(*numbers, order), ()).split("; ")
    assert said[0] == "2 too large, by 5 to 8 uncertainties"
    assert said[1:] == ["1 too small, by 3 uncertainties", "1 without a number", "1 of 1 stiffness rankings wrong"]
    assert credibility_page.differences(graded(numbers[0]), ()) == ""


def test_specimens_are_counted_by_source() -> None:
    row = graded(of_result(measured(1.0)), of_result(measured(1.0, known=QUOTED)))
    assert credibility_page.specimens(row) == "Chen 2016: 6, Van Loocke 2006: not known"


def test_arms_have_what_others_reach_and_the_poses_that_all_cases_have() -> None:
    """Inside up to 10 of -10 to 70 degrees: 11 of 41 poses in steps of 2 degrees, and 6 of the 29 from 0 to 57."""
    at, made = np.arange(-10.0, 71.0, 2.0), arms(10, 20, (15, 15))
    ends = (np.full(41, one) for one in (10.0, 20.0))
    published = np.where(at <= 10, 15.0, 25.0)
    wide = replace(
        made, found=ArmRange(at, *ends), middle=np.full(41, 15.0), published=ArmRange(at, published, published)
    )
    (one,) = credibility_page.facts(replace(found(), rows=(), arms=(wide,)))["arms"]
    assert (one["angles"], one["reached"]) == ([-10, 70], 91)
    assert (one["share"], one["common"]) == (11 / 41, 6 / 29)


def test_poses_are_those_in_which_the_published_arm_is_known() -> None:
    made = arms(10, 20, (15, 15))
    published = np.where(made.found.angles < 6, 15.0, np.nan)
    partly = replace(made, published=ArmRange(made.found.angles, published, published))
    assert [one["poses"] for one in credibility_page.facts(replace(found(), arms=(made, partly)))["arms"]] == [10, 3]


def test_the_row_of_arms_has_the_range_of_biases_and_each_case_stands_below_once(tmp_path) -> None:
    """One sentence for all measured cases: seven of them in a narrow cell made the first table four times as tall."""
    several = (arms(10, 20, (15, 15)), arms(10, 20, (28, 28)), arms(10, 20, (40, 60), "iliacus"))
    page = credibility_page.page(replace(found(), arms=several))
    text = html.unescape(report.write(page, tmp_path / "new", "credibility").read_text()).replace("\u202f", " ")
    assert "2 of 3 measurements within their uncertainty; 1 too small, by 13 mm; 0 of 1 other models" in text
    assert text.count("bias 0.0 mm, scatter 0.0 mm over 10 of 10 poses") == 1


def test_a_fit_is_met_by_the_same_uncertainty_and_unknown_without_a_value() -> None:
    (fit,), one = found().fits, found().rows[0].beside[0]
    assert credibility_page.met(fit.values, one) is True
    assert credibility_page.met({"cube": 1.2}, one) is False
    assert credibility_page.met({}, one) is None
