"""The contract of sections, met by every template of report/sections."""

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from fem_reference.assessment.comparison import Comparison
from fem_reference.assessment.error_bars import ErrorBar
from fem_reference.metrics import Measure
from fem_reference.report import comparison_page
from tests.report.comparisons import NAN, alone, html, with_bars

FOLDER = Path(comparison_page.__file__).parent / "sections"
NAMES = sorted(path.stem for path in FOLDER.glob("*.html"))
# What sections show besides the reference, which is always there.
NEEDS = {"deviations": ["candidates"], "expectations": ["verdicts"], "ranking": ["candidates", "rankings"]}


def lacking(comparison: Comparison) -> dict[str, Comparison]:
    """The comparison, and what it is without each of the things that sections may need."""
    whole = with_bars(comparison)
    return {
        "nothing": whole,
        "candidates": alone(whole),
        "verdicts": replace(whole, verdicts=()),
        "rankings": replace(whole, error_bars=None),
    }


def own_heading(name: str, text: str) -> bool:
    """Whether a page has a section, by its first heading as in its template."""
    template = (FOLDER / f"{name}.html").read_text(encoding="utf-8")
    heading = re.search(r"<section>\s*(<h[23][^>]*>[^<{]+</h[23]>)", template)
    assert heading, f"{name}.html does not begin with <section> and a heading"
    assert text.count(heading[1]) <= 1
    return heading[1] in text


@pytest.fixture(scope="module")
def rendered() -> dict[str, str]:
    """Pages that one test has rendered, for the others."""
    return {}


@pytest.mark.slow
@pytest.mark.parametrize("name", NAMES)
def test_a_section_is_shown_where_its_numbers_exist_and_absent_where_they_do_not(comparison, name, rendered):
    """The contract of sections, met by every file of report/sections."""
    for without, one in lacking(comparison).items():
        text = rendered[without] = rendered.get(without) or html(one)
        assert own_heading(name, text) == (without not in NEEDS.get(name, ())), without
        ids = re.findall(r'\bid="([^"]*)"', text)
        assert len(ids) == len(set(ids))


@pytest.mark.slow
def test_every_section_stands_on_the_page_once(comparison):
    text = html(with_bars(comparison))
    assert [text.count("<section>"), text.count("</section>")] == [len(NAMES)] * 2


@pytest.mark.parametrize("name", NAMES)
def test_of_a_reference_without_a_frame_what_was_spent_and_its_provenance_remain(comparison, name, rendered):
    lost = replace(comparison.reference, positions=np.full_like(comparison.reference.positions, NAN))
    lost = replace(lost, outcome=replace(lost.outcome, status="diverged"))
    text = rendered["frames"] = rendered.get("frames") or html(replace(comparison, reference=lost))
    assert own_heading(name, text) == (name in ("cost", "origin"))


def test_what_is_nowhere_known_is_not_a_number_on_the_page():
    assert np.isnan(comparison_page.greatest(np.array([NAN, NAN])))
    assert -comparison_page.greatest(-np.array([NAN, 0.5, 0.25])) == 0.25


def test_a_bar_is_widest_where_its_statistic_has_a_value_and_an_unknown_one_there_is_the_widest() -> None:
    def at(bars: list[float], values: list[float]) -> int:
        bar = ErrorBar("change", "joint_moment", "arm", "mm", np.array(bars), {})
        return comparison_page.widest(bar, Measure("joint_moment", "arm", "mm", np.array(values)))

    nan = float("nan")
    assert at([nan, 1.0, 2.0], [nan, 5.0, 5.0]) == 2
    assert at([nan, 0.0, 0.0], [nan, 5.0, 5.0]) == 1
    assert at([nan, nan, 2.0], [nan, 5.0, 5.0]) == 1
    assert at([nan, nan, 2.0], [nan, nan, nan]) == 0
