"""The run store: what is written reads back, opens in ParaView, appears whole, and a run that was cut off is no result."""

import numpy as np
import pytest

from fem_reference.foundations.errors import InputError
from fem_reference.problems.problem import AtRest
from fem_reference.runs import store
from fem_reference.runs.store import Frame, Outcome
from fem_reference.runs.writer import Writer
from tests.runs.stored import FIBRES, IDENTITY, SHIFT, SURFACE, write


def test_what_is_written_reads_back(tmp_path) -> None:
    run = store.load(write(tmp_path / "run"))
    assert (run.name, run.solver, run.numbers) == ("reference", "test", (0, 5))
    assert np.array_equal(run.surface.points, SURFACE.points)
    assert np.array_equal(run.surface.triangles, SURFACE.triangles)
    assert np.array_equal(run.positions[1], SURFACE.points + SHIFT)
    assert np.array_equal(run.fibre_positions[1], FIBRES.points + SHIFT)
    assert run.fibres.offsets.tolist() == [0, 3, 5]
    assert run.scalars["energy"].tolist() == [0, 10]
    assert run.residuals == ((), (1.0, 0.1))
    assert run.outcome == Outcome("converged", "done", run.outcome.cost)
    assert run.outcome.cost["newton_iterations"] == 7
    assert run.outcome.cost["seconds"] > 0


def test_a_run_that_was_cut_off_is_no_result(tmp_path) -> None:
    folder = write(tmp_path / "run", close=False)
    with pytest.raises(InputError, match='status: got "running", want a run that came to its end'):
        store.load(folder)
    assert store.finished(folder) is None


def test_only_a_converged_run_is_finished(tmp_path) -> None:
    writer = Writer(tmp_path / "run", IDENTITY, AtRest(SURFACE))
    writer.add(Frame(0, SURFACE.points))
    writer.close(Outcome("diverged", "no"))
    assert store.load(tmp_path / "run").outcome.status == "diverged"
    assert store.finished(tmp_path / "run") is None
    assert store.finished(tmp_path / "nothing") is None
