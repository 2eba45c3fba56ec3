"""The page of omissions: what each changes and saves, in sentences, a table and a drawing."""

import json
import re
from dataclasses import replace

import pytest

from fem_reference import report
from fem_reference.assessment.omissions import CaseOmissions, Omission
from fem_reference.report import effects_page
from tests.studies.test_omissions import found, omission


def test_the_page_says_what_each_changes_and_what_it_saves() -> None:
    contact, gravity, kept = effects_page.sentences(found(), found().ablations[0])
    assert contact == (
        "Leaving out contact changes the surface (rms) by 3 mm (error bar ± 0.300 mm) and saves 60 % of the time. It matters."
    )
    assert gravity.endswith("by 0.0100 mm (error bar ± 0.300 mm) and saves 10 % of the time. It does not matter.")
    assert kept == "The material itself is never left out: neo hooke."


@pytest.mark.slow
def test_a_prediction_stands_beside_what_was_measured_where_there_is_one(tmp_path) -> None:
    page = report.write(effects_page.page(found()), tmp_path, "effects")
    assert "surface deviation, rms: 2.50" in page.read_text(encoding="utf-8")
    whole = found().ablations[0]
    bare = replace(whole, omissions=tuple(replace(one, predicted={}) for one in whole.omissions))
    assert "predicted" not in effects_page.page(replace(found(), ablations=(bare,))).html()
    table = json.loads((tmp_path / "effects.json").read_text(encoding="utf-8"))
    assert [row["verdict"] for row in table["ablations"][0]["omissions"]] == ["matters", "does not matter"]


def test_only_what_leaves_out_all_is_called_all_of_them() -> None:
    """With tension at rest go a tone and the support by bones: three names, as many as all effects have."""
    tense, every = ("in_situ", "tone", "support of contact"), ("in_situ", "tone", "contact", "support of contact")
    rows = tuple(omission(*names) for names in (tense, ("tone",), ("contact",), every))
    whole = replace(found().ablations[0], omissions=rows)
    said = [effects_page.label(whole, row) for row in rows]
    assert said[0] == "in situ, tone and support of contact"
    assert said[1:] == ["tone", "contact", "all of them"]


def test_a_failure_is_a_row_with_its_cause_and_a_change_of_nothing_is_drawn(tmp_path) -> None:
    failed = Omission(("contact", "gravity"), "diverged", "frame 3: <b>lost</b>", instead={"element": "P2"})
    whole = found(failed)
    text = report.write(effects_page.page(whole), tmp_path, "effects").read_text(encoding="utf-8")
    assert "frame 3: &lt;b&gt;lost" in text
    assert "<b>" not in text
    assert "element = P2" in text
    assert not re.search(r'(?:src|href)="https?:', text)
    assert "contact (0 mm)" in effects_page.page(changed(whole, 0.0)).html()
    assert effects_page.drawing(replace(whole, ablations=())) is None


def changed(given: CaseOmissions, rms: float) -> CaseOmissions:
    """With this change of the surface without contact."""
    (whole,) = given.ablations
    rows = (omission("contact", rms=rms), *whole.omissions[1:])
    return replace(given, ablations=(replace(whole, omissions=rows),))


def test_without_error_bars_nothing_is_said_to_matter() -> None:
    blind = replace(found(), bars={}, unknown="the tetrahedra are the same")
    assert "Whether it matters is unknown." in effects_page.text(blind)
    assert "the tetrahedra are the same" in effects_page.text(blind)
    assert "the tetrahedra are the same" in effects_page.page(blind).html()
