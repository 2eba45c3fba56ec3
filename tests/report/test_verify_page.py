"""The page of the catalogue shows all of a result, opens without a network, and survives what is not a number."""

import json
import math
import re

import pytest

from fem_reference import report
from fem_reference.assessment.catalogue import Finding, Result
from fem_reference.report import verify_page
from tests.report.entries import LADDER, NAN, made, verification
from tests.report.tags import read


def test_page_shows_everything_and_needs_no_network() -> None:
    one = made(order=2.0, ladder=LADDER, note="4 iterations <at most>")
    two = made("tip", 1.5, group="beams", kind="published")
    text = verify_page.page(verification(one, two)).html()
    tags = read(text)
    assert tags.headings[0] == "Verification: problems whose answers are known"
    assert [heading.strip() for heading in tags.headings[1:]] == ["Long blocks", "Beams", "Convergence", "Made with"]
    assert '<span class="badge fail">fail</span> 1 of 2 pass, in 2 groups; 12.5 s.' in text
    # The error 0.01 is a quarter of the bound 0.04.
    for printed in (
        "The &lt;bar&gt;",
        "2.01&#8239;",
        "0.0100<small>0.250</small>",
        "± 0.0400<small>2 %</small>",
        "1.25 s",
    ):
        assert printed in text
    for printed in (
        "because &amp; so",
        "Ogden 1984",
        "mu twice",
        "4 iterations &lt;at most&gt;",
        "2.9.1",
        "1 published",
    ):
        assert printed in text
    assert text.count("<svg ") == 2
    bare = re.sub(r"<script>.*?</script>", "", text, flags=re.DOTALL)
    assert not re.search(r"<script|<link|<iframe|@import|url\((?!#)|http(?!-equiv)", bare)


@pytest.mark.slow
def test_experiments_stand_apart_and_outside_is_no_failure() -> None:
    one = made("cube", 2.5, kind="experiment", pinned=2.5, group="experiments")
    alone, both = verification(one), verification(made(), one)
    assert alone.word == both.word == "pass"
    for found, drawings in ((alone, 0), (both, 1)):
        text = verify_page.page(found).html()
        assert '<span class="badge outside">outside</span>' in text
        assert "0 of 1 experiments agree within their uncertainty: outside is a finding" in text
        assert text.count("<svg ") == drawings
        assert "0 of 1 within</small>" in text
        assert "<b>Uncertainty:</b>" in text
    assert "experiments met" not in verify_page.page(verification(made())).html()


@pytest.mark.slow
def test_every_id_is_unique_and_every_reference_meets_one() -> None:
    results = [
        made(name, value, order=2.0, ladder=LADDER) for name, value in (("bar", 2.0), ("tip", 3.0), ("rod", NAN))
    ]
    text = verify_page.page(verification(*results)).html()
    ids = re.findall(r'\bid="([^"]*)"', text)
    assert len(ids) == len(set(ids))
    assert set(re.findall(r'(?:href="|url\()#([^")]*)', text)) <= set(ids)
    assert 'href="#tip"' in text
    assert 'href="#bar"' not in text


def test_what_is_not_a_number_fails_and_is_reported() -> None:
    lost = made(value=NAN, note="ValueError: no root", ladder=((1.0, NAN), (0.5, 2.0)))
    text = verify_page.page(verification(lost)).html()
    read(text)
    assert "0 of 1 pass, in 1 group" in text
    assert '<span class="bad">not a number</span>' in text
    assert '<p class="alarm"><b>Note:</b> ValueError: no root</p>' in text
    assert ">Convergence<" not in text
    (row,) = verify_page.facts(verification(lost))["entries"]
    assert (row["value"], row["error"], row["ladder"]) == (None, None, [[1.0, None], [0.5, 2.0]])


def test_an_entry_without_a_truth_is_reported() -> None:
    lost = Result(made().entry, Finding(2.0, note="no truth, ValueError: no root"), NAN, NAN, 1.0)
    text = verify_page.page(verification(lost)).html()
    read(text)
    assert "0 of 1 pass" in text
    assert '<span class="badge inconclusive">inconclusive</span>' in text
    assert text.count('<span class="bad">not a number</span>') == 3  # truth, error and bound
    assert "no truth, ValueError: no root" in text
    (row,) = verify_page.facts(verification(lost))["entries"]
    assert (row["value"], row["truth"], row["error"], row["within"]) == (2.0, None, None, None)


def test_negative_controls_are_marked() -> None:
    text = verify_page.page(verification(made(value=4.0, with_negative_control=True), made("tip"))).html()
    assert "1 entry is measured with a deliberate mistake" in text
    assert text.count('<small class="bad">negative control</small>') == 1
    assert '<p class="alarm"><b>Negative control:</b> mu twice</p>' in text
    assert text.count("<b>Its negative control:</b>") == 1


def test_numbers_have_six_digits_where_value_and_truth_stand_beside_each_other() -> None:
    text = verify_page.page(
        verification(made(value=-12034.56, truth=-12034.51), made("tip", 1.5e-7, truth=1.25e-7))
    ).html()
    minus, times = "\N{MINUS SIGN}", "\N{MULTIPLICATION SIGN}"
    assert f"<td>{minus}12034.6&#8239;" in text
    assert f"<td>{minus}12034.5&#8239;" in text
    assert f"<td>1.5 {times} 10<sup>{minus}7</sup>&#8239;" in text


def test_files_have_the_same_numbers(tmp_path) -> None:
    printed = verification(made(order=2.0, ladder=LADDER), made("tip", NAN))
    page = report.write(verify_page.page(printed), tmp_path / "new" / "reports", "verify")
    assert page == tmp_path / "new" / "reports" / "verify.html"
    assert page.read_text().count("badge pass") == 1
    stored = json.loads(page.with_name("verify.json").read_text())
    assert stored == json.loads(json.dumps(verify_page.facts(printed)))
    assert (stored["verdict"], stored["passed"], stored["of"], stored["seconds"]) == ("fail", 1, 2, 12.5)
    row = stored["entries"][0]
    assert (row["name"], row["group"], row["verdict"], row["kind"]) == ("bar", "long_blocks", "pass", "closed form")
    assert (row["value"], row["truth"], row["within"], row["order"], row["seconds"]) == (2.01, 2.0, 0.04, 2.0, 1.25)
    assert row["ladder"] == [list(step) for step in LADDER]
    assert row["error"] == pytest.approx(0.01, abs=1e-15)  # 2.01 - 2.0 to rounding


# Drawings: shares of tolerances, and errors over mesh sizes


@pytest.mark.parametrize(
    ("value", "within", "expected"),
    [(2.01, 0.02, 0.25), (2.0, 0.02, 0.0), (2.16, 0.02, 4.0), (2.0, 0.0, 0.0), (2.1, 0.0, math.inf), (NAN, 0.02, NAN)],
)
def test_share_is_the_error_over_its_bound(value, within, expected) -> None:
    # A difference of numbers near 2 is exact to 4e-16, 1e-14 of the smallest bound.
    found = verify_page.share(made(value=value, within=within))
    assert found == pytest.approx(expected, rel=1e-12, nan_ok=True)


def test_the_overview_names_every_result_whatever_its_value() -> None:
    values = [2.0, 2.01, 2.0 + 1e-14, 3.0, 1e9, math.inf, NAN]
    odd = [made(f"bar_{i}", value, with_negative_control=i % 2 == 1) for i, value in enumerate(values)]
    svg = verify_page.overview({"long_blocks": odd, "beams": [made("rod", 2.0)]}).markup
    assert all(name in svg for name in ("rod", "long blocks", "beams", *(one.entry.name for one in odd)))
    assert "nan" not in svg.lower()


@pytest.mark.parametrize("value", [2.0, 1e9, NAN])
def test_the_overview_has_axes_for_one_result_without_a_share_to_show(value) -> None:
    assert "10" in verify_page.overview({"beams": [made(value=value)]}).markup


def test_convergence_shows_the_order_beside_a_whole_slope() -> None:
    svg = verify_page.convergence(made(order=1.96, ladder=LADDER)).markup
    assert "order 1.96" in svg
    assert "slope 2" in svg
    assert "error [N mm]" in svg
    assert all(f">{size}<" in svg for size in ("1", "0.500", "0.250"))


@pytest.mark.parametrize("order", [None, NAN, -0.7])
def test_convergence_without_a_positive_order_has_no_slope(order) -> None:
    svg = verify_page.convergence(made(order=order, ladder=LADDER)).markup
    assert "slope" not in svg


@pytest.mark.parametrize(
    ("ladder", "drawn"),
    [
        ((), False),
        (LADDER, True),
        (LADDER[:1], False),
        (((1.0, 2.0), (0.5, 2.1)), False),
        (((1.0, NAN), (0.5, 2.1)), False),
    ],
)
def test_a_ladder_needs_two_positive_errors(ladder, drawn) -> None:
    assert verify_page.drawable(made(ladder=ladder)) == drawn
