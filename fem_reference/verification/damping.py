"""Drag of the ground: a free body, and a bar that creeps back."""

import numpy as np

from fem_reference.assessment.catalogue import Entry, Finding, Lab, order
from fem_reference.effects import Effect, make
from fem_reference.problems import shapes
from fem_reference.problems.body import Body, Prescribed
from fem_reference.problems.paths import Rest
from fem_reference.verification import truths
from fem_reference.verification.homogeneous import MU, NEO
from fem_reference.verification.loads import FREE_FALL, MUSCLE
from fem_reference.verification.parts import ramp, resistance

GROUP = "damping"
_SECONDS = 0.1  # from a frame number to the next


def drag(coefficient: float) -> Effect:
    """Of the ground [MPa s/mm^2]."""
    return make("damping", coefficient=f"{coefficient} MPa s/mm^2")


# A block that falls through something viscous.
_DRAG = 1e-4  # MPa s/mm2


def _velocity(lab: Lab, seconds: float = _SECONDS) -> Finding:
    """Of a free block with its whole weight, over four frames [mm/s]; ``seconds`` are from a frame number to the next."""
    mesh = shapes.box((2, 2, 2), (1.0, 2.0, 3.0), "tetrahedron")
    pull = f"0, 0, {-FREE_FALL} mm/s^2"
    weight = make("gravity", density=f"{MUSCLE} tonne/mm^3", acceleration=pull, ramp=ramp())
    acting = (*NEO.effects, resistance("P2/P1", 100 * MU), weight, drag(_DRAG))
    body = Body(mesh, acting, (), (0, 1, 5), interval=seconds)
    solved = lab.solve(body, "P2/P1", first_step=0.5, residual=1e-13)
    displacement = (solved.last.points - solved.states[1].points)[:, 2]
    return Finding(float(displacement[np.argmax(np.abs(displacement))]) / (4 * _SECONDS))


_FALL = Entry(
    name="damped_fall",
    group=GROUP,
    title="Free block, with a drag and its weight: the speed of its fastest node",
    unit="mm/s",
    truth=lambda: -float(truths.find("damping").terminal_velocity(MUSCLE * FREE_FALL, _DRAG)),
    within=1e-9,
    relative=True,
    because="Implicit Euler has a steady motion exactly, and so does the element, but for the residual: 1e-13 N are 2e-9 of the "
    "weight of 6e-5 N in each step, of which only the sum over the nodes moves the block.",
    kind="closed form",
    source="validation/damping.py, terminal_velocity",
    measure=_velocity,
    negative_control="A time from frame to frame that is 1 % too long.",
    with_negative_control=lambda lab: _velocity(lab, 1.01 * _SECONDS),
)

# A bar in a smooth box that its weight stretched a little, and that creeps back when the weight is gone.
_LENGTH, _SOFT, _RATE = 10.0, 5 * MU, 5.0  # mm, MPa, 1/s
_CREEP = (_SOFT + 4 / 3 * MU) * (np.pi / (2 * _LENGTH)) ** 2 / _RATE
_WEIGHT = 1e-6  # N/mm3, a stretch of 1e-4
_GONE = [{"frame": 0.0, "amount": 0.0}, {"frame": 1.0, "amount": 1.0}, {"frame": 2.0, "amount": 0.0}]
_FROM, _TO = 4.0, 6.0


def _decay(lab: Lab, step: float, coefficient: float) -> float:
    """The rate [1/s] at which the end of the bar creeps back from frame ``_FROM`` to ``_TO``, in load steps of ``step`` frames."""
    mesh = shapes.box((1, 1, 4), (2.0, 2.0, _LENGTH), "hexahedron")
    pull = f"0, 0, {-_WEIGHT / MUSCLE} mm/s^2"
    weight = make("gravity", density=f"{MUSCLE} tonne/mm^3", acceleration=pull, ramp=_GONE)
    walls = tuple(Prescribed(face, face, ("xyz".index(face[0]),), Rest()) for face in ("x0", "x1", "y0", "y1", "z0"))
    frames = tuple(np.linspace(0, _TO, round(_TO / step) + 1).tolist())
    acting = (*NEO.effects, resistance("Q2", _SOFT), weight, drag(coefficient))
    body = Body(mesh, acting, walls, frames, interval=_SECONDS)
    solved = lab.solve(body, "Q2", first_step=step, residual=1e-15)
    ends = [state.points[:, 2].max() - _LENGTH for state in (solved.states[round(_FROM / step)], solved.last)]
    return float(np.log(ends[0] / ends[1])) / ((_TO - _FROM) * _SECONDS)


def _known_rate() -> float:
    return float(truths.find("damping").relaxation_rate(MU, _SOFT, _CREEP, _LENGTH))


def _creep(lab: Lab, coefficient: float = _CREEP) -> Finding:
    """By load steps of a quarter, an eighth and a sixteenth of a frame, and without their error of first order."""
    ladder = tuple((step * _SECONDS, _decay(lab, step, coefficient)) for step in (1 / 4, 1 / 8, 1 / 16))
    note = "rate by implicit Euler, whose sizes are seconds of a load step; the value is extrapolated from the last two"
    return Finding(2 * ladder[2][1] - ladder[1][1], order(ladder, _known_rate()), ladder, note)


_RELAXATION = Entry(
    name="damped_creep",
    group=GROUP,
    title="Bar in a smooth box that creeps back when its weight is gone: rate of the slowest mode, by load steps that are halved",
    unit="1/s",
    truth=_known_rate,
    within=2e-3,
    relative=True,
    because="Of x = rate times the longer load step, 1/16, implicit Euler without its first order leaves x^2 / 6 = 6.5e-4; the "
    "next mode, nine times as fast, has died out to 1e-5, and 1e-4 is how far the stretch is from small strain.",
    kind="closed form",
    source="validation/damping.py, relaxation_rate",
    measure=_creep,
    negative_control="A drag 1 % too small.",
    with_negative_control=lambda lab: _creep(lab, 0.99 * _CREEP),
)

ENTRIES = (_FALL, _RELAXATION)
