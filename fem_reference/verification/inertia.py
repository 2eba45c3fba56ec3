"""Inertia: a fall, a bar that vibrates, a block that swings far, and the limit of slow motion."""

from dataclasses import dataclass

import numpy as np

from fem_reference.assessment.catalogue import Entry, Finding, Lab, order
from fem_reference.effects import Effect, make
from fem_reference.foundations.mesh import Floats
from fem_reference.problems import shapes
from fem_reference.problems.body import Body, Prescribed
from fem_reference.problems.paths import Rest
from fem_reference.runs.solved import Solved
from fem_reference.verification import truths

GROUP = "inertia"
_SOURCE = "validation/inertia.py"
_DENSITY = 1e-9  # tonne/mm^3
_MU, _BULK, _LENGTH = 0.01, 0.02, 10.0
_MODULUS = truths.find("inertia").uniaxial_modulus(_MU, _BULK)
_OMEGA = truths.find("inertia").first_frequency(_MODULUS, _DENSITY, _LENGTH)
_PERIOD = 2 * np.pi / _OMEGA
_AT_ONCE = [{"frame": 0.0, "amount": 1.0}]


def _inertia(factor: float = 1.0, spectral_radius: float = 0.9) -> Effect:
    return make("inertia", density=factor * _DENSITY, spectral_radius=spectral_radius)


def _weight(axis: int, acceleration: float) -> Effect:
    vector = ", ".join(f"{acceleration if i == axis else 0.0!r}" for i in range(3))
    return make("gravity", density=_DENSITY, acceleration=f"{vector} mm/s^2", ramp=_AT_ONCE)


def _times(count: int) -> tuple[float, ...]:
    return tuple(float(i) for i in range(count + 1))


# A fall: nothing holds the body, so that mass alone is what its tangent has.
_G, _FALLING = 9810.0, 0.1


def _fallen(lab: Lab, factor: float = 1.0) -> Finding:
    mesh = shapes.box((1, 1, 1), (10.0, 10.0, 10.0), "tetrahedron")
    flesh = make("neo_hooke", mu=_MU), make("incompressible", bulk=1e3 * _MU)
    body = Body(mesh, (*flesh, _inertia(factor), _weight(2, -_G)), (), _times(10), interval=_FALLING / 10)
    solved = lab.solve(body, "P2/P1", first_step=1.0, largest_step=1.0)
    return Finding(5.0 - float(solved.last.points[:, 2].mean()))


_FALL = Entry(
    name="free_fall",
    group=GROUP,
    title="Block that falls from rest for a tenth of a second",
    unit="mm",
    truth=lambda: float(truths.find("inertia").fall(_G, _FALLING)),
    within=1e-9,
    relative=True,
    because="Steps in time are exact for a constant acceleration; forces are in balance to 1e-8 N of 1e-2 N in each step.",
    kind="closed form",
    source=f"{_SOURCE}, fall",
    measure=_fallen,
    negative_control="A mass 1 % larger than what is heavy.",
    with_negative_control=lambda lab: _fallen(lab, 1.01),
)


# A bar that cannot widen, under a small weight along it that acts at once.
def _bar(acting: tuple[Effect, ...], prescribed: tuple[Prescribed, ...], count: int, seconds: float) -> Body:
    mesh = shapes.box((8, 1, 1), (_LENGTH, 1.0, 1.0), "tetrahedron")
    sides = tuple(
        Prescribed(name, name, (axis,), Rest()) for axis, name in ((1, "y0"), (1, "y1"), (2, "z0"), (2, "z1"))
    )
    flesh = make("neo_hooke", mu=_MU), make("incompressible_penalty", bulk=_BULK)
    fixed = Prescribed("x0", "x0", (0,), Rest())
    return Body(mesh, (*flesh, *acting), (fixed, *sides, *prescribed), _times(count), interval=seconds / count)


def _frequency(lab: Lab, steps: int, factor: float) -> float:
    """Of the first mode [rad/s], in so many steps a period, over two of them: of any cosine of n steps about a mean, q,
    ``q(n + 1) + q(n - 1) = 2 c q(n) + constant``, c the cosine of what one step turns.
    """
    acting = _inertia(factor), _weight(0, 1e-4 * _MODULUS / _DENSITY / _LENGTH)
    body = _bar(acting, (), 2 * steps, 2 * _PERIOD)
    solved = lab.solve(body, "P2", first_step=1.0, largest_step=1.0, residual=1e-14)
    rest = solved.states[0].points
    along = np.unique(rest[:, 0])
    mean = [[(state.points - rest)[rest[:, 0] == x, 0].mean() for x in along] for state in solved.states]
    q = np.trapezoid(np.array(mean) * np.sin(np.pi * along / (2 * _LENGTH)), along, axis=1)
    rows = np.stack([2 * q[1:-1], np.ones(len(q) - 2)], axis=1)
    cosine = np.linalg.lstsq(rows, q[2:] + q[:-2])[0][0]
    return float(np.arccos(cosine) * steps / _PERIOD)


def _frequencies(lab: Lab, factor: float = 1.0) -> Finding:
    ladder = tuple((_PERIOD / steps, _frequency(lab, steps, factor)) for steps in (20, 40, 80))
    return Finding(ladder[-1][1], order(ladder, _OMEGA), ladder, "sizes are seconds of a step")


_FREQUENCY = Entry(
    name="bar_first_frequency",
    group=GROUP,
    title="Bar with one end fixed: frequency of its first longitudinal mode, by steps in time that are halved",
    unit="1/s",
    truth=lambda: float(_OMEGA),
    within=1e-3,
    relative=True,
    because="A step that turns the mode by x = 2 pi / 80 slows it down by x^2 / 12 = 5.1e-4.",
    kind="closed form",
    source=f"{_SOURCE}, first_frequency",
    measure=_frequencies,
    negative_control="A mass 1 % too large.",
    with_negative_control=lambda lab: _frequencies(lab, 1.01),
)


# A block clamped at one side that its own weight bends, at once: it swings.
def _swing(lab: Lab, acting: tuple[Effect, ...], count: int, seconds: float) -> Solved:
    mesh = shapes.box((4, 1, 1), (4.0, 1.0, 1.0), "tetrahedron")
    flesh = make("neo_hooke", mu=_MU), make("incompressible", bulk=100 * _MU)
    clamp = Prescribed("x0", "x0", (0, 1, 2), Rest())
    body = Body(mesh, (*flesh, *acting), (clamp,), _times(count), interval=seconds / count)
    return lab.solve(body, "P2/P1", first_step=1.0, largest_step=1.0, residual=1e-10)


_SWINGING = 0.17  # [s] that ten swings take
_STEPS = 600


def _departure(lab: Lab, spectral_radius: float) -> Finding:
    """How far elastic, kinetic and potential energy together are from what they are at rest, 0."""
    acting = _inertia(1.0, spectral_radius), _weight(2, -6e4)
    states = _swing(lab, acting, _STEPS, _SWINGING).states
    kinetic = np.array([state.scalars["kinetic_energy"] for state in states])
    total = kinetic + [state.scalars["energy"] for state in states]
    swings = int(
        ((kinetic[1:-1] > kinetic[:-2]) & (kinetic[1:-1] >= kinetic[2:]) & (kinetic[1:-1] > kinetic.max() / 3)).sum()
    )
    down = min(state.points[:, 2].min() for state in states)
    note = f"{swings / 2:g} swings, in which the tip goes {-down:.2g} mm down; kinetic energy up to {kinetic.max():.3g} N mm"
    return Finding(float(np.abs(total).max() / kinetic.max()), note=note)


_ENERGY = Entry(
    name="swing_energy",
    group=GROUP,
    title="Clamped block that swings ten times under its weight: greatest change of its energy over its greatest kinetic energy",
    unit="",
    truth=lambda: 0.0,
    within=0.01,
    relative=False,
    because="Nothing takes energy away; 1 % in ten periods of 60 steps is what is asked for.",
    kind="property",
    source="conservation of energy",
    measure=lambda lab: _departure(lab, 0.9),
    negative_control="A step in time that leaves nothing of the shortest waves.",
    with_negative_control=lambda lab: _departure(lab, 0.0),
)


@dataclass(frozen=True)
class _Smooth:
    """A displacement along x of ``distance`` [mm] times ``10 s^3 - 15 s^4 + 6 s^5``, s being the share of ``frames``."""

    distance: float
    frames: float

    def __call__(self, points: Floats, frame: float) -> Floats:
        """The displacement (n, 3) of rest points (n, 3)."""
        s = frame / self.frames
        moved = np.zeros_like(points)
        moved[:, 0] = self.distance * (10 * s**3 - 15 * s**4 + 6 * s**5)
        return moved

    def acceleration(self, s: float, seconds: float) -> float:
        """[mm/s^2] at the share s of so many ``seconds``."""
        return float(self.distance * (60 * s - 180 * s**2 + 120 * s**3) / seconds**2)


def _more(lab: Lab, periods: float, factor: float) -> float:
    """The force [N] that inertia adds at a quarter of a pull of so many ``periods`` of the first mode, of 1e-4 of the length."""
    path = _Smooth(1e-4 * _LENGTH, 64.0)
    plate = Prescribed("x1", "x1", (0,), path)
    forces = []
    for acting in ((), (_inertia(factor),)):
        body = _bar(acting, (plate,), 64, periods * _PERIOD)
        settings = {"first_step": 1.0, "largest_step": 1.0, "residual": 1e-14}
        forces.append(float(lab.solve(body, "P2", **settings).states[16].forces["x1"][0]))
    return forces[1] - forces[0]


def _slow(lab: Lab, factor: float = 1.0) -> Finding:
    """By pulls that take twice as long: the force is of order 2 in the speed."""
    ladder = tuple((1 / periods, _more(lab, periods, factor)) for periods in (4.0, 8.0, 16.0))
    seconds = 16.0 * _PERIOD
    known = truths.find("inertia").pull_of_inertia(
        _DENSITY, _LENGTH, 1.0, _Smooth(1e-4 * _LENGTH, 64.0).acceleration(0.25, seconds)
    )
    return Finding(ladder[-1][1] / known, order(ladder, 0.0), ladder, "sizes are pulls a period of the first mode")


_LIMIT = Entry(
    name="slow_pull",
    group=GROUP,
    title="Bar that is pulled more and more slowly: what inertia adds to the force, over what it is in the limit",
    unit="",
    truth=lambda: 1.0,
    within=0.02,
    relative=True,
    because="The next order of the expansion is the square of a period over the time, times numbers of order 1: below 1 %; steps "
    "of a sixty-fourth of the pull add as much.",
    kind="closed form",
    source=f"{_SOURCE}, pull_of_inertia",
    measure=_slow,
    negative_control="A mass 5 % too large.",
    with_negative_control=lambda lab: _slow(lab, 1.05),
)

ENTRIES = (_FALL, _FREQUENCY, _ENERGY, _LIMIT)
