"""Comparisons of the runs of a case: over all its frames, and of scalar cases with their convergence."""

from pathlib import Path

import numpy as np
import small

from fem_reference.runs.store import Outcome, Run
from fem_reference.scenes import casefile
from fem_reference.studies import judging
from fem_reference.studies.execution import Bench


def test_a_frame_that_was_not_reached_is_no_number_and_no_pass(tmp_path: Path) -> None:
    bench = Bench(casefile.read_muscle(small.write(tmp_path / "bar")), tmp_path / "runs")
    built, numbers = bench.problem(), bench.scene.numbers
    whole = np.stack([built.surface.points] * len(numbers))
    inside = np.stack([built.fibres.points] * len(numbers))
    done = Outcome("converged", "", {})
    reference = Run("reference", "fenicsx", done, numbers, built.surface, whole, built.fibres, inside)
    short = Run("mine", "recorded", Outcome("timed out", ""), numbers[:2], built.surface, whole[:2])
    found = judging.compare(bench, reference, [short])
    values = found["mine", "surface_deviation", "rms"].values
    assert np.array_equal(np.isnan(values), np.arange(len(numbers)) >= 2)
    assert np.all(values[:2] == 0)
    assert found.ladders == ()
    assert [run.outcome.status for run in found.runs] == ["converged", "timed out"]


def test_of_a_scalar_case_it_has_the_convergence(tmp_path: Path) -> None:
    bench = Bench(casefile.read("rod"), tmp_path)
    reference = bench.obtain("reference", bench.scene.candidate[0], "candidate[0]")
    assert [one.element for one in judging.compare(bench, reference, []).ladders] == ["P1", "P2"]
