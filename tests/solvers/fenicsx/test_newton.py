"""Newton's method: how fast it ends, where it stops, and what its record says."""

import numpy as np
import pytest

pytest.importorskip("fem_reference.solvers.fenicsx.dolfinx_door", reason="FEniCSx is not installed")

from fem_reference.problems import shapes
from fem_reference.problems.body import Body, Prescribed
from fem_reference.problems.paths import Affine, Rest
from fem_reference.solvers.fenicsx import BodySettings
from fem_reference.solvers.fenicsx.body import AssembledBody
from fem_reference.solvers.fenicsx.newton import stalled
from fem_reference.verification import parts

pytestmark = pytest.mark.filterwarnings("ignore:(cmap|dofmap) is deprecated")

STILL = ((0.0, 0.0, 0.0),) * 3
ALL = (0, 1, 2)


def built(lift: float, **settings) -> AssembledBody:
    """A block whose top goes up by ``lift`` [mm], of 1 mm, at frame 1."""
    mesh = shapes.box((2, 2, 2), (1.0, 1.0, 1.0), "hexahedron")
    lid = Prescribed("lid", "z1", ALL, Affine(STILL, (0.0, 0.0, lift)))
    body = Body(mesh, parts.neo_hooke(0.5, 20.0), (Prescribed("ground", "z0", ALL, Rest()), lid), (0.0, 1.0))
    return AssembledBody(body, BodySettings(element="Q2/Q1", first_step=1.0, **{"residual": 1e-11} | settings))


@pytest.mark.slow
def test_the_residual_of_a_smooth_body_falls_quadratically_at_the_end() -> None:
    """With each linear system solved exactly, the last steps above rounding at least nearly square the error."""
    found = built(0.2, linear_solver="direct").attempt(1.0)
    assert (found.status, found.detail) == ("converged", "")
    assert len(found.residuals) == found.iterations + 1
    assert found.residuals[-1] <= 1e-11 < found.residuals[-2]
    *_, first, second, third = [norm for norm in found.residuals if norm > 1e-13]
    assert np.log(second / third) / np.log(first / second) > 1.7


@pytest.mark.slow
def test_what_comes_back_to_rest_needs_no_iteration() -> None:
    found = built(0.0).attempt(1.0)
    assert (found.converged, found.iterations, len(found.residuals)) == (True, 0, 1)


@pytest.mark.slow
def test_what_is_not_a_number_is_refused_at_once() -> None:
    found = built(np.nan).attempt(1.0)
    assert not found.converged
    assert found.iterations == 0
    assert np.isnan(found.residuals[0])
    assert (
        found.detail
        == "Newton's method reached in 0 iterations a state where a law, or a prescribed path, has no value"
    )


@pytest.mark.slow
def test_too_few_iterations_are_named_and_the_last_good_state_is_back() -> None:
    body = built(0.2, newton_iterations=2)
    found = body.attempt(1.0)
    assert (found.status, found.iterations) == ("diverged", 2)
    assert found.detail == "Newton's method did not converge in 2 iterations"
    assert len(found.residuals) == 3
    assert not body.unknowns.x.array.any()


@pytest.mark.slow
def test_a_step_that_would_turn_cells_inside_out_is_halved() -> None:
    """The lid goes down by 0.95 of the height at once: a full step leaves too little of det F in the cells below it."""
    body = built(-0.95, newton_iterations=40)
    body.attempt(1.0)
    assert body.spent.counts["halved_steps"] >= 1


@pytest.mark.slow
def test_a_lid_below_the_ground_is_inverted_however_short_the_step() -> None:
    found = built(-1.5, newton_iterations=40).attempt(1.0)
    assert found.status == "inverted"
    assert found.detail.startswith("Newton's method ")


@pytest.mark.parametrize(
    ("residuals", "since"),
    [([3.0], 0), ([3.0, 1.0, 0.4], 0), ([3.0, 2.0, 1.6], 2), ([3.0, 1.0, 0.9, 0.8, 0.3], 0), ([1.0, np.inf, 0.9], 2)],
)
def test_progress_is_a_residual_of_half_the_best_before(residuals, since) -> None:
    assert stalled(residuals) == since
