"""Quantities of health: zero at rest, and each sees what it is for."""

from dataclasses import replace

import numpy as np
import pytest
from hard_cases import CASES

from fem_reference.assessment import health
from fem_reference.studies.hard import blocks


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


def test_bodies_in_each_other_are_crossed_and_a_body_that_is_not_finite_is_not_known() -> None:
    """The upper body, 0.2 mm above the lower one, comes down by 1.2 mm."""
    problem = blocks.several(CASES["neighbours.narrow"])
    rest, (_, upper) = problem.rest, problem.spans
    positions = np.stack([rest.surface.points] * 3)
    positions[1:, upper.vertices] -= np.array([[0, 0, 1.2], [0, 0, np.nan]])[:, None]
    run = health.Followed((0, 1, 2), rest.surface, positions, spans=problem.spans)
    assert [len(one.surface.triangles) for one in run.bodies] == [
        len(one.surface.triangles) for one in problem.problems.values()
    ]
    found = health.history(run, "crossed")
    assert found.values == pytest.approx([0, 100 * 1.0 / run.size, np.nan], nan_ok=True)
    assert 9 <= found.points[1][2] <= 10
    # One keeps its volume and the other goes down to 70 % of its height: the greatest change counts, not that of the sum.
    lower = np.array(positions)
    lower[1, upper.vertices] = rest.surface.points[upper.vertices] * [1, 1, 0.7]
    assert health.history(replace(run, positions=lower), "volume").values[:2] == pytest.approx([0, 30])
    known = replace(run, positions=lower, integrated=np.array([[1.0, 1.0], [1.01, 0.98], [1.0, 1.0]]))
    assert health.history(known, "volume").values == pytest.approx(
        [0, 2, 0]
    )  # flat facets do not enclose curved bodies
    # As one body, whose surface goes through itself.
    assert health.history(replace(run, spans=()), "crossed").values[:2] == pytest.approx([0, 100 * 1.0 / run.size])
