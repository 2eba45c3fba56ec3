"""The page of error bars beside errors, and its numbers."""

import json

import pytest

from fem_reference import report
from fem_reference.report import claims_page
from tests.studies.test_true_errors import whole


def test_the_page_and_its_numbers(tmp_path) -> None:
    path = report.write(claims_page.page(whole("one", "other")), tmp_path / "new", "error-bars")
    text, numbers = path.read_text(), json.loads((path.parent / "error-bars.json").read_text())
    assert (numbers["claims"], numbers["covered"], numbers["missing"]) == (56, 1.0, {"lost": "why it was"})
    assert numbers["median_ratio"] == pytest.approx(2.25)  # 3 and 1.5, each half of them
    assert text.count("<svg") == 3
    assert "why it was" in text
    widest = claims_page.widest(whole("one"), "one", "volume", "deviation")
    assert (widest.of, widest.bar) == ("deviation", 0.3)
