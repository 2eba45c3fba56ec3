"""Time of a frame: what a solver of ours took, what others say."""

import numpy as np
import pytest

from fem_reference.runs.cost import reached, seconds_per_frame
from fem_reference.runs.store import Outcome, Run


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
