"""The worker's account of a run: its cost, states that come back, and failures."""

import numpy as np
import pytest
import shapes

from fem_reference.foundations.motion import RigidMotion
from tests.solvers.fenicsx.test_init import MUSCLE, bent, solved  # noqa: F401 - a fixture

pytestmark = pytest.mark.slow


def test_cost_says_where_the_time_went(bent) -> None:  # noqa: F811
    _, outcome, frames = bent
    cost = outcome.cost
    # And those to states halfway, where forces change much within a load step.
    assert 2 * sum(frame.scalars["newton_iterations"] for frame in frames) >= cost["newton_iterations"]
    assert cost["newton_iterations"] >= sum(frame.scalars["newton_iterations"] for frame in frames)
    assert cost["seconds_processor_solve"] == pytest.approx(sum(frame.scalars["seconds_processor"] for frame in frames))
    # Of a body so small one for each iteration, and one for the stability of each frame but the last two, which were solved before.
    assert cost["factorisations"] == cost["newton_iterations"] + len(frames) - 2
    assert cost["krylov_iterations"] >= cost["newton_iterations"]
    assert cost["load_steps"] >= 2
    spent = cost["seconds_solve"] + cost["seconds_stability"]
    assert spent >= cost["seconds_assembly"] + cost["seconds_factorisation"]
    phases = ("mesh", "set_up", "solve", "assembly", "contact", "factorisation", "krylov", "stability")
    assert all(cost[f"seconds_{phase}"] >= 0 for phase in phases)
    assert cost["unknowns"] == 3 * 5 * 5 * 13 + 3 * 3 * 7  # P2 nodes of a 2 x 2 x 6 Kuhn box, P1 nodes
    assert cost["peak_memory_mb"] > 10


def test_an_old_factorisation_serves_as_long_as_it_is_worth_it(bent) -> None:  # noqa: F811
    problem, direct, frames = bent
    for precision in ("single", "double"):
        lagged, found = solved(problem, ranks=1, linear_solver="lagged", precision=precision)
        assert lagged.cost["factorisations"] <= direct.cost["factorisations"] / 2
        for one, other in zip(frames, found, strict=True):
            assert np.abs(one.points - other.points).max() < 1e-9
            assert one.scalars["negative_modes"] == other.scalars["negative_modes"]


def test_a_pose_that_was_solved_before_needs_no_iteration(bent) -> None:  # noqa: F811
    """At rest again, and halfway there."""
    _, _, frames = bent
    assert [frame.scalars["newton_iterations"] > 0 for frame in frames] == [False, True, True, False, False]


def test_what_cannot_be_reached_is_a_status_that_keeps_the_frames_before() -> None:
    # The top is turned through half a circle about an axis within the bar: no admissible state, and no step is small enough.
    motion = RigidMotion((1, 0, 0), (5, 5, 9), (0.0, 1.0, 10.0), (0.0, 0.02, 3.1))
    problem = shapes.bar((1, 1, 1), (10, 10, 10), {"bottom": None, "top": motion}, MUSCLE, (0, 1, 10))
    outcome, frames = solved(problem, ranks=1, smallest_step=1.0)
    assert outcome.status in ("diverged", "inverted")
    assert outcome.message.endswith("try a smaller motion or smaller cells (muscle.tet_size)")
    assert "of cell" in outcome.message
    assert [frame.number for frame in frames] == [0, 1]
