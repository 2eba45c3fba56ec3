"""Friction: a block on an incline, a block under a sliding plate, and a block that slides over another block."""

from dataclasses import replace
from functools import partial

import numpy as np

from fem_reference.assessment.catalogue import Finding, Lab
from fem_reference.effects import make
from fem_reference.foundations.motion import RigidMotion
from fem_reference.geometry.rigid_bodies import HalfSpace
from fem_reference.problems import shapes
from fem_reference.problems.body import Body, Prescribed
from fem_reference.problems.contact import ContactBone, ContactLaw
from fem_reference.problems.paths import Affine
from fem_reference.problems.touching import Touching
from fem_reference.verification.contact import CONTACT
from fem_reference.verification.parts import NO_GRADIENT, clamped, control, neo_hooke

FRICTION, MU, BULK = 0.3, 0.01, 0.1  # coefficient of friction, and moduli [MPa]
WEIGHT, STIFFNESS, HEIGHT = 1e-4, 0.01, 0.5  # pressure under the block [MPa], contact stiffness [MPa/mm], height [mm]
NEAR = (0.9, 0.99, 0.999, 0.9999, 1.0002, 1.001)  # tangents of the requested angles, as multiples of FRICTION
LAW = ContactLaw("z0", STIFFNESS, 0.01, friction=FRICTION)


def incline(lab: Lab, friction: float) -> Finding:
    """The tangent of the largest requested angle at which a block under its weight still sticks to a plane that is tilted."""
    angles = tuple(float(np.arctan(share * FRICTION)) for share in NEAR)
    frames = (0.0, *(float(i) for i in range(1, 1 + len(NEAR))))
    turning = RigidMotion((0.0, 1.0, 0.0), (0.5, 0.5, 0.0), frames, (0.0, *angles))
    plane = ContactBone("plane", HalfSpace((0.0, 0.0, WEIGHT / STIFFNESS), (0.0, 0.0, 1.0)), turning.pose)
    at_once = [{"frame": 0.0, "amount": 1.0}]
    weight = make("gravity", density=WEIGHT / HEIGHT / 1e4, acceleration=[0.0, 0.0, -1e4], ramp=at_once)
    mesh = shapes.box((2, 2, 1), (1.0, 1.0, HEIGHT), "hexahedron")
    body = Body(
        mesh, (*neo_hooke(MU, BULK), weight), (), frames, contact=replace(LAW, friction=friction), bones=(plane,)
    )
    run = lab.solve(body, "Q1/P0", first_step=0.1, residual=1e-12, smallest_step=1e-3)
    reached = run.states[-1]
    work = reached.scalars["friction_work"]
    return Finding(float(np.tan((0.0, *angles)[round(reached.number)])), note=f"{work:.2g} N mm dissipated until then")


def drag(lab: Lab, friction: float) -> Finding:
    """The drag of a plate that slides over a clamped block, divided by the normal force."""
    above = ContactBone(
        "plate",
        HalfSpace((0.0, 0.0, HEIGHT - 0.005), (0.0, 0.0, -1.0)),
        RigidMotion((1.0, 0.0, 0.0), None, (0.0, 1.0), (0.0, 0.2)).pose,
    )
    mesh = shapes.box((2, 2, 2), (1.0, 1.0, HEIGHT), "tetrahedron")
    law = ContactLaw("z1", 1.0, 0.01, friction=friction)
    body = Body(mesh, neo_hooke(MU, BULK), clamped("z0"), (0.0, 0.5, 1.0), contact=law, bones=(above,))
    state = lab.solve(body, "P2/P1", first_step=0.25, residual=1e-12).last
    along, _, across = state.forces["plate"]
    lost = state.scalars["friction_work"]
    return Finding(float(along / -across), note=f"{lost:.2g} N mm are dissipated")


def blocks(lab: Lab, friction: float) -> Finding:
    """The drag of a block that slides over a larger block with a non-matching mesh, divided by the normal force."""
    low, high = (
        shapes.box(counts, size, "tetrahedron")
        for counts, size in (((4, 3, 1), (1.0, 1.0, 0.3)), ((2, 3, 1), (0.5, 0.6, 0.3)))
    )
    mesh = shapes.joined({"low": low, "high": replace(high, points=high.points + [0.1, 0.2, 0.299])})
    moved = Prescribed("top", "high_z1", (0, 1, 2), Affine(NO_GRADIENT, (0.2, 0.0, 0.0)))
    law = Touching("low_z1", "high_z0", STIFFNESS, 0.002, friction)
    body = Body(mesh, neo_hooke(MU, BULK), (*clamped("low_z0"), moved), (0.0, 1.0), touching=(law,))
    state = lab.solve(body, "P2/P1", first_step=0.1, residual=1e-12).last
    along, _, across = state.forces["low_z1 on high_z0"]
    lost = state.scalars["touching_friction_work"]
    return Finding(float(-along / across), note=f"{lost:.2g} N mm are dissipated")


DRAG = partial(CONTACT, unit="", given={"friction": FRICTION}, truth=FRICTION)

ENTRIES = (
    DRAG(
        name="sliding_blocks",
        title="A block that slides over another: ratio of drag to normal force",
        measure=blocks,
        **control("coefficient of friction 1 % higher", friction=1.01 * FRICTION),
        within=2e-3,
        because="under a pressure of a thousandth of the moduli the faces tilt by about 0.001 rad, and with them their normals",
        source="Coulomb: the drag is the coefficient of friction times the normal force",
    ),
    DRAG(
        name="incline",
        title="A block on a plane that tilts: tangent of the steepest angle at which the block sticks",
        measure=incline,
        **control("coefficient of friction 0.11 % higher", friction=1.0011 * FRICTION),
        within=1.5e-4,
        because="two tangents are 0.01 % below and 0.02 % above the coefficient: the block must stick at one and slip at the other",
        source="Coulomb: the tangent of the angle is the coefficient of friction",
    ),
    DRAG(
        name="sliding_plate",
        title="A plate that slides over a block: ratio of drag to normal force",
        measure=drag,
        **control("coefficient of friction 1 % higher", friction=1.01 * FRICTION),
        within=1e-7,
        because="each sliding point is at its Coulomb limit up to rounding: the residual of 1e-12 N remains, at forces of 1e-4 N",
        source="Coulomb: the drag is the coefficient of friction times the normal force",
    ),
)
