"""Inertia: a free fall, a vibrating bar, a block that swings with a large amplitude, and the limit of slow motion."""

from functools import partial

import numpy as np
from numpy.polynomial import Polynomial

from fem_reference.assessment.catalogue import Entry, Finding, Lab, Refinement, order
from fem_reference.effects import Effect, make
from fem_reference.problems import shapes
from fem_reference.problems.body import Body, Prescribed
from fem_reference.problems.paths import Affine
from fem_reference.verification.parts import NO_GRADIENT, clamped, control, find, frames, neo_hooke, sliding

inertia = find("inertia")
DENSITY = 1e-9  # tonne/mm^3
MU, BULK, LENGTH = 0.01, 0.02, 10.0
MODULUS = inertia.uniaxial_modulus(MU, BULK)
OMEGA = inertia.first_frequency(MODULUS, DENSITY, LENGTH)
PERIOD = 2 * np.pi / OMEGA
G, FALLING = 9810.0, 0.1  # [mm/s^2], [s]
SWINGING, STEPS = 0.17, 600  # duration of ten swings [s], and the number of time steps in it
STEP = {"first_step": 1.0, "largest_step": 1.0}


def mass(factor: float = 1.0, spectral_radius: float = 0.9) -> Effect:
    """Inertia with ``factor`` times the density."""
    return make("inertia", density=factor * DENSITY, spectral_radius=spectral_radius)


def weight(axis: int, acceleration: float) -> Effect:
    """Gravity with an ``acceleration`` [mm/s^2] along an axis, applied suddenly."""
    at_once = [{"frame": 0.0, "amount": 1.0}]
    return make("gravity", density=DENSITY, acceleration=(acceleration * np.eye(3)[axis]).tolist(), ramp=at_once)


def fallen(lab: Lab, factor: float) -> float:
    """The distance [mm] that a free block falls. Its tangent matrix is regular only because the block has mass."""
    mesh = shapes.box((1, 1, 1), (10.0, 10.0, 10.0), "tetrahedron")
    acting = (*neo_hooke(MU, 1e3 * MU), mass(factor), weight(2, -G))
    solved = lab.solve(Body(mesh, acting, (), frames(10, 10), interval=FALLING / 10), "P2/P1", **STEP)
    return 5.0 - float(solved.last.points[:, 2].mean())


def bar(acting: tuple[Effect, ...], prescribed: tuple[Prescribed, ...], count: int, seconds: float) -> Body:
    """A bar of constant cross-section with one end fixed along its axis. The ``count`` frames last ``seconds`` in total."""
    mesh = shapes.box((8, 1, 1), (LENGTH, 1.0, 1.0), "tetrahedron")
    fixed = (*sliding("x0", "y0", "y1", "z0", "z1"), *prescribed)
    return Body(mesh, (*neo_hooke(MU, BULK, "P2"), *acting), fixed, frames(count, count), interval=seconds / count)


def frequency(lab: Lab, steps: int, factor: float) -> float:
    """The frequency [rad/s] of the first mode of a bar under a small axial weight, from two periods of ``steps`` time steps each.

    A cosine about a mean obeys ``q(n + 1) + q(n - 1) = 2 c q(n) + constant``, where c is the cosine of the phase of one step.
    """
    acting = mass(factor), weight(0, 1e-4 * MODULUS / DENSITY / LENGTH)
    solved = lab.solve(bar(acting, (), 2 * steps, 2 * PERIOD), "P2", **STEP, residual=1e-14)
    rest = solved.states[0].points
    along = np.unique(rest[:, 0])
    mean = [[(state.points - rest)[rest[:, 0] == x, 0].mean() for x in along] for state in solved.states]
    q = np.trapezoid(np.array(mean) * np.sin(np.pi * along / (2 * LENGTH)), along, axis=1)
    rows = np.stack([2 * q[1:-1], np.ones(len(q) - 2)], axis=1)
    cosine = np.linalg.lstsq(rows, q[2:] + q[:-2])[0][0]
    return float(np.arccos(cosine) * steps / PERIOD)


def departure(lab: Lab, spectral_radius: float) -> Finding:
    """The maximum change of the total energy (elastic, kinetic and potential) of a block, divided by the maximum kinetic energy.
    The block is clamped at one side and swings under its own weight, which is applied suddenly.
    """
    mesh = shapes.box((4, 1, 1), (4.0, 1.0, 1.0), "tetrahedron")
    acting = (*neo_hooke(MU, 100 * MU), mass(1.0, spectral_radius), weight(2, -6e4))
    body = Body(mesh, acting, clamped("x0"), frames(STEPS, STEPS), interval=SWINGING / STEPS)
    states = lab.solve(body, "P2/P1", **STEP, residual=1e-10).states
    kinetic = np.array([state.scalars["kinetic_energy"] for state in states])
    total = kinetic + [state.scalars["energy"] for state in states]
    here, before, after = kinetic[1:-1], kinetic[:-2], kinetic[2:]
    swings = int(((here > before) & (here >= after) & (here > kinetic.max() / 3)).sum())
    down = min(state.points[:, 2].min() for state in states)
    note = f"{swings / 2:g} swings, in which the tip drops by {-down:.2g} mm; kinetic energy up to {kinetic.max():.3g} N mm"
    return Finding(float(np.abs(total).max() / kinetic.max()), note=note)


# A smooth pull along x: after the fraction s of the frames, ``10 s^3 - 15 s^4 + 6 s^5`` of the distance WAY [mm] is covered.
FRAMES, WAY = 64, 1e-4 * LENGTH
SMOOTH = Polynomial((0, 0, 0, 10, -15, 6))
PULL = Affine(NO_GRADIENT, (WAY, 0.0, 0.0), tuple((float(i), float(SMOOTH(i / FRAMES))) for i in range(FRAMES + 1)))


def more(lab: Lab, periods: float, factor: float) -> float:
    """The force [N] due to inertia after the first quarter of a pull, which lasts ``periods`` periods of the first mode and
    stretches the bar by 1e-4 of its length.
    """
    pulled, count = (Prescribed("x1", "x1", (0,), PULL),), FRAMES // 4
    bodies = bar((), pulled, count, PERIOD / 4), bar((mass(factor),), pulled, count, periods * PERIOD / 4)
    without, moving = (lab.solve(body, "P2", **STEP, residual=1e-14).last.forces["x1"][0] for body in bodies)
    return float(moving - without)


def slow(lab: Lab, factor: float) -> Finding:
    """The inertia force in the slowest of three pulls, divided by its limit for slow motion. Each pull lasts twice as long as the
    one before it; the error decreases with the square of the speed.
    """
    ladder = tuple((1 / periods, more(lab, periods, factor)) for periods in (4.0, 8.0, 16.0))
    acceleration = WAY * float(SMOOTH.deriv(2)(0.25)) / (16.0 * PERIOD) ** 2
    known = inertia.pull_of_inertia(DENSITY, LENGTH, 1.0, acceleration)
    return Finding(ladder[-1][1] / known, order(ladder, 0.0), ladder, "sizes are pulls per period of the first mode")


MOVING = partial(Entry, group="inertia", kind="closed form")

ENTRIES: tuple[Entry, ...] = (
    MOVING(
        name="free_fall",
        title="Block that falls from rest for a tenth of a second: its fall",
        unit="mm",
        measure=fallen,
        given={"factor": 1.0},
        **control("The inertial mass is 1 % larger than the gravitational mass.", factor=1.01),
        truth=lambda: inertia.fall(G, FALLING),
        within=1e-9,
        relative=True,
        because="The time steps are exact for a constant acceleration; each leaves a residual of 1e-8 N, at forces of 1e-2 N.",
        source="validation/inertia.py, fall",
    ),
    MOVING(
        name="bar_first_frequency",
        title="Bar with one end fixed: frequency of its first longitudinal mode, with time steps that are halved",
        unit="1/s",
        measure=frequency,
        given={"factor": 1.0},
        **control("A mass 1 % too large.", factor=1.01),
        truth=OMEGA,
        within=1e-3,
        relative=True,
        because="With a phase of x = 2 pi / 80 in a time step, the frequency is too low by x^2 / 12 = 5.1e-4.",
        source="validation/inertia.py, first_frequency",
        refinement=Refinement((20, 40, 80), PERIOD, order=2, note="sizes are time steps in seconds"),
    ),
    MOVING(
        name="swing_energy",
        title="Clamped block that swings ten times under its weight: maximum change of its energy divided by maximum kinetic "
        "energy",
        unit="",
        measure=departure,
        given={"spectral_radius": 0.9},
        **control("A time integration that damps out the highest frequencies.", spectral_radius=0.0),
        truth=0.0,
        within=0.01,
        because="Nothing dissipates energy; a drift of 1 % in ten periods of 60 time steps is allowed.",
        kind="property",
        source="conservation of energy",
    ),
    MOVING(
        name="slow_pull",
        title="Bar in three pulls, each slower than the one before: the inertia force, divided by its limit for slow motion",
        unit="",
        measure=slow,
        given={"factor": 1.0},
        **control("A mass 5 % too large.", factor=1.05),
        truth=1.0,
        within=0.02,
        relative=True,
        because="The next term of the expansion is of the order of (period / duration of the pull)^2, which is below 1 %; time "
        "steps of a sixty-fourth of the pull contribute up to 1 % more.",
        source="validation/inertia.py, pull_of_inertia",
    ),
)
