"""The page of estimation techniques, and its numbers."""

import json

from fem_reference import report
from fem_reference.report import estimation_page
from tests.assessment.test_estimation import found


def test_the_page_and_its_numbers(tmp_path) -> None:
    path = report.write(estimation_page.page(found()), tmp_path / "new", "estimation")
    text, numbers = path.read_text(), json.loads((path.parent / "estimation.json").read_text())
    assert (len(numbers["curves"]), len(numbers["heights"]), len(numbers["fits"])) == (28, 2, 2)
    assert numbers["missing"] == {"lost": "why it was"}
    assert text.count("<svg") == 3
    assert "Decompositions into fibres" in text
    assert numbers["decompositions"][0]["source"] == "CHMD"
    assert "why it was" in text
    assert "1e+05" in text
    # The first technique is given the least errors; 30 Gaussians are 120 numbers where 900 vertices are 2700.
    assert estimation_page.said(found()).startswith("of curves through a few points of a fibre constant deviates least")
    assert "22 to 22 times fewer numbers" in estimation_page.said(found())
