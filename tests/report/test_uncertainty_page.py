"""The page of unknown parameters: bands, sensitivities and candidates, and what is refused or lost said."""

from dataclasses import replace

import numpy as np

from fem_reference.assessment.uncertainty import Failure, place
from fem_reference.report import uncertainty_page
from tests.assessment.test_uncertainty import band, study

SURFACE = replace(band(distance=True, quantity="surface_deviation.rms"), title="Distance of the surface")
LOST = Failure({"effect[0].mu": 0.0123, "effect[1].c1": 0.003}, "diverged", "frame 40: <b>lost</b>")


def test_the_answer_is_the_first_sentence_and_candidates_are_sorted_by_it() -> None:
    first, inside, undecided, outside = uncertainty_page.sentences(study(SURFACE, band()))
    assert first == (
        "In each frame, for 95 % of the parameter sets drawn from their ranges, the rms distance of the surface from that of this "
        "case is at most 2 mm; the error bar of the reference is ± 0.100 mm. The main source of variation is mooney_rivlin c1 "
        "(70 % of the variance)."
    )
    assert inside == "Candidates whose surface error is smaller than the effect of the unknown parameters: fast."
    assert undecided.endswith("given the reference's error bar: near.")
    assert outside == "Candidates whose surface error is larger than the effect of the unknown parameters: far."


def test_a_candidate_without_an_answer_is_not_called_outside() -> None:
    values = np.array([1.5, np.nan, 2.3, np.nan])
    found = replace(study(SURFACE), placed=(place("lost", SURFACE, values),))
    assert uncertainty_page.sentences(found)[1:] == ["Candidates without an answer in some frame: lost."]
    text = uncertainty_page.page(found).html()
    assert "no answer<small>1 of 3 frames inside, 1 without an answer, up to 0.300 mm beyond</small>" in text


def test_the_page_shows_ranges_with_source_and_what_was_not_varied() -> None:
    text = uncertainty_page.page(study(SURFACE, band())).html()
    for part in (
        "Someone 2006",
        "log-uniform",
        "outside the range",
        "Not varied, as no range is stated: incompressible bulk",
    ):
        assert part in text
    assert "3 of 3 frames inside" in text
    assert "up to 2.00 mm beyond" in text
    assert "diverged: frame 3" in text


def test_runs_without_an_answer_are_counted_and_named() -> None:
    text = uncertainty_page.page(study(SURFACE, failures=(LOST,))).html()
    assert "1 of 64 runs have no result" in text
    assert "0.0123" in text
    assert "frame 40: &lt;b&gt;lost" in text
    assert "1 without a result" in uncertainty_page.text(study(SURFACE, failures=(LOST,)))
    assert "frame 40" in uncertainty_page.text(study(SURFACE, failures=(LOST,)))


def test_a_refused_band_is_said_and_not_drawn() -> None:
    refused = replace(SURFACE, refused="12 of 64 runs have no result")
    whole = study(refused)
    page = uncertainty_page.page(whole)
    assert "no band: 12 of 64 runs have no result" in page.html()
    assert "<svg" not in page.html()
    assert uncertainty_page.sentences(whole) == ["No band: 12 of 64 runs have no result."]
    assert "no band: 12 of 64" in uncertainty_page.text(whole)


def test_a_case_without_a_solution_says_so() -> None:
    none = replace(study(), refused="the reference diverged: frame 40", runs=0, placed=())
    assert uncertainty_page.sentences(none) == ["No band: the reference diverged: frame 40."]
    assert "No band: the reference diverged: frame 40." in uncertainty_page.page(none).html()
    assert "No band: the reference diverged" in uncertainty_page.text(none)


def test_without_sensitivities_the_reason_stands_in_their_place() -> None:
    bad = replace(SURFACE, first={}, total={}, unreliable="the surrogate misses 40 % of the variance", by="runs")
    assert "The surrogate misses 40 % of the variance." in uncertainty_page.page(study(bad)).html()
    assert "no sensitivities: the surrogate misses" in uncertainty_page.text(study(bad))
    assert "Most of it" not in uncertainty_page.sentences(study(bad))[0]
