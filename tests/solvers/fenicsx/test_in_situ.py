"""Bodies in situ under tension: at rest in their given mesh, between bones that press there too."""

from dataclasses import replace

import numpy as np
import pytest
import shapes as bars
from scipy.spatial.transform import Rotation
from slides import Slide
from tense import (
    ACTIVE,
    FIBRES,
    MATRIX,
    MIXED,
    effect,
    in_situ,
    moved,
    muscle,
    solved,
    tension,
)

from fem_reference.assessment.run_checks import of_muscle
from fem_reference.foundations.errors import InputError
from fem_reference.foundations.motion import RigidMotion
from fem_reference.geometry.rigid_bodies import Sphere
from fem_reference.geometry.sectors import attached_shares
from fem_reference.geometry.skins import attached_skin
from fem_reference.problems.body import Body, ByCell
from fem_reference.problems.contact import ContactBone, ContactLaw
from fem_reference.problems.paths import Affine, Turn
from fem_reference.runs.store import collected
from fem_reference.solvers import fenicsx, scikit_fem
from fem_reference.solvers.fenicsx import Settings

pytestmark = pytest.mark.slow


@pytest.mark.parametrize(
    ("element", "stiffness"),
    [("P2/P1", None), ("P2/P1", 0.1), ("P1/P1", None), ("P2/P0", None), ("P1", None), ("P2", 0.1), ("Q2/Q1", None)],
)
def test_nothing_moves_at_rest(session, element, stiffness) -> None:
    """A residual of 1e-9 N over the stiffness of the matrix, about mu times the size, 0.1 N/mm, is far below 1e-6 mm."""
    body = muscle(in_situ(1.1), ACTIVE, element=element, stiffness=stiffness)
    run = solved(session, body, element)
    assert moved(run, body) < 1e-6
    last = run.last
    assert last.scalars["negative_modes"] == 0
    assert np.linalg.norm(last.forces["top"]) > 0.1
    assert last.forces["top"] + last.forces["bottom"] == pytest.approx(np.zeros(3), abs=1e-7)
    assert last.moments["top"] + last.moments["bottom"] == pytest.approx(np.zeros(3), abs=1e-5)


def test_a_stretch_that_nothing_balances_moves_the_mesh(session) -> None:
    """The negative control: the same stretch as a ``prestretch``."""
    body = muscle(effect("prestretch", stretch=1.1, ramp=[{"frame": 0, "amount": 1.0}]))
    assert moved(solved(session, body), body) > 0.5


@pytest.mark.parametrize("stiffness", [None, 0.1])
def test_turning_the_body_turns_its_forces(session, stiffness) -> None:
    """By two rad about an oblique axis, in steps of 0.2 rad; the residual is 1e-9 N, and the least stiffness about 0.01 N/mm."""
    turn = Turn((1.0, 2.0, -0.5), 2.0)
    body = muscle(in_situ(1.15), ACTIVE, top=turn, bottom=turn, stiffness=stiffness)
    run = solved(session, body, first_step=0.1, largest_step=0.1)
    rest, last = run.states[0], run.last
    turned = Rotation.from_rotvec(2.0 * np.array(turn.axis) / np.linalg.norm(turn.axis))
    assert last.points == pytest.approx(turned.apply(body.mesh.points), abs=1e-5)
    assert last.forces["top"] == pytest.approx(turned.apply(rest.forces["top"]), abs=1e-6)
    assert last.scalars["energy"] == pytest.approx(rest.scalars["energy"], rel=1e-7)
    assert rest.scalars["energy"] > 1


def test_the_slope_of_the_energy_is_the_force(session) -> None:
    """By central differences over steps of 0.02 mm; their error falls with the square of the step: of 4e-8 at 1 mm of a bar of 40,
    times the third derivative, below 1e-5 of the force.
    """
    step, knots = 0.02, ((0.0, 0.0), (3.0, 3.0))
    sideways = Affine(((0.0,) * 3, (0.0,) * 3, (0.0,) * 3), (0.6 * step, 0.0, 0.8 * step), knots)
    run = solved(session, muscle(in_situ(1.1), top=sideways, frames=(0.0, 1.0, 2.0, 3.0)))
    for i in (1, 2):
        slope = (run.states[i + 1].scalars["energy"] - run.states[i - 1].scalars["energy"]) / (2 * step)
        assert slope == pytest.approx(run.states[i].forces["top"] @ [0.6, 0.0, 0.8], rel=1e-5)
        assert abs(run.states[i].scalars["energy_gap"]) < 1e-6


@pytest.mark.usefixtures("all_cores")
def test_ranks_find_the_same_rest(session) -> None:  # noqa: ARG001 - it skips where there is no FEniCSx
    problem = bars.bar(
        (1, 1, 2), (10, 10, 20), {"bottom": None, "top": None}, (MATRIX, MIXED, FIBRES, in_situ(1.1)), (0, 1)
    )
    oblique = np.tile([0.6, 0.0, 0.8], (len(problem.mesh.tets), 1))
    problem, found = replace(problem, fibre=ByCell(oblique)), []
    for ranks in (1, 2):
        frames = []
        assert fenicsx.solve(problem, Settings(ranks=ranks), frames.append).status == "converged"
        assert np.abs(frames[-1].points - problem.mesh.points).max() < 1e-6
        found.append(frames[-1].scalars)
    assert found[1]["force_top"] == pytest.approx(found[0]["force_top"], rel=1e-6)
    assert found[0]["force_top"] > 0.1


def supported(support: float, gap: float, *, pull: float = 0.0, smoothing: float = 0.1) -> Body:
    """A bar whose curved fibres straighten towards a ball beside its middle, across a gap; its top is pulled up by ``pull``."""
    ball = ContactBone("ball", Sphere((30.0 + gap, 5.0, 20.0), 20.0), Slide((0.0, 0.0, 0.0)))
    top = Affine(((0.0,) * 3, (0.0,) * 3, (0.0,) * 3), (0.0, 0.0, pull))
    return replace(
        muscle(in_situ(1.1), top=top), contact=ContactLaw("x1", 0.5, smoothing, in_situ=support), bones=(ball,)
    )


@pytest.mark.parametrize("overlap", [False, True])
def test_a_bone_within_reach_presses_at_rest(session, overlap) -> None:
    """Its force is on the line of the ball's centre, and with those of the ends it is in balance. Nothing moves."""
    body = supported(1.0, -0.5 if overlap else 0.5)
    last = solved(session, body).last
    assert moved(solved(session, body), body) < 1e-6
    assert last.forces["ball"][0] < -0.01
    assert sum(last.forces.values()) == pytest.approx(np.zeros(3), abs=1e-7)
    assert sum(last.moments.values()) == pytest.approx(np.zeros(3), abs=1e-5)
    assert last.scalars["contact_pressure"] > 0
    # The ball is 0.5 mm deep, and points of contact 2 mm beside its middle are 0.1 mm less; nothing moves.
    overlap_at_rest = last.scalars["overlap_at_rest"]
    assert overlap_at_rest == pytest.approx(last.scalars["contact_depth"], abs=1e-6)
    assert 0.3 < overlap_at_rest < 0.5 if overlap else overlap_at_rest == 0


@pytest.mark.parametrize("smoothing", [0.1, 1.0])
def test_a_bone_out_of_reach_does_not_press(session, smoothing) -> None:
    """Also where the law is felt farther away than a bone supports: what it says of the gaps at rest is no force."""
    body = supported(0.1, 0.5, smoothing=smoothing)
    last = solved(session, body).last
    assert moved(solved(session, body), body) < 1e-6
    assert np.linalg.norm(last.forces["ball"]) == 0
    assert last.forces["top"][0] + last.forces["bottom"][0] == pytest.approx(0, abs=1e-7)


def test_the_smoothing_does_not_change_what_supports_at_rest(session) -> None:
    """Points of the face are 0.5 mm and more from the ball, within 0.7 mm of it or not; the residual is 1e-9 N."""
    one, other = (solved(session, supported(0.7, 0.5, smoothing=smoothing)).last for smoothing in (0.5, 0.05))
    assert one.forces["ball"][0] < -0.01
    assert other.forces["ball"] == pytest.approx(one.forces["ball"], abs=1e-6)


@pytest.mark.parametrize("smoothing", [0.02, 0.2])
def test_a_bone_that_goes_away_presses_until_its_pressure_is_gone(session, smoothing) -> None:
    """The pressure at rest over the stiffness is 1 mm, so it is felt 0.5 mm farther away, beyond support and smoothing; the law
    is linear there, whatever the smoothing. The muscle follows, so that more is left than of a muscle that does not.
    """
    body = supported(0.7, 0.5, smoothing=smoothing)
    ball = replace(body.bones[0], pose=Slide((0.5, 0.0, 0.0)))
    run = solved(session, replace(body, bones=(ball,), contact=replace(body.contact, stiffness=0.02)))
    rest, last = (state.scalars["contact_pressure"] for state in (run.states[0], run.last))
    assert rest > 0.02
    assert rest - 0.02 * 0.5 < last < rest
    assert run.last.scalars["contact_points"] == 10


def test_a_bone_presses_more_on_a_muscle_that_is_pulled_and_less_on_a_slack_one(session) -> None:
    slack, rest, taut = (-solved(session, supported(1.0, 0.5, pull=pull)).last.forces["ball"][0] for pull in (-3, 0, 1))
    assert 1.2 * slack < rest < taut / 1.1


def test_another_solver_refuses_it() -> None:
    with pytest.raises(InputError, match="effects: got in_situ, want effects that leave the body at rest"):
        scikit_fem.solve_body(muscle(in_situ(1.1)), scikit_fem.ScikitBodySettings())


def test_the_second_check_knows_the_force_at_rest_of_springs(session) -> None:  # noqa: ARG001
    """Springs that the muscle no longer pulls have gone back by their extension at rest, which is no error. Without that force at
    rest the check has nothing that explains it.
    """
    stiffness, stretch, length, area = 0.05, 1.1, 20.0, 100.0
    extension = area * tension(stretch) / (stiffness * area)
    slack = RigidMotion((0.0, 0.0, 1.0), None, (0.0, 1.0), (0.0, length / stretch - length - 2 * extension))
    effects = (MATRIX, MIXED, FIBRES, in_situ(stretch))
    problem = bars.bar((1, 1, 2), (10, 10, length), {"bottom": None, "top": slack}, effects, (0, 1))
    attached = tuple(replace(entry, stiffness=stiffness) for entry in problem.attached)
    skins = {
        one.attachment: attached_skin(
            problem.surface, attached_shares(problem.surface, one.vertices), problem.mesh, 2.0
        )
        for one in attached
    }
    fibre, frames = ByCell(np.tile([0.0, 0.0, 1.0], (len(problem.mesh.tets), 1))), []
    problem = replace(problem, fibre=fibre, attached=attached, attached_skins=skins)
    outcome = fenicsx.solve(problem, Settings(ranks=1), frames.append)
    run = collected(frames, outcome, problem.rest)
    assert run.scalars["force_top"][0] == pytest.approx(area * tension(stretch), rel=0.1)  # the matrix bears some of it
    assert run.scalars["force_top"][1] < 0.2 * run.scalars["force_top"][0]
    assert all(one.met for one in of_muscle(problem, run))
    other = replace(problem, effects=effects[:3])
    assert {one.name for one in of_muscle(other, run) if not one.met} == {
        f"mean extension of springs of {one}" for one in skins
    }
