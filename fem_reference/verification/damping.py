"""Resistance to motion: viscous drag and a viscous matrix, in steady motion and in bodies that creep back after unloading."""

from functools import partial

import numpy as np

from fem_reference.assessment.catalogue import Entry, Lab, Refinement
from fem_reference.effects import make
from fem_reference.problems import shapes
from fem_reference.problems.body import Body, Prescribed
from fem_reference.problems.paths import Affine
from fem_reference.runs.store import Run
from fem_reference.verification.homogeneous import MU
from fem_reference.verification.loads import FREE_FALL, MUSCLE, weight
from fem_reference.verification.parts import NO_GRADIENT, SYMMETRY, control, find, frames, neo_hooke, sliding

damping, viscosity = find("damping"), find("viscosity")
SECONDS = 0.1  # from one frame to the next, in entries with a drag
DRAG = 1e-4  # of a block that falls through a viscous medium [MPa s/mm2]
# A bar in a frictionless box: its length [mm], its bulk modulus [MPa], and the rate [1/s] at which it creeps back.
LENGTH, SOFT, RATE = 10.0, 5 * MU, 5.0
CREEP = (SOFT + 4 / 3 * MU) * (np.pi / (2 * LENGTH)) ** 2 / RATE  # [MPa s/mm2]
LIGHT = 1e-6  # the weight [N/mm3] of the bar, which strains it by 1e-4
ETA, VISCOUS_SECONDS = 0.02, 1.5  # viscosity of the blocks [MPa s], and time from one frame to the next [s]
BULK = 1e6 * MU  # so high that the closed form for incompressible material holds to 1e-6
STRESS = 3e-4 * MU  # a small load on the top of a block, which creeps back after its removal
# A ramp to the full load at frame 1 and back to no load at frame 2.
UP_AND_GONE = [{"frame": 0.0, "amount": 0.0}, {"frame": 1.0, "amount": 1.0}, {"frame": 2.0, "amount": 0.0}]


def velocity(lab: Lab, seconds: float) -> float:
    """The velocity [mm/s] of the fastest node of a free block under its full weight, over four frames ``seconds`` apart."""
    mesh = shapes.box((2, 2, 2), (1.0, 2.0, 3.0), "tetrahedron")
    acting = (*neo_hooke(MU, 100 * MU), weight(MUSCLE), make("damping", coefficient=DRAG))
    solved = lab.solve(Body(mesh, acting, (), (0, 1, 5), interval=seconds), "P2/P1", first_step=0.5, residual=1e-13)
    displacement = (solved.last.points - solved.states[1].points)[:, 2]
    return float(displacement[np.argmax(np.abs(displacement))]) / (4 * SECONDS)


def force(lab: Lab, n: int, eta: float) -> float:
    """The force [N] of a smooth plate after it has squeezed a block to half its height in one frame, with n load steps."""
    plate = Prescribed("plate", "z1", (2,), Affine(NO_GRADIENT, (0.0, 0.0, -0.5)))
    mesh = shapes.box((1, 1, 1), (1.0, 1.0, 1.0), "tetrahedron")
    acting = (*neo_hooke(MU, BULK), make("viscosity", eta=eta))
    body = Body(mesh, acting, (*SYMMETRY, plate), frames(1, n), interval=VISCOUS_SECONDS)
    return float(lab.solve(body, "P2/P1", first_step=1 / n).last.forces["plate"][2])


def relaxation_rate(solved: Run, numbers: tuple[int, int], seconds: float) -> float:
    """The rate [1/s] at which the top of a body (its maximum z) returns to its rest position between the two states ``numbers``,
    which are ``seconds`` apart.
    """
    rest = solved.states[0].points[:, 2].max()
    ends = [solved.states[number].points[:, 2].max() - rest for number in numbers]
    return float(np.log(ends[0] / ends[1])) / seconds


def bar_creep(lab: Lab, n: int, coefficient: float) -> float:
    """The rate [1/s] at which the bar creeps back from frame 4 to 6, after its weight is removed, with n load steps per frame."""
    mesh = shapes.box((1, 1, 4), (2.0, 2.0, LENGTH), "hexahedron")
    pull = f"0, 0, {-LIGHT / MUSCLE} mm/s^2"
    gone = make("gravity", density=f"{MUSCLE} tonne/mm^3", acceleration=pull, ramp=UP_AND_GONE)
    acting = (*neo_hooke(MU, SOFT, "Q2"), gone, make("damping", coefficient=coefficient))
    body = Body(mesh, acting, sliding("x0", "x1", "y0", "y1", "z0"), frames(6, 6 * n), interval=SECONDS)
    solved = lab.solve(body, "Q2", first_step=1 / n, residual=1e-15)
    return relaxation_rate(solved, (4 * n, 6 * n), 2 * SECONDS)


def block_creep(lab: Lab, n: int, eta: float) -> float:
    """The rate [1/s] at which the block creeps back from frame 2 to 3, after its load is removed, with n load steps per frame."""
    mesh = shapes.box((1, 1, 1), (1.0, 2.0, 3.0), "tetrahedron")
    gone = make("traction", on="z1", force=f"0, 0, {-STRESS} MPa", ramp=UP_AND_GONE)
    acting = (*neo_hooke(MU, BULK), gone, make("viscosity", eta=eta))
    body = Body(mesh, acting, SYMMETRY, frames(3, 3 * n), interval=VISCOUS_SECONDS)
    solved = lab.solve(body, "P2/P1", first_step=1 / n, residual=1e-14)
    return relaxation_rate(solved, (2 * n, 3 * n), VISCOUS_SECONDS)


def halved(counts: tuple[int, ...], seconds: float, name: str) -> Refinement:
    """A refinement with load steps of ``seconds / count`` for the quantity ``name``, which implicit Euler integrates."""
    note = f"{name} by implicit Euler; sizes are load steps in seconds; the value is extrapolated from the last two"
    return Refinement(counts, seconds, order=1, extrapolated=True, note=note)


RESISTED = partial(Entry, relative=True, kind="closed form")
DAMPED = partial(RESISTED, group="damping")
VISCOUS = partial(
    RESISTED,
    group="viscosity",
    given={"eta": ETA},
    **control("A viscosity 1 % too small.", eta=0.99 * ETA),
    within=7e-4,
)

ENTRIES: tuple[Entry, ...] = (
    DAMPED(
        name="damped_fall",
        title="Free block that sinks under its weight against a drag: the speed of its fastest node",
        unit="mm/s",
        measure=velocity,
        given={"seconds": SECONDS},
        **control("The time from one frame to the next is 1 % too long.", seconds=1.01 * SECONDS),
        truth=lambda: -damping.terminal_velocity(MUSCLE * FREE_FALL, DRAG),
        within=1e-9,
        because="Implicit Euler and the element represent a steady motion exactly; the residual of 1e-13 N in each step is 2e-9 of "
        "the weight of 6e-5 N, and only the sum of the residual over the nodes moves the block.",
        source="validation/damping.py, terminal_velocity",
    ),
    DAMPED(
        name="damped_creep",
        title="Bar in a frictionless box that creeps back once unloaded: rate of the slowest mode, with load steps that are "
        "halved",
        unit="1/s",
        measure=bar_creep,
        given={"coefficient": CREEP},
        **control("A drag 1 % too small.", coefficient=0.99 * CREEP),
        truth=lambda: damping.relaxation_rate(MU, SOFT, CREEP, LENGTH),
        within=2e-3,
        because="With x = rate times the longer load step = 1/16, the error of extrapolated implicit Euler is x^2 / 6 = 6.5e-4; "
        "the next mode, nine times as fast, has decayed to 1e-5, and the finite strain of 1e-4 adds about 1e-4.",
        source="validation/damping.py, relaxation_rate",
        refinement=halved((4, 8, 16), SECONDS, "rate"),
    ),
    VISCOUS(
        name="viscous_squeeze",
        title="Viscous block squeezed to half its height between smooth plates: their force, with load steps that are halved",
        unit="N",
        measure=force,
        truth=lambda: viscosity.squeeze_force(MU, ETA, 0.5, -0.5 / VISCOUS_SECONDS, 1.0),
        because="The last load step shortens the block by the fraction x of its height, 1/64 with the longer steps. The error of "
        "the viscous part (0.7 of the force) is -2 x + 16/3 x^2 (by hand); extrapolation leaves 0.7 * 8/3 x^2 = 4.6e-4.",
        source="validation/viscosity.py, squeeze_force",
        refinement=halved((32, 64, 128), VISCOUS_SECONDS, "force"),
    ),
    VISCOUS(
        name="viscous_creep",
        title="Viscous block that creeps back once unloaded: rate, with load steps that are halved",
        unit="1/s",
        measure=block_creep,
        truth=lambda: viscosity.creep_rate(MU, ETA),
        because="With x = rate times the longer load step = 0.047, the error of extrapolated implicit Euler is x^2 / 6 = 3.7e-4; "
        "the finite strain of 1e-4 adds about 1e-4.",
        source="validation/viscosity.py, creep_rate",
        refinement=halved((8, 16, 32), VISCOUS_SECONDS, "rate"),
    ),
)
