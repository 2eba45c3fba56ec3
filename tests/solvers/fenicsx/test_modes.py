"""Limit points are foreseen where they are near, and claimed nowhere else; an unstable equilibrium is left where that is wanted."""

from dataclasses import replace

import numpy as np
import pytest

pytest.importorskip("fem_reference.solvers.fenicsx.dolfinx_door", reason="FEniCSx is not installed")

from fem_reference.geometry.skins import Skin
from fem_reference.problems import shapes
from fem_reference.problems.body import Body, Prescribed
from fem_reference.problems.paths import Affine, Rest
from fem_reference.solvers.fenicsx import BodySettings, modes
from fem_reference.solvers.fenicsx.body import AssembledBody
from fem_reference.verification import parts
from tests.solvers.fenicsx.test_stability import THIN, column, critical

pytestmark = [pytest.mark.slow, pytest.mark.filterwarnings("ignore:(cmap|dofmap) is deprecated")]

STILL = ((0.0, 0.0, 0.0),) * 3


def test_a_limit_point_is_claimed_within_four_of_the_smallest_steps_only() -> None:
    """A shallow arch that a soft spring pulls down, solved up to 0.02 of a frame before the one that is foreseen."""
    straight = shapes.box((8, 1, 1), (20.0, 1.0, 1.0), "tetrahedron")
    rise = 2.5 * (1 - np.abs(straight.points[:, [0]] - 10) / 10)
    mesh = replace(straight, points=straight.points + rise * [0, 0, 1])
    top = np.array([[9.9, 0.45, 3.4]])
    cell = np.argmin(np.linalg.norm(mesh.points[mesh.cells].mean(axis=1) - top, axis=1))
    spring = Prescribed("pull", Skin(np.array([cell]), top, np.ones(1)), (2,), Affine(STILL, (0.0, 0.0, -8.0)), 5e-5)
    ends = tuple(Prescribed(end, end, (0, 1, 2), Rest()) for end in ("x0", "x1"))
    body = Body(mesh, parts.neo_hooke(0.01, 10.0), (*ends, spring), (0.0, 1.0))
    built = AssembledBody(body, BodySettings(element="P2/P1", first_step=0.1, residual=1e-10))
    for frame in (0.1, 0.2, 0.24):
        assert built.attempt(frame).converged
    far = modes.ahead(built, 0.05)
    assert far is not None
    left = far.frame - built.at
    assert 0 < left < 0.05
    near = modes.ahead(built, left / 3.5)
    assert near is not None
    assert near.frame - built.at == pytest.approx(left, rel=0.05)  # its slope is taken over a shorter way
    assert modes.ahead(built, left / 5) is None


def test_a_column_leaves_the_straight_state_where_it_is_unstable(session) -> None:
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
        "in 1 of them the run moved off an unstable equilibrium along its lowest mode, first at frame 2"
        in bent.outcome.message
    )
    assert "unstable" in straight.outcome.message
