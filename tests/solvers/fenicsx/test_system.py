"""The equations of a body: rest is in balance, the tangent is the slope of the residual, what is prescribed is left out."""

import numpy as np
import pytest

pytest.importorskip("fem_reference.solvers.fenicsx.dolfinx_door", reason="FEniCSx is not installed")

from fem_reference.problems import shapes
from fem_reference.problems.body import Body, Prescribed
from fem_reference.problems.paths import Rest
from fem_reference.solvers.fenicsx import BodySettings
from fem_reference.solvers.fenicsx.body import AssembledBody
from fem_reference.verification import parts

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
