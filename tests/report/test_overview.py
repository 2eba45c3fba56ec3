"""A case and its results as lines of text."""

from dataclasses import replace

import numpy as np
import small

from fem_reference.problems import of_case
from fem_reference.report.overview import case_facts, comparison_text
from fem_reference.scenes import casefile
from tests.report.comparisons import with_bars


def test_a_case_is_described_before_it_is_solved(tmp_path) -> None:
    case = casefile.read(small.write(tmp_path / "bar"))
    facts = case_facts(case, of_case.setup(case))
    assert (facts["case"], facts["title"], facts["proves"]) == (case.name, case.title, case.proves)
    assert list(facts["bones"]) == [bone.name for bone in case.bone]
    assert facts["reference"].startswith(case.reference.solver)
    assert len(facts["expects"]) == len(case.expect)


def test_a_comparison_is_printed_with_its_worst_frames_bars_and_verdict(comparison) -> None:
    lines = comparison_text(comparison).splitlines()
    assert lines[:3] == [
        "reference: converged, reference has ended",
        "quick: converged, quick has ended",
        "torn: diverged, torn has ended",
    ]
    quick = next(line for line in lines if line.startswith("quick at its worst: "))
    assert "surface deviation max 4 mm (frame 40)" in quick
    assert lines[-1].startswith("verdict: pass, of the reference; candidates are measured, not judged")
    assert not any("error bars" in line for line in lines)
    bars = comparison_text(with_bars(comparison)).splitlines()
    assert any(line.startswith("error bars of the reference") for line in bars)


def test_a_doubtful_reference_is_printed_with_its_reason(comparison) -> None:
    scalars = {"negative_modes": np.array([0.0, 0, 1, 0, 0])}
    doubtful = replace(comparison, reference=replace(comparison.reference, scalars=scalars))
    assert "reference: doubtful, unstable equilibrium in 1 of 5 frames" in comparison_text(doubtful).splitlines()
