"""The page of standings: groups, what failed, the parts of an error as a bar, and the same in text."""

from fem_reference.assessment.standings import Standings
from fem_reference.report import standings_page
from tests.assessment.test_standings import TRUTH, row

PARTS = {"left out": 0.0, "law": 0.5, "mesh": 0.25, "convergence": 0.25}


def found() -> Standings:
    rows = (
        TRUTH,
        row("near", 0.5, split=PARTS, group="VBD", seconds_per_frame=0.01, message="done; left out: contact"),
        row("lost", 0.1, unsound="exploded: a vertex is 9e9 mm away", split={}),
        row("old", 2.0, stale=True, split={key: 2 * value for key, value in PARTS.items()}),
    )
    return Standings(rows=rows, missing={"hip, new": "no such package"}, changes=("hip, old: 1 mm, now 2 mm",))


def test_the_page_names_what_failed_is_stale_missing_or_changed() -> None:
    html = standings_page.page(found()).html()
    for text in ("no answer, not ranked: exploded", "stale", "left out: contact", "no such package", "now 2 mm"):
        assert text in html
    # Bars to the scale of the longest, whose parts add up to 2 mm.
    assert 'style="width:50.0%" title="law"' in html
    assert 'style="width:25.0%" title="law"' in html


def test_the_text_has_a_line_for_each_row() -> None:
    lines = standings_page.text(found()).splitlines()
    assert "hip: FEM, reference 1: converged, error bar ± 0.2 mm" in lines
    assert "hip: PBD, lost 1: exploded: a vertex is 9e9 mm away" in lines  # without its small number
    assert any(line.startswith("hip: PBD, old 1: converged (stale), surface rms 2 mm, left out 0 mm") for line in lines)
    assert lines[-2:] == ["hip, new: left out, no such package", "changed: hip, old: 1 mm, now 2 mm"]


def test_a_column_is_there_where_a_row_has_its_value() -> None:
    with_forces = row("hill", None, worst={"joint_moment.moment": 768.0}, case="arm")
    html = standings_page.page(Standings(rows=(TRUTH, row("near"), with_forces), missing={})).html()
    hip, arm = html.split('<h2 id="arm">')
    assert ("Joint, moment" in hip, "Joint, moment" in arm) == (False, True)
    assert ("Surface, rms<small>mm" in hip, "Surface, rms<small>mm" in arm) == (True, False)


def test_what_is_late_is_named_by_its_limit() -> None:
    late = row("late", None, status="timed out", time_limit=60.0, message="ended at frame 40 after 61 s")
    found = Standings(rows=(TRUTH, late), missing={})
    assert "not within 60 s: ended at frame 40 after 61 s" in standings_page.page(found).html()
    assert "hip: PBD, late 1: not within 60 s" in standings_page.text(found)
