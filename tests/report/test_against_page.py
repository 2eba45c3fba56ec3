"""The page of two versions of a solver: its table, its curves, and the place that moved most."""

import json

import numpy as np
import pytest

from fem_reference import report
from fem_reference.assessment.error_bars import ErrorBar, ErrorBars
from fem_reference.report import against_page
from tests.assessment.test_versions import pair
from tests.report import comparisons


@pytest.mark.slow
def test_the_page_has_its_table_curves_and_place(comparison, tmp_path) -> None:
    bars = (ErrorBar("deviation", "surface_deviation", "rms", "mm", np.full(5, 5.0), {}),)
    found = pair(comparison, ErrorBars(comparisons.NUMBERS, (1.0, 2.0), 2.0, bars))
    path = report.write(against_page.page(found, comparison.setup), tmp_path, "against", "fem-reference compare")
    text = path.read_text(encoding="utf-8")
    assert '<span class="badge within">within the error bar</span>' in text
    assert "2 mm from its earlier position, in frame 40: vertex 0, at rest at (30, 0, 0) mm" in text
    assert "No pictures: the drawing program" in text
    assert text.count("<svg ") == 1 + against_page.MOST_CURVES
    facts = json.loads((tmp_path / "against.json").read_text())
    assert facts["counts"]["within the error bar"] == 1
    assert sum(facts["counts"].values()) == len(facts["changes"]) == 8
