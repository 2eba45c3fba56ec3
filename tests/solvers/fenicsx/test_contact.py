"""Rigid bodies in contact in FEniCSx: what they do balances, follows their pose, and is nothing where they are not."""

import numpy as np
import pytest
from slides import Slide

from fem_reference.foundations.errors import InputError
from fem_reference.geometry.rigid_bodies import HalfSpace, Sphere
from fem_reference.problems import shapes
from fem_reference.problems.body import Body, Prescribed
from fem_reference.problems.contact import ContactBone, ContactLaw
from fem_reference.problems.paths import Rest
from fem_reference.solvers import scikit_fem
from fem_reference.verification import contact, parts

pytestmark = pytest.mark.slow

FIXED = (Prescribed("ground", "z0", (0, 1, 2), Rest()),)
LAW = ContactLaw("z1", 1.0, 0.01)


def block(*bones: ContactBone) -> Body:
    mesh = shapes.box((2, 2, 2), (1.0, 1.0, 1.0), "hexahedron")
    return Body(mesh, parts.neo_hooke(0.01, 10.0), FIXED, (0.0, 1.0), contact=LAW, bones=bones)


def solved(lab, *bones: ContactBone):
    return lab.solve(block(*bones), "Q2/Q1", first_step=0.25, residual=1e-12).last


def test_forces_and_moments_balance(fem_lab) -> None:
    # The residual of Newton's method is 1e-12 N; arms are 1 mm.
    ball = ContactBone("ball", Sphere((0.3, 0.4, 1.5), 0.5), Slide((0.0, 0.1, -0.15)))
    state = solved(fem_lab, ball)
    assert state.forces["ball"][2] < -1e-4
    assert state.forces["ball"] + state.forces["ground"] == pytest.approx([0, 0, 0], abs=1e-11)
    assert state.moments["ball"] + state.moments["ground"] == pytest.approx([0, 0, 0], abs=1e-11)
    # Without friction the forces on a ball act towards its centre: no moment about it.
    centre = np.array([0.3, 0.5, 1.35])
    assert state.moments["ball"] - np.cross(centre, state.forces["ball"]) == pytest.approx([0, 0, 0], abs=1e-12)
    assert 0 < state.scalars["contact_depth"] < 0.1
    assert 0 < state.scalars["contact_area"] < 1
    assert 0 < state.scalars["contact_points"] <= state.scalars["contact_points_near"]
    assert state.scalars["contact_pressure"] == pytest.approx(
        state.scalars["contact_depth"], rel=1e-9
    )  # 1 MPa/mm, deep


def test_a_body_is_felt_where_its_pose_has_it(fem_lab) -> None:
    # Turned about y by a right angle, x points along -z: the half space whose normal is x is then a plate from above.
    pose = Slide((0.0, 0.0, -0.2), (0.0, 0.0, 1.0), (0.0, np.pi / 2, 0.0))
    assert pose(1.0) @ [1, 0, 0, 0] == pytest.approx([0, 0, -1, 0])
    straight = ContactBone("plate", HalfSpace((0.0, 0.0, 1.0), (0.0, 0.0, -1.0)), Slide((0.0, 0.0, -0.2)))
    turned = ContactBone("plate", HalfSpace((0.0, 0.0, 0.0), (1.0, 0.0, 0.0)), pose)
    one, other = solved(fem_lab, straight), solved(fem_lab, turned)
    assert other.forces["plate"] == pytest.approx(one.forces["plate"], abs=1e-11)
    assert other.points == pytest.approx(one.points, abs=1e-9)


def test_what_is_far_away_does_nothing(fem_lab) -> None:
    state = solved(fem_lab, ContactBone("moon", Sphere((0.0, 0.0, 9.0), 1.0), Slide((0.0, 0.0, -1.0))))
    assert not state.forces["moon"].any()
    assert [state.scalars[name] for name in ("contact_depth", "contact_pressure", "contact_area")] == [0, 0, 0]
    assert [state.scalars[name] for name in ("contact_points", "contact_points_near")] == [0, 0]


def test_the_second_opinion_knows_no_contact() -> None:
    settings = scikit_fem.ScikitBodySettings(element="Q2/Q1")
    with pytest.raises(InputError, match="contact: got bones, want a body without"):
        scikit_fem.solve_body(block(), settings)


def test_a_ball_pressed_deeper_is_pressed_harder(fem_lab) -> None:
    # Hertz: the force goes with the power 3/2 of the approach; by how much it does is what the entries measure.
    light, heavy = (contact.pressed(fem_lab, 2, radius) for radius in (5.0, 20.0))
    assert heavy.forces["ball"][2] / light.forces["ball"][2] == pytest.approx(2, rel=0.05)  # the root of the radius
