"""Multigrid solves the system that it is given, with a preconditioner of its own or a stale one."""

import numpy as np
import pytest

pytest.importorskip("fem_reference.solvers.fenicsx.dolfinx_door", reason="FEniCSx is not installed")

from fem_reference.problems import shapes
from fem_reference.problems.body import Body, Prescribed
from fem_reference.problems.paths import Rest
from fem_reference.solvers.fenicsx import BodySettings
from fem_reference.solvers.fenicsx.body import AssembledBody
from fem_reference.solvers.fenicsx.linear import LinearSolveError
from fem_reference.solvers.fenicsx.multigrid import Multigrid
from fem_reference.verification import parts

pytestmark = [pytest.mark.slow, pytest.mark.filterwarnings("ignore:(cmap|dofmap) is deprecated")]


@pytest.fixture(scope="module")
def body() -> AssembledBody:
    mesh = shapes.box((2, 2, 4), (1.0, 1.0, 2.0), "tetrahedron")
    fixed = (Prescribed("ground", "z0", (0, 1, 2), Rest()),)
    settings = BodySettings(element="P2/P1", linear_solver="multigrid")
    return AssembledBody(Body(mesh, parts.neo_hooke(0.01, 10.0), fixed, (0.0, 1.0)), settings)


def remaining(body: AssembledBody, tolerance: float) -> float:
    """The residual of a solution for random forces, over these."""
    forces = body.system.b.duplicate()
    forces.array[:] = np.where(body.system.fixed, 0.0, np.random.default_rng(1).normal(size=body.system.size))
    found, image = forces.duplicate(), forces.duplicate()
    body.linear.solve(forces, found, tolerance)
    body.system.matrix.mult(found, image)
    return (image - forces).norm() / forces.norm()


@pytest.mark.parametrize("tolerance", [1e-3, 1e-9])
def test_a_system_is_solved_up_to_the_tolerance(body, tolerance) -> None:
    assert isinstance(body.linear, Multigrid)
    body.system.linearise()
    assert remaining(body, tolerance) <= 1.01 * tolerance


def test_a_stale_preconditioner_serves_a_matrix_that_changed_a_little(body) -> None:
    before = body.spent.counts["factorisations"]
    places = body.displacement.space.tabulate_dof_coordinates()
    body.unknowns.x.array[body.displacement.dofs] = 0.01 * places
    body.system.linearise()
    assert remaining(body, 1e-6) <= 1.01e-6
    assert body.spent.counts["factorisations"] == before


def test_it_has_no_exact_way_and_says_where_it_fails(body) -> None:
    assert not body.linear.solve_exactly()
    with pytest.raises(LinearSolveError, match="multigrid does not converge in 200 iterations"):
        remaining(body, 1e-30)
