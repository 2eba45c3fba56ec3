"""The contract of sections, met by every template of report/sections."""

import re
from dataclasses import replace

import numpy as np
import pytest

from fem_reference.assessment.comparison import Comparison
from fem_reference.assessment.error_bars import ErrorBar
from fem_reference.foundations.errors import InputError
from fem_reference.metrics import Measure
from fem_reference.report.sections import FOLDER, sections
from fem_reference.report.sections.error_bars import widest
from fem_reference.report.sections.reference import least
from tests.report.comparisons import NAN, alone, html, with_bars


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


@pytest.mark.parametrize("name", sections())
def test_a_section_is_shown_where_its_numbers_exist_and_absent_where_they_do_not(comparison, name, rendered):
    """The contract of sections, met by every file of report/sections."""
    section = sections()[name]
    assert set(section.needs) <= lacking(comparison).keys(), "a new need: say above how a comparison lacks it"
    for without, one in lacking(comparison).items():
        text = rendered[without] = rendered.get(without) or html(one)
        assert own_heading(name, text) == section.has_numbers(one), without
        ids = re.findall(r'\bid="([^"]*)"', text)
        assert len(ids) == len(set(ids))
    assert section.has_numbers(with_bars(comparison))
    assert not any(section.has_numbers(lacking(comparison)[need]) for need in section.needs)


def test_sections_stand_in_their_order(comparison):
    text = html(with_bars(comparison))
    assert [text.count("<section>"), text.count("</section>")] == [len(sections())] * 2
    orders = [section.order for section in sections().values()]
    assert sorted(set(orders)) == orders


@pytest.mark.parametrize(
    ("head", "want"),
    [("", "order"), ("{# order = 1, need = [] #}\n", "need"), ("{# order: 1 #}\n", "a section's order")],
)
def test_a_template_that_is_no_section_is_named(head, want, tmp_path):
    (tmp_path / "unfinished.html").write_text(f"{head}<section></section>")
    with pytest.raises(InputError, match=rf"unfinished\.html.*{want}"):
        sections(tmp_path)


def test_least_of_nothing_known_is_not_a_number():
    assert np.isnan(least(Measure("inversion", "min_det_F", "1", np.array([NAN, NAN]))))


def test_a_bar_is_widest_where_its_statistic_has_a_value_and_an_unknown_one_there_is_the_widest() -> None:
    def at(bars: list[float], values: list[float]) -> int:
        bar = ErrorBar("change", "joint_moment", "arm", "mm", np.array(bars), {})
        return widest(bar, Measure("joint_moment", "arm", "mm", np.array(values)))

    nan = float("nan")
    assert at([nan, 1.0, 2.0], [nan, 5.0, 5.0]) == 2
    assert at([nan, 0.0, 0.0], [nan, 5.0, 5.0]) == 1
    assert at([nan, nan, 2.0], [nan, 5.0, 5.0]) == 1
    assert at([nan, nan, 2.0], [nan, nan, nan]) == 0
