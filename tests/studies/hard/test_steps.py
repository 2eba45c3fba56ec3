"""The reference in few load steps and in many."""

import numpy as np
import pytest

from fem_reference.assessment import health
from fem_reference.runs.store import Outcome
from fem_reference.solvers import fenicsx
from fem_reference.studies.hard import blocks, choosing, records, steps

CASES = {hard.name: hard for hard in records.read_all()}


def test_a_reference_that_stalls_says_nothing_of_load_steps(monkeypatch) -> None:
    monkeypatch.setattr(fenicsx, "solve", lambda *_: Outcome("stalled", "the machine was busy"))
    built = blocks.problem(CASES["at_rest.millimetres"])
    with pytest.raises(steps.StalledError, match="the machine was busy"):
        steps.compare(built, choosing.choices()["fenicsx"], records.StepCounts(until=2))


def test_the_farthest_frame_is_where_load_steps_are_compared() -> None:
    surface = blocks.problem(CASES["at_rest.millimetres"]).surface
    moved = [surface.points + shift for shift in (0.0, 3.0, 1.0)]
    assert steps.farthest(health.Followed((0, 5, 10), surface, np.array(moved))).until == 5
    assert steps.farthest(health.Followed((0, 5), surface, np.array(moved[:1] * 2))) is None
    assert steps.farthest(health.Followed((0,), surface, np.array(moved[:1]))) is None
