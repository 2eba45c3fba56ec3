"""Drag of the ground: a free body, and a bar that creeps back."""

from functools import partial

import numpy as np

from fem_reference.assessment.catalogue import Entry, Lab, Refinement
from fem_reference.effects import make
from fem_reference.problems import shapes
from fem_reference.problems.body import Body
from fem_reference.verification.homogeneous import MU
from fem_reference.verification.loads import FREE_FALL, MUSCLE, weight
from fem_reference.verification.parts import UP_AND_GONE, frames, neo_hooke, relaxation_rate, sliding
from fem_reference.verification.truths import find

damping = find("damping")
SECONDS = 0.1  # from a frame number to the next
DRAG = 1e-4  # of a block that falls through something viscous [MPa s/mm2]
# A bar in a smooth box: its length [mm], bulk modulus [MPa] and the rate at which it creeps back [1/s].
LENGTH, SOFT, RATE = 10.0, 5 * MU, 5.0
CREEP = (SOFT + 4 / 3 * MU) * (np.pi / (2 * LENGTH)) ** 2 / RATE  # [MPa s/mm2]
LIGHT = 1e-6  # a weight [N/mm3], for a stretch of 1e-4
FROM, TO = 4, 6  # frames between which the rate is measured


def velocity(lab: Lab, seconds: float) -> float:
    """The velocity [mm/s] of a free block with its whole weight, over four frames; ``seconds`` are from a frame to the next."""
    mesh = shapes.box((2, 2, 2), (1.0, 2.0, 3.0), "tetrahedron")
    acting = (*neo_hooke(MU, 100 * MU), weight(MUSCLE), make("damping", coefficient=DRAG))
    solved = lab.solve(Body(mesh, acting, (), (0, 1, 5), interval=seconds), "P2/P1", first_step=0.5, residual=1e-13)
    displacement = (solved.last.points - solved.states[1].points)[:, 2]
    return float(displacement[np.argmax(np.abs(displacement))]) / (4 * SECONDS)


def creep_rate(lab: Lab, n: int, coefficient: float) -> float:
    """The rate [1/s] at which the bar creeps back when its weight is gone, in n load steps a frame."""
    mesh = shapes.box((1, 1, 4), (2.0, 2.0, LENGTH), "hexahedron")
    pull = f"0, 0, {-LIGHT / MUSCLE} mm/s^2"
    gone = make("gravity", density=f"{MUSCLE} tonne/mm^3", acceleration=pull, ramp=UP_AND_GONE)
    acting = (*neo_hooke(MU, SOFT, "Q2"), gone, make("damping", coefficient=coefficient))
    walls = sliding("x0", "x1", "y0", "y1", "z0")
    body = Body(mesh, acting, walls, frames(TO, TO * n), interval=SECONDS)
    solved = lab.solve(body, "Q2", first_step=1 / n, residual=1e-15)
    return relaxation_rate(solved, (FROM * n, TO * n), (TO - FROM) * SECONDS)


DAMPED = partial(Entry, group="damping", relative=True, kind="closed form")

ENTRIES: tuple[Entry, ...] = (
    DAMPED(
        name="damped_fall",
        title="Free block, with a drag and its weight: the speed of its fastest node",
        unit="mm/s",
        measure=velocity,
        given={"seconds": SECONDS},
        negative_control="A time from frame to frame that is 1 % too long.",
        wrong={"seconds": 1.01 * SECONDS},
        truth=lambda: -damping.terminal_velocity(MUSCLE * FREE_FALL, DRAG),
        within=1e-9,
        because="Implicit Euler has a steady motion exactly, and so does the element, but for the residual: 1e-13 N are 2e-9 of "
        "the weight of 6e-5 N in each step, of which only the sum over the nodes moves the block.",
        source="validation/damping.py, terminal_velocity",
    ),
    DAMPED(
        name="damped_creep",
        title="Bar in a smooth box that creeps back when its weight is gone: rate of the slowest mode, by load steps that are "
        "halved",
        unit="1/s",
        measure=creep_rate,
        given={"coefficient": CREEP},
        negative_control="A drag 1 % too small.",
        wrong={"coefficient": 0.99 * CREEP},
        truth=lambda: damping.relaxation_rate(MU, SOFT, CREEP, LENGTH),
        within=2e-3,
        because="Of x = rate times the longer load step, 1/16, implicit Euler without its first order leaves x^2 / 6 = 6.5e-4; the "
        "next mode, nine times as fast, has died out to 1e-5, and 1e-4 is how far the stretch is from small strain.",
        source="validation/damping.py, relaxation_rate",
        refinement=Refinement(
            (4, 8, 16),
            SECONDS,
            order=1,
            extrapolated=True,
            note="rate by implicit Euler, whose sizes are seconds of a load step; the value is extrapolated from the last two",
        ),
    ),
)
