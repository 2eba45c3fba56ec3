"""Candidates of several muscles: frames are in folders with the names of the muscles, and one may lack some."""

from pathlib import Path

import pytest

from fem_reference.foundations.errors import InputError
from fem_reference.scenes import casefile
from fem_reference.solvers import recorded
from fem_reference.studies import by_muscle
from fem_reference.studies.execution import Bench


def test_frames_of_no_muscle_are_refused_before_anything_is_solved(tmp_path: Path) -> None:
    (tmp_path / "frames" / "other").mkdir(parents=True)
    chosen = recorded.choice(tmp_path / "frames", None, "--candidate")
    with pytest.raises(InputError, match="without frames of a muscle, want folders deep or superficial in it"):
        by_muscle.compared(Bench(casefile.read("two_muscles"), tmp_path), [(chosen, "--candidate")])
    assert not list(tmp_path.glob("fenicsx-*"))
