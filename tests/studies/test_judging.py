"""Comparisons of the runs of a case: over all its frames, and of scalar cases with the convergence that theory has."""

from pathlib import Path

import numpy as np
import pytest
import small

from fem_reference.problems import of_case
from fem_reference.runs.store import Outcome, Run
from fem_reference.scenes import casefile
from fem_reference.studies import judging
from fem_reference.studies.execution import Bench
from fem_reference.studies.judging import ladders


@pytest.mark.slow
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


def test_orders_are_those_of_theory_on_the_two_finest_meshes() -> None:
    """In L2 p + 1 of elements of order p: 2.00 and 2.99 here; the coarsest of six meshes does not resolve the layer."""
    case = casefile.read("rod_advection")
    first, second = ladders(of_case.problem(case, of_case.setup(case)), case)
    assert (first.element, second.element) == ("P1", "P2")
    assert first.order == pytest.approx(2, abs=0.05)
    assert second.order == pytest.approx(3, abs=0.05)
    assert first.cells == tuple(20 * 2**level for level in range(6))


def test_without_an_exact_solution_the_finest_is_not_measured_against_itself() -> None:
    """The finest of order 2 is what the others are measured against, so that one mesh fewer has an error of that order."""
    case = casefile.read("rod_advection").model_copy(update={"exact": None})
    first, second = ladders(of_case.problem(case, of_case.setup(case)), case)
    assert (len(first.errors), len(second.errors)) == (6, 5)
    assert min(first.errors + second.errors) > 0
    assert "finest" in second.against
