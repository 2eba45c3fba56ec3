"""Friction between parts of a surface in load steps: what sticks goes along, what slides loses work, and a turn costs nothing."""

import sys
from dataclasses import dataclass, replace

import cloudpickle
import numpy as np
import pytest

from fem_reference.problems import shapes
from fem_reference.problems.body import Body, Prescribed
from fem_reference.problems.paths import Affine, Turn
from fem_reference.problems.touching import Touching
from fem_reference.verification import parts

pytestmark = pytest.mark.slow

LAW = Touching("low_z1", "high_z0", 0.01, 0.002, 0.3)


def pair(path, law: Touching = LAW, below=None) -> Body:
    """A block on a clamped one, pressed from the start, whose top goes a ``path``; the bottom goes the path ``below``."""
    low, high = (
        shapes.box((2, 2, 1), (1.0, 1.0, 0.3), "hexahedron"),
        shapes.box((1, 1, 1), (0.5, 0.5, 0.3), "hexahedron"),
    )
    mesh = shapes.joined({"low": low, "high": replace(high, points=high.points + [0.2, 0.2, 0.299])})
    ground = (Prescribed("low_z0", "low_z0", (0, 1, 2), below),) if below else parts.clamped("low_z0")
    top = Prescribed("top", "high_z1", (0, 1, 2), path)
    return Body(mesh, parts.neo_hooke(0.01, 0.1), (*ground, top), (0.0, 1.0), touching=(law,))


def solved(lab, body: Body):
    return lab.solve(body, "Q1/P0", first_step=0.25, residual=1e-13).last


@dataclass(frozen=True)
class Along:
    """The path of 0.01 mm along x from frame to frame."""

    def __call__(self, points: np.ndarray, frame: float) -> np.ndarray:
        return np.tile([0.01 * frame, 0.0, 0.0], (len(points), 1))


cloudpickle.register_pickle_by_value(sys.modules[__name__])  # to the process that solves, which cannot import it


def shifted(x: float) -> Affine:
    return Affine(parts.NO_GRADIENT, (x, 0.0, 0.0))


def test_a_small_shift_sticks_and_loses_no_work(fem_lab) -> None:
    state = solved(fem_lab, pair(shifted(5e-5)))
    force = state.forces["low_z1 on high_z0"]
    assert -0.3 * force[2] < force[0] < -0.01 * force[2]
    assert state.scalars["touching_friction_work"] == pytest.approx(0, abs=1e-13)


def test_a_large_one_slides_and_a_body_without_friction_feels_nothing_of_it(fem_lab) -> None:
    rough, smooth = (solved(fem_lab, pair(shifted(0.1), replace(LAW, friction=one))) for one in (0.3, None))
    force, other = rough.forces["low_z1 on high_z0"], smooth.forces["low_z1 on high_z0"]
    assert force[0] == pytest.approx(-0.3 * force[2], rel=5e-3)  # faces tilt by the pressure over the moduli
    assert abs(other[0]) < 1e-3 * other[2]
    assert "touching_friction_work" not in smooth.scalars
    # Almost all of the path is slip.
    assert rough.scalars["touching_friction_work"] == pytest.approx(abs(force[0]) * 0.1, rel=0.05)


def test_a_turn_of_both_is_no_slip(fem_lab) -> None:
    turn = Turn((0.0, 1.0, 0.0), 0.5, (0.0, 0.0, 0.0))
    still, turned = solved(fem_lab, pair(shifted(0.0))), solved(fem_lab, pair(turn, below=turn))
    c, s = np.cos(0.5), np.sin(0.5)
    rotation = np.array([[c, 0, s], [0, 1, 0], [-s, 0, c]])
    # The residual of 1e-13 N, at several unknowns.
    assert turned.forces["low_z1 on high_z0"] == pytest.approx(rotation @ still.forces["low_z1 on high_z0"], abs=1e-11)
    assert turned.scalars["touching_friction_work"] == pytest.approx(still.scalars["touching_friction_work"], abs=1e-12)


def test_no_friction_acts_while_an_overlap_at_rest_is_removed(fem_lab) -> None:
    # 1 um of overlap, as in all tests here, is removed from frame 0 to 1, while the top goes 0.01 mm aside and on to 0.02.
    def states(friction: float | None):
        body = pair(Along(), replace(LAW, friction=friction, relaxed=(0.0, 1.0)))
        run = fem_lab.solve(replace(body, frames=(0.0, 1.0, 2.0)), "Q1/P0", first_step=0.25, residual=1e-13)
        assert run.outcome.status == "converged"
        return run.states

    rough, smooth = states(0.3), states(None)
    assert rough[1].points == pytest.approx(smooth[1].points, abs=1e-9)
    assert [one.scalars["touching_friction_work"] for one in rough[:2]] == [0, 0]
    force = rough[2].forces["low_z1 on high_z0"]
    assert force[0] == pytest.approx(-0.3 * force[2], rel=5e-3)  # as above
    # Slip is counted from frame 1 on, 0.01 mm; the tangential spring has k = 0.01 MPa/mm and a limit of less than 1e-4 MPa.
    assert 0 < rough[2].scalars["touching_friction_work"] <= abs(force[0]) * 0.01
