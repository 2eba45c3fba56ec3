"""The equations of a body: rest is in balance, the tangent is the slope of the residual, what is prescribed is left out.

Reaction forces and moments are in balance, and what regions share counts once.
"""

import numpy as np
import pytest

pytest.importorskip("fem_reference.solvers.fenicsx.dolfinx_door", reason="FEniCSx is not installed")

from fem_reference.problems import shapes
from fem_reference.problems.body import Body, Prescribed
from fem_reference.problems.paths import Affine, Rest, Turn
from fem_reference.solvers.fenicsx import BodySettings
from fem_reference.solvers.fenicsx.body import AssembledBody
from fem_reference.solvers.fenicsx.jobs import Job
from fem_reference.verification import parts
from tests.solvers.fenicsx.test_body import ALL, BOTH, FLESH, box, settings, turned

pytestmark = [pytest.mark.slow, pytest.mark.filterwarnings("ignore:(cmap|dofmap) is deprecated")]


@pytest.fixture(scope="module")
def body() -> AssembledBody:
    """A block that is fixed below, and pulled by springs above."""
    mesh = shapes.box((1, 1, 2), (1.0, 1.0, 2.0), "tetrahedron")
    ground = Prescribed("ground", "z0", (0, 1, 2), Rest())
    springs = Prescribed("springs", "z1", (0, 1, 2), Rest(), 0.02)
    return AssembledBody(
        Body(mesh, parts.neo_hooke(0.5, 20.0), (ground, springs), (0.0, 1.0)), BodySettings(element="P2/P1")
    )


def shaken(body: AssembledBody, size: float) -> np.ndarray:
    shaking = np.random.default_rng(3).normal(size=body.system.size) * size
    return np.where(body.system.fixed, 0.0, shaking)


def residual(body: AssembledBody, unknowns: np.ndarray) -> np.ndarray:
    body.unknowns.x.array[:] = unknowns
    body.system.residual()
    return np.array(body.system.b.array)


def test_rest_is_in_balance(body) -> None:
    body.unknowns.x.array[:] = 0
    assert body.system.residual() < 1e-15
    assert not body.system.lacking()


def test_the_tangent_is_the_slope_of_the_residual(body) -> None:
    here, along, step = shaken(body, 0.02), shaken(body, 1.0), 1e-6
    slope = (residual(body, here + step * along) - residual(body, here - step * along)) / (2 * step)
    body.unknowns.x.array[:] = here
    body.system.linearise()
    direction, image = body.system.b.duplicate(), body.system.b.duplicate()
    direction.array[:] = along / body.system.scale
    body.system.matrix.mult(direction, image)
    assert image.array == pytest.approx(slope, abs=1e-6 * np.abs(slope).max())


def test_what_is_prescribed_is_left_out_and_missed_where_it_is_not_there(body) -> None:
    moved = np.where(body.system.fixed, 0.1, 0.0)
    assert not residual(body, moved)[body.system.fixed].any()
    assert body.system.missing() == pytest.approx(moved)
    assert body.system.lacking()


@BOTH
def test_forces_and_moments_of_a_turned_bar_are_in_balance(element, session) -> None:
    turn = Turn((1.0, 0.0, 2.0), 0.5, (0.5, 0.5, 2.0))
    state = session.solve(turned(box(element, (2, 2, 4), (1.0, 1.0, 2.0)), turn), settings(element)).last
    assert np.linalg.norm(state.forces["top"]) > 1e-4
    assert np.linalg.norm(state.moments["top"]) > 1e-4
    # Rigid velocities are in the space, so that both sums are the work of 1e-12 N out of balance along them.
    assert sum(state.forces.values()) == pytest.approx(np.zeros(3), abs=1e-11)
    assert sum(state.moments.values()) == pytest.approx(np.zeros(3), abs=1e-11)


def test_what_attachments_share_counts_once(session) -> None:
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
