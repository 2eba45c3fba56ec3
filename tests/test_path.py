"""States that do not belong to one path are not taken, and an unstable equilibrium is left where that is wanted."""

from dataclasses import replace

import numpy as np
import pytest
from test_stability import THIN, column, critical, flesh, session  # noqa: F401 - a fixture

from fem_reference import effects
from fem_reference.foundations.motion import Rotation, Translation
from fem_reference.problems import shapes
from fem_reference.problems.body import Body, Prescribed
from fem_reference.problems.paths import Follows, Rest, Turn
from fem_reference.solvers.fenicsx import BodySettings

pytestmark = pytest.mark.slow


def twisted(angle: float, frames: tuple[float, ...]) -> Body:
    """A bar whose end turns by ``angle`` [rad] from frame 0 to 1."""
    mesh = shapes.box((1, 1, 3), (1.0, 1.0, 3.0), "hexahedron")
    turn = Follows(Rotation((0, 0, 1), (0.5, 0.5, 0.0), (0.0, 1.0), (0.0, angle)).pose)
    fixed = Prescribed("foot", "z0", (0, 1, 2), Rest()), Prescribed("head", "z1", (0, 1, 2), turn)
    return Body(mesh, flesh("Q2/Q1"), fixed, frames)


@pytest.mark.parametrize("frames", [(0.0, 1.0), (0.0, 0.25, 0.5, 0.75, 1.0)])
def test_a_bar_that_is_twisted_by_a_whole_turn_is_not_at_rest(frames, session) -> None:  # noqa: F811
    """All that is prescribed is as at rest, which one step, or the state of before, would take for the answer."""
    solved = session.solve(twisted(2 * np.pi, frames), BodySettings(element="Q2/Q1", first_step=1.0))
    half = session.solve(twisted(np.pi, (0.0, 0.5, 1.0)), BodySettings(element="Q2/Q1", first_step=0.5))
    assert solved.outcome.status == half.outcome.status == "converged"
    assert solved.last.scalars["energy"] > 3 * half.last.scalars["energy"] > 0
    assert abs(solved.last.scalars["energy_gap"]) < 0.2


# A whole turn by frame 1, as a function of a caller's own.
WHIRLED = lambda points, frame: Turn((0, 0, 1), 2 * np.pi, (0.5, 0.5, 0.0))(points, min(frame, 1.0))  # noqa: E731


def knotted(*knots: tuple[float, float]) -> Follows:
    """A turn by angles [rad] at frames."""
    frames, angles = zip(*knots, strict=True)
    return Follows(Rotation((0, 0, 1), (0.5, 0.5, 0.0), frames, angles).pose)


@pytest.mark.parametrize(
    ("head", "last", "step"),
    [
        (knotted((0, 0), (2, 2 * np.pi)), 5.0, 5.0),  # it ends before the step's middle
        (knotted((0, 0), (1, 2 * np.pi)), 20.0, 20.0),
        (knotted((0, 0), (3, 0), (3.5, 2 * np.pi)), 20.0, 20.0),  # and begins after it
        (WHIRLED, 20.0, 20.0),
    ],
)
def test_a_whole_turn_within_a_load_step_is_not_left_out(head, last, step, session) -> None:  # noqa: F811
    """Whichever load steps lead there, the end is that of a turn by quarters, or the other state into which the bar buckles under
    a whole turn: they store 0.01126 and 0.01120 N mm, and one that is not twisted nothing.
    """
    quarters = session.solve(twisted(2 * np.pi, (0.0, 0.25, 0.5, 0.75, 1.0)), BodySettings(element="Q2/Q1"))
    body = twisted(0.0, (0.0, last))
    body = replace(body, prescribed=(body.prescribed[0], replace(body.prescribed[1], path=head)))
    solved = session.solve(body, BodySettings(element="Q2/Q1", first_step=step))
    assert solved.outcome.status == quarters.outcome.status == "converged"
    assert solved.outcome.cost["load_steps"] >= 4
    assert solved.last.scalars["energy"] == pytest.approx(quarters.last.scalars["energy"], rel=0.01)
    assert quarters.last.scalars["energy"] > 0.01


def test_drag_feels_a_way_there_and_back_within_a_load_step(session) -> None:  # noqa: F811
    """A bar that is moved there and back within one step of its own is behind afterwards."""
    slide = Follows(Translation((1, 0, 0), (0.0, 0.4, 0.8), (0.0, 1.0, 0.0)).pose)
    acting = (*flesh("Q2/Q1"), effects.make("damping", coefficient=1e-3))
    body = replace(twisted(0.0, (0.0, 0.8)), effects=acting, interval=1.0)
    body = replace(body, prescribed=(replace(body.prescribed[0], path=slide),))
    assert body.stops == (0.4,)
    solved = session.solve(body, BodySettings(element="Q2/Q1", first_step=1.0))
    assert solved.outcome.status == "converged"
    assert np.abs(solved.last.points - body.mesh.points).max() > 1e-3


@pytest.mark.parametrize("element", ["P2/P1", "P1/P1"])
def test_what_the_energy_grows_by_is_the_work_of_the_forces(element, session) -> None:  # noqa: F811
    """By the trapezoidal rule, whose error of a step falls with its cube and the energy with its square; where pressures are
    stabilised too, whose energy is a part of it.
    """
    mesh = shapes.box((2, 2, 4), (1.0, 1.0, 3.0), "tetrahedron")
    turn = Follows(Rotation((0, 1, 0), (0.5, 0.5, 1.5), (0.0, 1.0), (0.0, 0.6)).pose)
    fixed = Prescribed("foot", "z0", (0, 1, 2), Rest()), Prescribed("head", "z1", (0, 1, 2), turn)
    gaps = []
    for steps in (4, 8):
        frames = tuple(np.linspace(0.0, 1.0, steps + 1).tolist())
        solved = session.solve(Body(mesh, flesh(element), fixed, frames), BodySettings(element=element, first_step=1.0))
        gaps.append(abs(solved.last.scalars["energy_gap"]))
    assert gaps[0] / gaps[1] > 4


def test_a_column_leaves_the_straight_state_where_it_is_unstable(session) -> None:  # noqa: F811
    body = column("Q2/Q1", (1, 1, 10), [0.97 * critical(THIN), 1.1 * critical(THIN)])
    straight, bent = (
        session.solve(body, BodySettings(element="Q2/Q1", first_step=100.0, follow=follow))
        for follow in ("equilibrium", "stable")
    )
    assert [state.scalars["negative_modes"] for state in straight.states] == [0, 0, 1]
    assert [state.scalars["negative_modes"] for state in bent.states] == [0, 0, 0]
    assert bent.last.scalars["energy"] < straight.last.scalars["energy"]
    aside = [np.ptp(solved.last.points[:, 0]) for solved in (straight, bent)]
    assert aside[1] > 1.2 * aside[0]
    assert (
        "in 1 of them an unstable equilibrium was left along its lowest mode, first at frame 2" in bent.outcome.message
    )
    assert "unstable" in straight.outcome.message
