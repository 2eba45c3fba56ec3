"""Time in load steps: it must be known, and a failed step takes none."""

from dataclasses import replace

import pytest

from fem_reference.foundations.errors import InputError
from fem_reference.problems import shapes
from fem_reference.problems.body import Body, Prescribed
from fem_reference.problems.checks import check
from fem_reference.problems.paths import Affine
from fem_reference.scenes import casefile
from fem_reference.solvers.fenicsx import BodySettings
from tests.solvers.fenicsx.test_damping import DRAG
from tests.solvers.fenicsx.test_stability import effect, flesh

pytestmark = pytest.mark.slow


def test_the_time_from_frame_to_frame_must_be_known() -> None:
    drag = {"name": "damping", "coefficient": "1 Pa s/mm^2"}
    with pytest.raises(
        InputError, match=r"frames.interval: got nothing, want the time .* effect\[0\] \(Damping\) needs"
    ):
        casefile.read("hip_flexion", changes={"effect[0]": drag})
    body = Body(shapes.box((1, 1, 1), (1.0, 1.0, 1.0), "tetrahedron"), (*flesh("P2/P1"), DRAG), (), (0.0, 1.0))
    with pytest.raises(
        InputError, match="interval: got nothing, want the time from a frame number to the next, which an"
    ):
        check(body, "P2/P1")
    check(replace(body, interval=0.1), "P2/P1")


def test_a_step_that_fails_leaves_the_clock_alone(session) -> None:
    # One Newton iteration is not enough for the whole step: it is cut, and the block falls as far as its drag allows.
    mesh = shapes.box((1, 1, 1), (1.0, 1.0, 1.0), "tetrahedron")
    ramp = [{"frame": 0, "amount": 0.0}, {"frame": 1, "amount": 1.0}]
    weight = effect("gravity", density="1000 kg/m^3", acceleration="0, 0, -10 m/s^2", ramp=ramp)
    turn = Prescribed("z1", "z1", (0,), Affine(((0.0, 0.0, 0.0), (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)), (0.5, 0.0, 0.0)))
    body = Body(mesh, (*flesh("P2/P1"), weight, DRAG), (turn,), (0.0, 1.0, 3.0), interval=0.1)
    tight = session.solve(body, BodySettings(first_step=1.0, residual=1e-12, newton_iterations=3, smallest_step=0.001))
    loose = session.solve(body, BodySettings(first_step=1.0, residual=1e-12))
    cuts = [sum(state.scalars["cut_backs"] for state in one.states) for one in (tight, loose)]
    assert cuts[0] > 0 == cuts[1]
    speeds = [(one.last.points - one.states[1].points)[:, 2].mean() / 0.2 for one in (tight, loose)]
    assert speeds == pytest.approx([-1e-5 / 1e-6] * 2, rel=1e-2)
