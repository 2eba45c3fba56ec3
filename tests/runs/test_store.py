"""Runs in memory and on disk; the frames that they reached, of those of a case, and the time of one."""

import numpy as np
import pytest
import shapes

from fem_reference.foundations.errors import InputError
from fem_reference.problems.problem import AtRest
from fem_reference.runs import store
from fem_reference.runs.store import Frame, Outcome, Run, complete, reached, seconds_per_frame
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
    with pytest.raises(InputError, match='status: got "running", want a finished run'):
        store.load(folder)
    assert store.finished(folder) is None


def test_only_a_converged_run_is_finished(tmp_path) -> None:
    writer = Writer(tmp_path / "run", IDENTITY, AtRest(SURFACE))
    writer.add(Frame(0, SURFACE.points))
    writer.close(Outcome("diverged", "no"))
    assert store.load(tmp_path / "run").outcome.status == "diverged"
    assert store.finished(tmp_path / "run") is None
    assert store.finished(tmp_path / "nothing") is None


def test_frames_that_were_not_reached_are_not_numbers() -> None:
    rest = shapes.sphere(0)
    positions = np.stack([rest.points, rest.points + 1])
    run = Run(
        "one", "test", Outcome("diverged", "no"), (0, 10), rest, positions, scalars={"energy": np.array([1.0, 2.0])}
    )
    whole = complete(run, (0, 5, 10))
    assert whole.numbers == (0, 5, 10)
    assert np.array_equal(whole.positions[[0, 2]], positions)
    assert np.isnan(whole.positions[1]).all()
    assert whole.fibre_positions is None
    assert np.array_equal(whole.scalars["energy"], [1, np.nan, 2], equal_nan=True)
    assert complete(run, (0, 10)) is run


def test_fibres_and_frames_that_are_not_wanted() -> None:
    rest = shapes.sphere(0)
    moved = np.arange(18.0).reshape(3, 2, 3)
    run = Run(
        "one",
        "test",
        Outcome("converged", ""),
        (0, 5, 10),
        rest,
        np.zeros((3, *rest.points.shape)),
        fibre_positions=moved,
    )
    whole = complete(run, (5, 15))
    assert whole.positions.shape == (2, *rest.points.shape)
    assert whole.fibre_positions is not None
    assert np.array_equal(whole.fibre_positions[0], moved[1])
    assert np.isnan(whole.fibre_positions[1]).all()


def run(solver: str, numbers: tuple[int, ...], cost: dict[str, float]) -> Run:
    return Run("mine", solver, Outcome("converged", "", cost), numbers, positions=np.zeros((len(numbers), 4, 3)))


def test_what_others_say_is_for_a_frame_number_also_where_the_first_is_not_0() -> None:
    """Frames 10, 20 and 40 are 30 numbers apart, two frames beside the first."""
    assert seconds_per_frame(run("recorded", (10, 20, 40), {"seconds_per_frame": 0.5})) == pytest.approx(7.5)
    assert seconds_per_frame(run("recorded", (10,), {"seconds_per_frame": 0.5})) == 0.0
    assert seconds_per_frame(run("recorded", (10, 20), {})) is None


def test_frames_that_were_not_reached_do_not_count() -> None:
    mine = run("pbd", (10, 20, 40, 60), {"seconds": 100.0, "seconds_solve": 8.0})
    assert seconds_per_frame(mine) == pytest.approx(8 / 3)
    mine.positions[2:] = np.nan
    assert reached(mine) == 2
    assert seconds_per_frame(mine) == pytest.approx(8.0)
