"""Friction of bones: a point sticks, slides at the friction times the pressure, loses work, and its slope is exact."""

from dataclasses import replace

import numpy as np
import pytest
from slides import Slide

from fem_reference import make_effect
from fem_reference.foundations.errors import InputError
from fem_reference.geometry import signed_distance
from fem_reference.geometry.rigid_bodies import Box, HalfSpace, Sphere
from fem_reference.geometry.tessellation import tessellated
from fem_reference.problems import shapes
from fem_reference.problems.body import Body, Prescribed
from fem_reference.problems.checks import check_agreement
from fem_reference.problems.contact import ContactBone, ContactLaw
from fem_reference.problems.paths import Rest
from fem_reference.solvers import fenicsx
from fem_reference.solvers.fenicsx.friction import Friction
from fem_reference.verification import parts

LAW = ContactLaw("z1", 2.0, 0.05, friction=0.3)
BALL = Sphere((0.1, -0.2, 0.0), 1.0)


def points() -> np.ndarray:
    """Places near the surface of the ball, at gaps from -0.1 to 0.03 mm."""
    random = np.random.default_rng(0)
    away = random.normal(size=(40, 3))
    away /= np.linalg.norm(away, axis=1)[:, None]
    return np.array(BALL.centre) + (1 + random.uniform(-0.1, 0.03, 40))[:, None] * away


def test_the_slope_of_the_traction_is_exact_where_points_stick_slide_and_enter() -> None:
    here, random, every = points(), np.random.default_rng(1), np.arange(40)
    stuck = here + random.uniform(-0.02, 0.02, (40, 3))
    stuck[30:] = np.nan  # these come into contact
    start = here + 0.2 * (here - BALL.centre) + random.uniform(-0.05, 0.05, (40, 3))
    friction = Friction(LAW, stuck)

    def grip(places: np.ndarray):
        return friction.grip(
            every, places, BALL.sample(places), lambda some: (start[some], BALL.sample(start[some])[0])
        )

    found, step = grip(here), 1e-6
    normals = BALL.sample(here).gradient
    size, limit = np.linalg.norm(found.traction, axis=1), 0.3 * LAW.pressure(BALL.sample(here).distance)[0]
    slides = size > limit - 1e-12
    assert 5 < slides[:30].sum() < 25
    assert slides[30:].sum() > 0
    assert (size <= limit + 1e-15).all()
    assert np.vecdot(found.traction, normals) == pytest.approx(np.zeros(40), abs=1e-15)
    assert (found.lost >= 0).all()
    assert (found.lost > 1e-9).sum() == (slides & (found.lost > 1e-9)).sum() > 5
    for axis in range(3):
        ends = [grip(here + sign * step * np.eye(3)[axis]).traction for sign in (1, -1)]
        # The square of the step, and rounding over it.
        assert found.slope[:, :, axis] == pytest.approx((ends[0] - ends[1]) / (2 * step), abs=1e-7)


def test_what_is_dragged_along_pulls_as_before() -> None:
    here, every = points(), np.arange(40)
    friction = Friction(LAW, here + np.random.default_rng(1).uniform(-0.02, 0.02, (40, 3)))
    first = friction.grip(every, here, BALL.sample(here), lambda some: (here[some], np.zeros(len(some))))
    friction.settle(first)
    again = friction.grip(every, here, BALL.sample(here), lambda some: (here[some], np.zeros(len(some))))
    assert again.traction == pytest.approx(first.traction, abs=1e-15)
    assert again.lost == pytest.approx(np.zeros(40), abs=1e-15)


def block(plate: ContactBone) -> Body:
    mesh = shapes.box((2, 2, 2), (1.0, 1.0, 1.0), "hexahedron")
    fixed = (Prescribed("ground", "z0", (0, 1, 2), Rest()),)
    return Body(
        mesh,
        parts.neo_hooke(0.01, 10.0),
        fixed,
        (0.0, 1.0, 2.0),
        contact=replace(LAW, stiffness=1.0, smoothing=0.01),
        bones=(plate,),
    )


def solved(lab, body: Body, **settings):
    return lab.solve(body, "Q1/P0", **({"first_step": 0.25, "residual": 1e-12} | settings))


@pytest.mark.slow
def test_forces_balance_slide_at_the_friction_times_the_normal_force_and_lose_work(fem_lab) -> None:
    # A plate slides 1 mm over a block that yields 0.3 N/MPa * mm / 0.01 MPa: after the first part it slides everywhere.
    plate = ContactBone("plate", HalfSpace((0.0, 0.0, 0.995), (0.0, 0.0, -1.0)), Slide((0.5, 0.0, 0.0)))
    run = solved(fem_lab, block(plate))
    state = run.last
    assert state.forces["plate"] + state.forces["ground"] == pytest.approx([0, 0, 0], abs=1e-11)
    assert state.moments["plate"] + state.moments["ground"] == pytest.approx([0, 0, 0], abs=1e-11)
    along, across, down = state.forces["plate"]
    assert along == pytest.approx(-0.3 * down, rel=1e-9)  # the residual of 1e-12 N over 1e-4 N
    assert across == pytest.approx(0, abs=1e-9)
    works = [one.scalars["friction_work"] for one in run.states]
    assert works[0] == 0 < works[1] < works[2]


@pytest.mark.slow
def test_friction_begins_where_an_overlap_at_rest_is_removed(fem_lab) -> None:
    # 5 um are removed from frame -1 to 0 below a plate that slides by 0.5 mm in each frame.
    plate = ContactBone("plate", HalfSpace((0.0, 0.0, 0.995), (0.0, 0.0, -1.0)), Slide((0.5, 0.0, 0.0)))
    body = replace(block(plate), frames=(-1.0, 0.0, 2.0))
    law = replace(LAW, stiffness=1.0, smoothing=0.01, relaxed=(-1.0, 0.0))
    rough, smooth = (
        solved(fem_lab, replace(body, contact=replace(law, friction=friction))).states for friction in (0.3, None)
    )
    assert rough[1].points == pytest.approx(smooth[1].points, abs=1e-9)  # 1e-12 N over a stiffness of 0.01 N/mm
    assert [one.scalars["friction_work"] for one in rough[:2]] == [0, 0]
    along, _, down = rough[2].forces["plate"]
    assert along == pytest.approx(-0.3 * down, rel=1e-9)
    assert 0 < rough[2].scalars["friction_work"] < along * 1.0


@pytest.mark.slow
def test_a_bone_from_beyond_its_known_distances_drags_as_much(fem_lab) -> None:
    # Its distance is known within 1 mm. It comes from 3 mm above and slides 1 mm at once; in one step its whole path would count
    # as if it had been on the way for 1e6 mm.
    surface = tessellated(Box((0.5, 0.5, 1.5), (4.0, 4.0, 1.0), 0.0), np.zeros((1, 3)), "plate")
    plate = ContactBone("plate", signed_distance.build(surface, 0.2, 1.0), Slide((1.0, 0.0, -3.01), (0.0, 0.0, 3.0)))
    body = replace(block(plate), frames=(0.0, 1.0))
    once, often = (solved(fem_lab, body, first_step=step).last for step in (1.0, 0.02))
    (drag, _, down), (other, _, _) = once.forces["plate"], often.forces["plate"]
    assert drag == pytest.approx(0.3 * -down, rel=0.02)  # the grid rounds the plate's face by 1e-3, and tilts it
    assert drag == pytest.approx(other, rel=0.02)
    assert once.scalars["cut_backs"] > 0


def test_stable_states_are_not_followed_with_friction() -> None:
    plate = ContactBone("plate", HalfSpace((0.0, 0.0, 0.995), (0.0, 0.0, -1.0)), Slide((0.5, 0.0, 0.0)))
    with pytest.raises(InputError, match='follow: got "stable" with friction, want "equilibrium"'):
        fenicsx.solve_body(block(plate), fenicsx.BodySettings(element="Q1/P0", follow="stable"))


def test_a_body_that_begins_under_tension_has_no_friction() -> None:
    plate = ContactBone("plate", HalfSpace((0.0, 0.0, 0.995), (0.0, 0.0, -1.0)), Slide((0.5, 0.0, 0.0)))
    body = block(plate)
    check_agreement(body)
    wrong = [replace(body, start=np.array), replace(body, contact=replace(LAW, in_situ=0.0))]
    wrong += [replace(body, effects=(*body.effects, make_effect("in_situ", stretch=1.05)))]
    for one in wrong:
        with pytest.raises(InputError, match=r"friction: got 0\.3, want no friction in a body that starts deformed"):
            check_agreement(one)
