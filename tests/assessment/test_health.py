"""Quantities of health: zero at rest, and each sees what it is for."""

import numpy as np

from fem_reference.assessment import health
from fem_reference.studies.hard import blocks, records

CASES = {hard.name: hard for hard in records.read_all()}


def test_quantities_are_zero_at_rest_and_see_what_they_are_for() -> None:
    problem = blocks.problem(CASES["at_rest.millimetres"])
    rest = problem.surface.points
    mirrored = rest * [1, 1, -1]
    run = health.Followed((0, 1), problem.surface, np.array([rest, mirrored]), bones=problem.bones)
    assert health.history(run, "inside_out").values.tolist() == [0.0, 100.0]
    np.testing.assert_allclose(health.history(run, "volume").values, [0, 200])
    np.testing.assert_allclose(health.history(run, "stretch").values, [1, 1])
    assert health.history(run, "from_rest").values[1] > 100
    assert health.history(run, "penetration").values.tolist() == [0.0, 0.0]
