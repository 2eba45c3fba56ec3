"""The page of estimation techniques, and its numbers."""

import json
import math
from dataclasses import replace

import pytest
from scipy.ndimage import label

from fem_reference import report
from fem_reference.report import estimation_page
from tests.assessment.test_estimation import found


@pytest.mark.slow
def test_the_page_and_its_numbers(tmp_path) -> None:
    path = report.write(estimation_page.page(found()), tmp_path / "new", "estimation")
    text, numbers = path.read_text(), json.loads((path.parent / "estimation.json").read_text())
    assert (len(numbers["curves"]), len(numbers["heights"]), len(numbers["fits"])) == (28, 2, 2)
    assert numbers["missing"] == {"lost": "why it was"}
    assert text.count("<svg") == 4
    assert "Decompositions into fibres" in text
    assert numbers["decompositions"][0]["source"] == "CHMD"
    assert "<td>20</td><td>2.93</td><td>64 %</td><td>18 %</td><td>22 %</td>" in text
    assert [one["status"] for one in numbers["answers"]] == ["converged", "diverged"]
    assert all(word in text for word in ("0.123", "0.0789", "4.56", "file: diverged"))
    assert "why it was" in text
    assert text.count("<td>0.100<small>100\N{NARROW NO-BREAK SPACE}000</small></td>") == 2
    for one in found().heights:  # a column for each choice of centres, its condition below its error
        assert f"<th>{one.choice}<small>rms, mm</small></th>" in text
    # The first technique is given the least errors; 30 Gaussians are 120 numbers where 900 vertices are 2700.
    assert estimation_page.said(found()).startswith("Of the curves through a few points of a fibre, constant deviates")
    assert "with 1/22 to 1/22 of the parameters" in estimation_page.said(found())


@pytest.mark.slow
@pytest.mark.parametrize("lacking", [("curves",), ("fits",), ("curves", "fits", "heights")])
def test_what_was_not_measured_is_not_said(lacking, tmp_path) -> None:
    """Of fibres of few points there are no curves, and none that deviates least."""
    some = replace(found(), **dict.fromkeys(lacking, ()))
    assert ("deviates least" in estimation_page.said(some)) is ("curves" not in lacking)
    assert ("Gaussians deviate" in estimation_page.said(some)) is ("fits" not in lacking)
    assert estimation_page.said(some)
    text = report.write(estimation_page.page(some), tmp_path / "new", "estimation").read_text()
    assert text.count("<svg") == 4 - len({"curves", "fits"} & {*lacking})


@pytest.mark.parametrize(("apart", "surfaces"), [(1.2, 1), (1.6, 1), (1.65, 1), (1.7, 2), (1.9, 2)])
def test_two_gaussians_part_at_a_known_distance(apart: float, surfaces: int) -> None:
    """Half way the sum is 2 exp(-d^2 / 4), which is 1 at d = 2 sqrt(log 2)."""
    assert (surfaces == 1) == (apart < 2 * math.sqrt(math.log(2)))
    assert label(estimation_page.two_blobs(apart, 401)[2] > 0)[1] == surfaces
