"""A case and its results as lines of text."""

from dataclasses import replace

import numpy as np
import pytest
import small

from fem_reference.assessment.comparison import Comparison
from fem_reference.metrics import Measure
from fem_reference.problems import of_case
from fem_reference.problems.setup import AttachedVertices
from fem_reference.report.overview import case_facts, comparison_text
from fem_reference.scenes import casefile
from tests.report.comparisons import html, with_bars


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
    assert lines[-1].startswith("verdict: pass for the reference; candidates are measured, not judged")
    assert not any("error bars" in line for line in lines)
    bars = comparison_text(with_bars(comparison)).splitlines()
    assert any(line.startswith("error bars of the reference") for line in bars)
    assert "  surface_deviation max: no error bar is known at frame 40" in bars
    assert not any("\N{PLUS-MINUS SIGN} nan" in line for line in bars)


def test_a_doubtful_reference_is_printed_with_its_reason(comparison) -> None:
    scalars = {"negative_modes": np.array([0.0, 0, 1, 0, 0])}
    doubtful = replace(comparison, reference=replace(comparison.reference, scalars=scalars))
    assert "reference: doubtful, unstable equilibrium in 1 of 5 frames" in comparison_text(doubtful).splitlines()


@pytest.mark.slow
@pytest.mark.parametrize(
    ("stiffness", "metric", "said"), [(0.1, "joint_moment", 1), (None, "joint_moment", 0), (0.1, "volume", 0)]
)
def test_bars_of_forces_say_that_they_leave_out_how_springs_are_spread(comparison, stiffness, metric, said) -> None:
    def with_springs(of: Comparison) -> Comparison:
        held = AttachedVertices("foot", of.setup.bones[0], np.arange(3), stiffness)
        return replace(of, setup=replace(of.setup, attached=(held,)))

    force = Measure(metric, "force", "N", np.arange(5.0), (), (0, 10, 20, 30, 40))
    deviations = comparison.deviations | {"quick": (*comparison.deviations["quick"], force)}
    bars = with_springs(with_bars(replace(comparison, deviations=deviations)))
    sentence = "5 to 9 % of a force or moment depend on how the same springs are spread"
    assert comparison_text(bars).count(sentence) == html(bars).count(sentence) == said
    assert sentence not in comparison_text(with_springs(comparison))
