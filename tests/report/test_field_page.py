"""The page of scalar examples shows all of an example, opens without a network, and survives what is not a number."""

import re
from dataclasses import replace

import fields
import pytest
from jinja2 import UndefinedError

from fem_reference.report import field_figures, field_page
from fem_reference.runs.store import Outcome
from tests.report.examples import DIFFUSION, LADDERS, NAN, SOURCE, ball, nowhere, plate, rod
from tests.report.tags import read

pytestmark = pytest.mark.slow


def test_page_shows_everything_and_needs_no_network(tmp_path):
    examples = (
        rod(tmp_path / "rod"),
        plate(tmp_path / "other", lambda base: 3 * base),
        ball(tmp_path / "surface_figure"),
    )
    text = field_page.page("Three & <more>", examples).html()
    tags = read(text)
    assert tags.headings.count("Runs") == tags.headings.count("Convergence") == 3
    assert tags.headings[0] == "Three & <more>"
    # The rod has two drawings; plate and ball each show listing, reference and difference; each has its convergence.
    assert text.count("<svg ") == 2 + 3
    assert text.count("<img ") == 3 + 3
    assert all(source.startswith(("#", "data:image/webp;base64,")) for source in tags.sources)
    bare = re.sub(r"<script>.*?</script>", "", text, flags=re.DOTALL)
    assert not re.search(r"<script|<link|<iframe|@import|url\((?!#)|http(?!-equiv)", bare)
    for printed in (
        "Figure 4.5 of the report",
        "Figure 4.8 of the report",
        "Figure 4.9 of the report",
        "0.0312",
        "0.375",
    ):
        assert printed in text
    assert "Figure 4.6 of the report" not in text
    assert "distance to &lt;exact&gt;" in text
    assert "<td>0.0156</td><td>2.25</td>" in text
    assert "<td>750 ms</td>" in text
    assert len(text) < 5e6


def test_every_id_on_the_page_is_unique_and_every_reference_meets_one(tmp_path):
    text = field_page.page("Two", (rod(tmp_path / "rod"), rod(tmp_path / "bar"))).html()
    ids = re.findall(r'\bid="([^"]*)"', text)
    assert len(ids) == len(set(ids))
    assert set(re.findall(r'(?:href="|url\()#([^")]*)', text)) <= set(ids)


@pytest.mark.parametrize("make", [rod, plate, ball])
def test_a_run_that_is_not_a_number_is_reported_and_not_drawn(tmp_path, make):
    lost = make(tmp_path / "lost", lambda base: base * NAN)
    run = replace(lost.candidates[0], fields=nowhere(lost), outcome=Outcome("diverged", "it blew <up>"))
    text = field_page.comparison_page(replace(lost, candidates=(run,))).html()
    read(text)
    assert "it blew &lt;up&gt;" in text
    assert '<span class="bad">not a number</span>' in text
    assert "the listing has values that are not finite, so the two solutions cannot be compared" in text
    assert text.count("Its values are not numbers") == (0 if make is rod else 2)


def test_nothing_but_a_diverged_reference_has_a_page(tmp_path):
    lost = rod(tmp_path / "rod")
    reference = replace(lost.reference, fields=nowhere(lost), outcome=Outcome("diverged", "no"))
    alone = replace(lost, reference=reference, candidates=(), deviations={}, verdicts=(), ladders=(LADDERS[1],))
    text = field_page.comparison_page(alone).html()
    read(text)
    assert "there is only a reference" in text
    assert "No run has values that are numbers" in text
    assert "Expectations" not in text
    assert "not a number" not in text[text.index("<h3>Runs") : text.index("<h3>Convergence")]
    bad = replace(alone, ladders=(replace(LADDERS[1], errors=(NAN, 0.0, NAN)),))
    assert field_figures.convergence(bad).missing


def test_the_first_sentence_says_how_far_listing_and_equation_part(tmp_path):
    same, other = rod(tmp_path / "rod"), plate(tmp_path / "plate", lambda base: 3 * base)
    assert field_page.apart(same) == "the listing and the equation agree; their maximum difference at a vertex is 0."
    # The reference falls to -2 and the listing to 3 times that: they differ by 4, twice as far as 2.
    minus = "\N{MINUS SIGN}"
    assert field_page.apart(other) == (
        f"the listing gives {minus}6 to 0, the equation {minus}2 to 0; their maximum difference at a vertex is 4, "
        "2 times the maximum of the equation's solution."
    )


def test_the_worst_example_gives_the_word(tmp_path):
    good = rod(tmp_path / "rod")
    other = plate(tmp_path / "plate")
    bad = replace(other, verdicts=(replace(other.verdicts[0], word="fail"),))
    text = field_page.page("Both", (good, bad)).html()
    assert '<p class="lead"><span class="badge fail">fail</span> over 2 examples.' in text


@pytest.mark.parametrize(
    ("form", "speed", "printed"),
    [
        ("auto", 100.0, "It is above 1, so the form is SUPG"),
        ("auto", 1.0, "It is not above 1, so the form is plain Galerkin"),
        ("supg", 1.0, "The scene specifies SUPG"),
        ("galerkin", 100.0, "The scene specifies plain Galerkin"),
    ],
)
def test_the_form_is_reported_with_its_reason(tmp_path, form, speed, printed):
    # 19 intervals of at most 0.2 with k = 1: the Peclet number v h / 2k of the longest is below 1 at 1 and above it at 100.
    flow = {"name": "advection", "velocity": [speed]}
    made = rod(tmp_path / "rod", effect=[DIFFUSION, flow, SOURCE], element=fields.element(1, form))
    text = field_page.comparison_page(made).html()
    assert printed in text
    assert ("coth Pe" in text) == ("SUPG" in printed)
    assert ">supg</td>" in text if "SUPG" in printed else ">galerkin</td>" in text
    assert ">as in the report&#39;s listing</td>" in text


def test_every_row_of_the_differences_is_complete_and_on_the_page(tmp_path):
    made = field_page.page("None", ())
    rows, text = made.contents["differences"], made.html()
    assert len(rows) == 23
    assert all(row[key].strip() for row in rows for key in ("section", "text", "listing", "measured"))
    assert len({row["section"] for row in rows}) == 4
    read(text)
    assert "<td>23</td>" in text
    assert "27.06" in text
    assert "27.06" not in field_page.comparison_page(rod(tmp_path / "rod")).html()


def test_a_row_without_a_key_is_no_page(monkeypatch):
    rows = {"difference": [{"section": "one", "text": "two"}], "figure": []}
    monkeypatch.setattr(field_page.tomllib, "loads", lambda _: rows)
    with pytest.raises(UndefinedError, match="listing"):
        field_page.page("None", ()).html()
