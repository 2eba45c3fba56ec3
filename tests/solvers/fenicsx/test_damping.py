"""A drag that needs time: what must be known of it, what it leaves alone, and how an unstable state is left."""

from dataclasses import replace

import numpy as np
import pytest

from fem_reference.foundations.errors import InputError
from fem_reference.problems import shapes
from fem_reference.problems.body import Body, Prescribed
from fem_reference.problems.paths import Affine, Rest
from fem_reference.solvers.fenicsx import BodySettings
from fem_reference.solvers.scikit_fem import ScikitBodySettings as OtherSettings
from fem_reference.solvers.scikit_fem import solve_body
from tests.solvers.fenicsx.test_stability import LENGTH, STILL, THIN, column, critical, effect, flesh

pytestmark = pytest.mark.slow

DRAG = effect("damping", coefficient="1 Pa s/mm^2")


def test_the_second_opinion_has_no_time() -> None:
    mesh = shapes.box((1, 1, 1), (1.0, 1.0, 1.0), "tetrahedron")
    body = Body(mesh, (*flesh("P2/P1"), DRAG), (), (0.0, 1.0), interval=1.0)
    with pytest.raises(
        InputError, match="effects: got Damping, want effects without rates, as this solver has no time steps"
    ):
        solve_body(body, OtherSettings())


def stretched(acting, interval: float | None = None, speed: float = 1.0) -> Body:
    """A block stretched by a half until frame 1 / ``speed``, and then fixed for 40 frames."""
    pull = Affine(STILL, (0.0, 0.0, 0.5), ((0.0, 0.0), (1 / speed, 1.0)))
    fixed = Prescribed("z0", "z0", (0, 1, 2), Rest()), Prescribed("z1", "z1", (0, 1, 2), pull)
    mesh = shapes.box((1, 1, 2), (1.0, 1.0, 1.0), "tetrahedron")
    return Body(mesh, acting, fixed, (0.0, 1 / speed, 1 / speed + 40), interval=interval)


def test_what_is_fixed_long_enough_ends_where_it_would_without(session) -> None:
    # A drag of 1e-6 MPa s/mm2 over 1 mm2 against a stiffness of 0.01 MPa: it has settled in a ten-thousandth of a frame of 1 s.
    settings = BodySettings(first_step=0.5, residual=1e-12)
    without, slow = (
        session.solve(body, settings).last
        for body in (stretched(flesh("P2/P1")), stretched((*flesh("P2/P1"), DRAG), 1.0))
    )
    assert slow.points == pytest.approx(without.points, abs=1e-9)
    assert slow.scalars["energy"] == pytest.approx(without.scalars["energy"], rel=1e-9)
    assert slow.forces["z1"] == pytest.approx(without.forces["z1"], abs=1e-9)


def test_speed_costs_force_but_stores_nothing(session) -> None:
    # The mean speed of the block is half that of its end, 0.5 mm a frame of 1 ms: its drag has to be limited by both ends.
    settings = BodySettings(first_step=100.0, residual=1e-12)
    fast, still = (
        session.solve(stretched(acting, 1e-3), settings).states[1]
        for acting in ((*flesh("P2/P1"), DRAG), flesh("P2/P1"))
    )
    drag = 1e-6 * (fast.points[:, 2] - shapes.box((1, 1, 2), (1.0, 1.0, 1.0), "tetrahedron").points[:, 2]).mean() / 1e-3
    assert fast.forces["z0"][2] + fast.forces["z1"][2] == pytest.approx(
        drag, rel=0.05
    )  # P2 moves its middle plane a little more
    assert still.forces["z0"][2] + still.forces["z1"][2] == pytest.approx(0, abs=1e-11)
    assert fast.scalars["energy"] == pytest.approx(still.scalars["energy"], rel=0.05)


@pytest.fixture(scope="module")
def leaning(session):
    """The states of a column at 1.4 of Euler's shortening for 40 frames of 1 s; the diagonals of its tets bend it."""
    body = column("P2/P1", (1, 1, 20), [1.4 * critical(THIN)])
    drag = effect("damping", coefficient="0.5 Pa s/mm^2")
    frames = tuple(np.arange(41.0).tolist())
    timed = replace(body, effects=(*body.effects, drag), frames=frames, interval=1.0)
    return timed, session.solve(timed, BodySettings(first_step=1.0, residual=1e-11))


def bend(solved) -> np.ndarray:
    return np.array([np.abs((state.points - solved.states[0].points)[:, 0]).max() for state in solved.states])


def test_an_unstable_column_is_left_in_time(leaning) -> None:
    _, solved = leaning
    assert solved.outcome.status == "converged", solved.outcome.message
    found = [state.scalars["negative_modes"] for state in solved.states]
    assert (found[0], found[1], found[-1]) == (0, 1, 0)
    assert np.count_nonzero(np.diff(found)) == 2
    # It ends where a cosine of amplitude a takes up what is too much: (pi a / 4 L)^2. These tets are stiffer by up to 5 per cent,
    # which is 7 per cent of a.
    amplitude = 4 * LENGTH / np.pi * np.sqrt(0.4 * critical(THIN))
    assert bend(solved)[-1] == pytest.approx(amplitude, rel=0.07)
    assert bend(solved)[-1] == pytest.approx(bend(solved)[-2], rel=1e-6)


def test_it_leaves_as_fast_as_its_drag_allows(leaning) -> None:
    # Rayleigh's quotient of 1 - cos(k z), (P - P_c) k^2 / 3 c A, is below the truth, here by 5 per cent; stiffer tets are slower.
    _, solved = leaning
    rate = 3 * 0.01 * 0.4 * critical(THIN) * (np.pi / LENGTH) ** 2 / 3 / 5e-7
    steps = bend(solved)[4:8]
    assert 1 - steps[:-1] / steps[1:] == pytest.approx(rate, rel=0.1)


def test_a_step_that_is_too_long_stays_in_the_unstable_state_and_reports_it(leaning, session) -> None:
    # The bend grows by a factor e in 2.5 s.
    body, _ = leaning
    solved = session.solve(replace(body, frames=(0.0, 1.0, 40.0)), BodySettings(first_step=100.0, residual=1e-11))
    assert bend(solved)[-1] < 0.01
    assert solved.outcome.message.endswith(
        "in 2 of them the equilibrium is unstable, first at frame 1 "
        "(negative modes: up to 1, at least 1 of them due to the material)"
    )
