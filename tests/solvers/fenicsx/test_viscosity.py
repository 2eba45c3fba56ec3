"""Viscosity of the matrix: what must be known of it, what it leaves alone, and how an unstable state is left."""

from dataclasses import replace

import numpy as np
import pytest
from acting import TURN, deformations, make, state

from fem_reference.effects import total_energy
from fem_reference.foundations.errors import InputError
from fem_reference.problems import shapes
from fem_reference.problems.body import Body, Prescribed
from fem_reference.problems.checks import check
from fem_reference.problems.paths import Affine, Turn
from fem_reference.scenes import casefile
from fem_reference.solvers.fenicsx import BodySettings
from fem_reference.solvers.scikit_fem import ScikitBodySettings as OtherSettings
from fem_reference.solvers.scikit_fem import solve_body
from fem_reference.verification.parts import SYMMETRY
from tests.solvers.fenicsx.test_stability import STILL, THIN, column, critical, effect, flesh

pytestmark = pytest.mark.slow

THICK = effect("viscosity", eta="20 kPa s")  # with mu = 10 kPa it creeps at 1/2 a second


# The law


def test_turning_a_body_costs_nothing() -> None:
    # However it is turned before the step and after it; a state that is not turned back from where it was costs something.
    effect, at = make("viscosity"), state(np.eye(3))
    for F in deformations():
        one = effect.energy(replace(at, F=F))
        both = replace(at, F=TURN @ F, F_before=TURN.T @ np.array(at.F_before))
        assert one > 1e-4
        assert effect.energy(both) == pytest.approx(one, rel=1e-11)
        assert effect.energy(replace(at, F=TURN @ F, F_before=F)) == pytest.approx(0, abs=1e-26)
    assert effect.energy(replace(at, rate=0.0)) == 0
    assert effect.stored is False


def test_viscosity_does_not_see_the_orientation_of_the_material_or_what_it_was_at_rest() -> None:
    effect, at = make("viscosity"), state(np.eye(3))
    for F, other in zip(deformations(), deformations()[1:], strict=False):
        # Per volume before the step, of which f = F F_before^-1 is the only deformation.
        f = F @ np.linalg.inv(np.array(at.F_before))
        now = replace(at, F=f @ other, F_before=other)
        per_volume = [effect.energy(one) / np.linalg.det(np.array(one.F_before)) for one in (replace(at, F=F), now)]
        assert per_volume[1] == pytest.approx(per_volume[0], rel=1e-10)


def test_viscous_stress_is_twice_the_viscosity_times_the_rate_of_deformation() -> None:
    # At F = (1 + L dt) F_before: the Cauchy stress, slope F^T / J, with D the symmetric part of L, to first order in dt = 1e-5.
    effect, dt = make("viscosity"), 1e-5
    L = np.array([[0.3, 0.5, -0.2], [0.1, -0.4, 0.7], [0.0, 0.2, 0.2]])
    for before in deformations():
        F = (np.eye(3) + dt * L) @ before
        at, slope = replace(state(F), F_before=before, rate=1 / dt), np.empty((3, 3))
        for place in np.ndindex(3, 3):
            change = np.zeros((3, 3))
            change[place] = 1e-6
            after, ahead = (effect.energy(replace(at, F=F + sign * change)) for sign in (1, -1))
            slope[place] = (after - ahead) / 2e-6
        stress = slope @ F.T / np.linalg.det(F)
        assert stress == pytest.approx(0.3 * (L + L.T), abs=1e-4)
    still = replace(state(before), F_before=before)
    change = 1e-6 * TURN
    assert effect.energy(replace(still, F=before + change)) == pytest.approx(
        effect.energy(replace(still, F=before - change)), rel=1e-5
    )  # no slope where nothing moves, only a valley of second order


def test_a_prestrain_that_comes_moves_nothing() -> None:
    acting = [(make("prestretch"), 1.0), (make("viscosity"), 1.0)]
    at = state(np.eye(3))
    assert total_energy(acting, replace(at, F_before=at.F)) == pytest.approx(0, abs=1e-26)
    F = deformations()[2]
    alone = make("viscosity").energy(state(F))
    assert total_energy(acting, state(F)) == pytest.approx(alone, rel=1e-11)  # as prestretch keeps the volume


# Bodies


def test_the_time_from_frame_to_frame_must_be_known() -> None:
    thick = {"name": "viscosity", "eta": "20 kPa s"}
    with pytest.raises(
        InputError, match=r"frames.interval: got nothing, want the time .* effect\[0\] \(Viscosity\) needs"
    ):
        casefile.read("hip_flexion", changes={"effect[0]": thick})
    body = Body(shapes.box((1, 1, 1), (1.0, 1.0, 1.0), "tetrahedron"), (*flesh("P2/P1"), THICK), (), (0.0, 1.0))
    with pytest.raises(InputError, match="interval: got nothing, want the time from a frame number to the next"):
        check(body, "P2/P1")
    with pytest.raises(
        InputError, match="effects: got Viscosity, want effects without rates, as this solver has no time steps"
    ):
        solve_body(replace(body, interval=1.0), OtherSettings())


def pulled(acting, interval: float | None = None) -> Body:
    """A block stretched by a half until frame 1, free to thin, and then fixed for 40 frames."""
    fixed = *SYMMETRY, Prescribed("z1", "z1", (2,), Affine(STILL, (0.0, 0.0, 0.5)))
    mesh = shapes.box((1, 1, 1), (1.0, 1.0, 1.0), "tetrahedron")
    return Body(mesh, acting, fixed, (0.0, 1.0, 41.0), interval=interval)


def test_speed_costs_force_and_what_is_fixed_long_enough_ends_where_it_would_without(session) -> None:
    settings = BodySettings(first_step=1.0, residual=1e-12)
    still, thick = (
        session.solve(body, settings)
        for body in (pulled(flesh("P2/P1")), pulled((*flesh("P2/P1"), THICK), interval=10.0))
    )
    # By hand of a step to l: 2 eta rate (e_z l - e_x / l^2), e_z = (l^2 - 1)/2 and e_x = (1/l - 1)/2; volume changes by 1e-3.
    more = thick.states[1].forces["z1"][2] - still.states[1].forces["z1"][2]
    assert more == pytest.approx(2 * 0.02 / 10 * (1.25 / 2 * 1.5 + 1 / 6 / 1.5**2), rel=3e-3)
    assert thick.states[1].scalars["energy"] == pytest.approx(still.states[1].scalars["energy"], rel=3e-3)
    # What is fixed still has no viscous stress.
    assert thick.last.points == pytest.approx(still.last.points, abs=1e-9)
    assert thick.last.scalars["energy"] == pytest.approx(still.last.scalars["energy"], rel=1e-9)
    assert thick.last.forces["z1"] == pytest.approx(still.last.forces["z1"], abs=1e-9)


def test_turning_costs_nothing_however_fast(session) -> None:
    mesh = shapes.box((1, 1, 1), (1.0, 1.0, 1.0), "tetrahedron")
    turn = Turn((1.0, 2.0, 3.0), 1.0)
    fixed = tuple(Prescribed(face, face, (0, 1, 2), turn) for face in ("x0", "x1", "y0", "y1", "z0", "z1"))
    body = Body(mesh, (*flesh("P2/P1"), THICK), fixed, (0.0, 1.0), interval=1e-3)
    solved = session.solve(body, BodySettings(first_step=0.5, residual=1e-11))
    assert solved.outcome.status == "converged", solved.outcome.message
    for force in solved.last.forces.values():
        assert force == pytest.approx(np.zeros(3), abs=1e-9)  # a viscous stress would be of the order of 20 MPa


def test_negative_modes_are_those_that_grow_within_all_frames(session) -> None:
    # A bent column loses E I k^2 a^2 of the energy of its bend and pays 3 eta I k^2 k^2 a'^2: the bend grows at mu / eta times
    # (P - P_c) / P_c, here 0.4 mu / eta, whatever its shape; in 8 s by a factor e where eta is 3.2 s mu. These tets are stiffer by
    # up to 5 per cent, an eighth of 0.4.
    for share, modes in ((0.8, 1), (1.1, 0)):
        body = column("P2/P1", (1, 1, 20), [1.4 * critical(THIN)])
        thick = effect("viscosity", eta=f"{share * 32} kPa s")
        timed = replace(body, effects=(*body.effects, thick), frames=(0.0, 1.0, 8.0), interval=1.0)
        solved = session.solve(timed, BodySettings(first_step=8.0, residual=1e-11))
        assert solved.last.scalars["negative_modes"] == modes
