"""Reaction forces and moments are in balance, and what regions share counts once."""

import numpy as np
import pytest

from fem_reference.problems.body import Body, Prescribed
from fem_reference.problems.paths import Affine, Rest, Turn
from fem_reference.solvers.fenicsx.jobs import Job
from tests.solvers.fenicsx.test_body import ALL, BOTH, FLESH, box, session, settings, turned  # noqa: F401 - a fixture

pytestmark = pytest.mark.slow


@BOTH
def test_forces_and_moments_of_a_turned_bar_are_in_balance(element, session) -> None:  # noqa: F811
    turn = Turn((1.0, 0.0, 2.0), 0.5, (0.5, 0.5, 2.0))
    state = session.solve(turned(box(element, (2, 2, 4), (1.0, 1.0, 2.0)), turn), settings(element)).last
    assert np.linalg.norm(state.forces["top"]) > 1e-4
    assert np.linalg.norm(state.moments["top"]) > 1e-4
    # Rigid velocities are in the space, so that both sums are the work of 1e-12 N out of balance along them.
    assert sum(state.forces.values()) == pytest.approx(np.zeros(3), abs=1e-11)
    assert sum(state.moments.values()) == pytest.approx(np.zeros(3), abs=1e-11)


def test_what_attachments_share_counts_once(session) -> None:  # noqa: F811
    # Two regions meet in an edge and both prescribe it. Of a muscle, which has points to be followed, all forces are in balance.
    fixed = (
        Prescribed("bottom", "z0", ALL, Rest()),
        Prescribed("side", "x0", ALL, Affine(((0.0, 0.0, 0.0), (0.0, 0.0, 0.1), (0.0, 0.0, -0.2)))),
        Prescribed("top", "z1", ALL, Affine(((0.0, 0.0, 0.0),) * 3, (0.0, 0.1, -0.2))),
    )
    body = Body(box("P2/P1"), FLESH, fixed, (0.0, 1.0))
    centre = body.mesh.points[body.mesh.cells[0]].mean(axis=0)
    found = []
    outcome = session.run(Job(body, settings("P2/P1"), {"surface": (np.array([0]), centre[None])}), None, found.append)
    assert outcome.status == "converged"
    forces = [found[-1].forces[entry.name] for entry in fixed]
    assert np.abs(forces[1]).max() > 1e-4
    assert np.abs(sum(forces)).max() < 1e-10
    # Of a body of the catalogue each region has all of what its unknowns take.
    whole = session.solve(body, settings("P2/P1")).last.forces
    assert np.abs(sum(whole.values())).max() > 1e-4
