"""A mass-spring system. Report section 5.5.1, eqs 5.3 to 5.7.

This is a volumetric model, as in Table 5.1: the points of the tetrahedral mesh are masses, and its edges are springs. (In another
model, by Janak, the masses are points sampled on fibres and connected to nearby masses.) The displacement of the surface and of the
fibres is interpolated from the masses. Springs resist neither a change of volume nor the inversion of a tetrahedron. Attachments
are exact; their stiffness is ignored. Contact acts only on masses at the surface, so the surface between them may penetrate a bone.
"""

import math
from itertools import combinations
from typing import Annotated, Literal

import numpy as np
from pydantic import BeforeValidator

from fem_reference.foundations.mesh import Floats, Ints, Surface, TetMesh, boundary, tet_volumes
from fem_reference.foundations.motion import apply
from fem_reference.foundations.records import Record
from fem_reference.foundations.units import AccelerationVector, Density, Stiffness, Time, positive
from fem_reference.geometry.embedding import Locator
from fem_reference.problems.muscle import MuscleProblem
from fem_reference.runs.store import Frame, Outcome, Sink
from fem_reference.solvers.collision_kernels import colliding_bones, move_out
from fem_reference.solvers.common.frame_loop import carry, follow, other_clock, refused, timed
from fem_reference.solvers.common.protocol import MuscleSolver, TableRow, Trade
from fem_reference.solvers.common.state_checks import SurfaceCheck, Trouble
from fem_reference.solvers.pbd import PbdCollision
from fem_reference.solvers.spring_kernels import Network, PrescribedPath, advance, forces

# The default time step divided by the largest stable time step.
SHARE_OF_STABLE = 0.9
# The maximum number of time steps per frame number; this many take more than two seconds with 3,000 tetrahedra.
_MOST_STEPS = 100_000
# The number of time steps in one call of compiled code. A user can interrupt a run only between two calls.
_AT_ONCE = 200
_REPORT = "eq. 5.5"


def _damping(text: object) -> float | str:
    """The damping coefficient [N s/mm] in a ``text``, or ``"eq. 5.5"``."""
    if text == _REPORT:
        return _REPORT
    try:
        return positive(text, "a damping")
    except ValueError as error:
        raise ValueError(f'"{_REPORT}" or {error}') from error


class MassSpringSettings(Record):
    """Stiffness, density, loads and time steps of the mass-spring system.

    ``stiffness``: the stiffness of each spring. ``density``: the density of the muscle, which is divided into equal masses: a
    single small mass would make every time step small, and equilibrium without gravity does not depend on the masses.
    ``frame_time``: the time between two frame numbers in this solver, which replaces the interval of the scene; the longer it is,
    the closer the muscle comes to equilibrium. ``damping``: the damping coefficient, or ``"eq. 5.5"`` for its value by eq. 5.5 of
    the report; by default there is no damping. ``gravity``: an acceleration, by default none. ``collision``: contact with bones
    after every time step, by default none. ``time_step``: the maximum time step, by default 0.9 times the stable one.
    """

    stiffness: Stiffness
    density: Density
    frame_time: Annotated[Time, Trade(("5 ms", "20 ms", "80 ms"))]
    damping: Annotated[float | Literal["eq. 5.5"] | None, BeforeValidator(_damping)] = None
    gravity: AccelerationVector | None = None
    collision: PbdCollision | None = None
    time_step: Time | None = None


def network_of(mesh: TetMesh, settings: MassSpringSettings) -> Network:
    """The masses and springs of a tetrahedral mesh."""
    pairs = np.concatenate([mesh.tets[:, list(pair)] for pair in combinations(range(4), 2)])
    springs = np.unique(np.sort(pairs, axis=1), axis=0)
    mass = settings.density * float(tet_volumes(mesh.points, mesh.tets).sum()) / len(mesh.points)
    damping = report_damping(mass, settings.stiffness) if settings.damping == _REPORT else settings.damping or 0.0
    return Network(
        masses=np.full(len(mesh.points), mass),
        springs=springs,
        lengths=np.linalg.norm(mesh.points[springs[:, 1]] - mesh.points[springs[:, 0]], axis=1),
        stiffness=settings.stiffness,
        damping=float(damping),
        gravity=np.array(settings.gravity or (0.0, 0.0, 0.0)),
    )


def report_damping(mass: float, stiffness: float) -> float:
    """The damping coefficient c = 2 sqrt(2 m (2 + 4 / k_a)) [N s/mm] of eq. 5.5, for a ``mass`` m [tonne] and a ``stiffness`` k_a
    [N/mm].

    The equation adds a constant to the reciprocal of a stiffness, so it holds in only one system of units, which the report does
    not state. In SI units (kg, N/m, N s/m), which are used here, c is the critical damping 2 sqrt(m k) of a mass on a spring of
    stiffness k = 4 + 8 / k_a. This k equals k_a for k_a = 2 + sqrt(12) = 5.46 N/m, and approaches 4 N/m for large k_a.
    """
    kilograms, newtons_per_metre = 1000 * mass, 1000 * stiffness
    return 2 * math.sqrt(2 * kilograms * (2 + 4 / newtons_per_metre)) / 1000


def stable_time_step(network: Network, fixed: Ints) -> float:
    """The time step [s] below which eqs 5.6 and 5.7 are stable, however the network is deformed. ``fixed``: the attached masses.

    A mode with stiffness k of the free masses is stable if ``4 m - 2 c dt - k dt^2 > 0`` (the Jury conditions). At a mass with
    n_i springs, stretched or not, k is at most ``2 n_i`` times the stiffness of a spring. The result is the smallest limit over all
    free masses. Each limit is the positive root ``4 m / (c + sqrt(c^2 + 4 k m))``, written in a form without cancellation. For
    c = 0 the root is 2 / omega with omega^2 = k / m, which is the exact limit for two masses on one spring.
    """
    springs = network.stiffness * np.bincount(network.springs.ravel(), minlength=len(network.masses))
    c = network.damping
    limits = 4 * network.masses / (c + np.hypot(c, np.sqrt(8 * springs * network.masses)))
    return float(np.delete(limits, fixed).min(initial=math.inf))


class MassSpringModel:
    """A muscle of masses and springs, advanced from each frame number to the next.

    ``network``: the masses and springs. ``fixed`` (k,): the attached masses. ``bones``: the bones with which free masses at the
    surface collide. ``points`` (n, 3) [mm]: the present positions of the masses. ``previous`` (n, 3) [mm]: their positions one time
    step earlier.
    """

    def __init__(self, problem: MuscleProblem, settings: MassSpringSettings) -> None:
        mesh, collision, locator = problem.mesh, settings.collision, Locator(problem.mesh)
        self.problem, self.settings, self.network = problem, settings, network_of(mesh, settings)
        self.attached = [np.unique(mesh.facets[entry.attachment]) for entry in problem.attached]
        self.fixed = np.unique(np.concatenate([np.zeros(0, np.int64), *self.attached]))
        skin = boundary(mesh.tets)[0]
        # Only masses on the surface collide with bones.
        still = np.union1d(self.fixed, np.setdiff1d(np.arange(len(mesh.points)), skin))
        self.bones = [] if collision is None else colliding_bones(problem.bones, mesh.points, still, collision.gap)
        self.surface, self.fibres = locator.embed(problem.surface.points), locator.embed(problem.fibres.points)
        self.points = problem.begin(mesh.points)
        self.previous = self.points.copy()
        self.check = SurfaceCheck(Surface(mesh.points, skin), self.fixed)
        stable = stable_time_step(self.network, self.fixed)
        longest = settings.time_step or SHARE_OF_STABLE * stable
        self.wanted = settings.frame_time / longest
        self.steps = max(1, math.ceil(self.wanted - 1e-9))
        self.time_step = settings.frame_time / self.steps
        self.advice = "a longer frame_time or more damping may help"
        if self.time_step > stable:
            self.advice = f"the time step of {self.time_step:.3g} s is longer than the stable step of {stable:.3g} s"
        free = len(self.points) - len(self.fixed)
        self.cost: dict[str, float] = {"unknowns": 3.0 * free, "time_steps": 0}

    def move(self, number: int) -> None:
        """Take the time steps from the previous frame number to frame ``number``."""
        before, after = (self.carried(frame)[self.fixed] for frame in (number - 1, number))
        at_once = 1 if self.bones else _AT_ONCE
        for done in range(0, self.steps, at_once):
            upto = min(done + at_once, self.steps)
            start, end = ((1 - step / self.steps) * before + step / self.steps * after for step in (done, upto))
            path = PrescribedPath(self.fixed, start, end)
            advance(self.points, self.previous, self.network, path, self.time_step, upto - done)
            for bone in self.bones:
                bone.move(number - 1 + upto / self.steps)
            if self.settings.collision is not None:
                move_out(self.points, self.bones, self.settings.collision.stiffness)
        self.cost["time_steps"] += self.steps

    def carried(self, number: int) -> Floats:
        """Positions (n, 3) [mm]: those at rest, except that attached masses have moved with their bones to frame ``number``."""
        points = np.array(self.problem.mesh.points)
        for entry, masses in zip(self.problem.attached, self.attached, strict=True):
            points[masses] = apply(entry.bone.pose(number), points[masses])
        return points

    def trouble(self) -> Trouble | None:
        """The trouble with the boundary surface of the mesh; None if there is none."""
        return self.check.trouble(self.points)

    def frame(self, number: int) -> Frame:
        """The surface and the fibres, interpolated from the masses. Attached vertices move exactly with their bones.

        Scalars: ``unbalanced_max`` [N], the maximum force on a free mass, and ``inverted_tets``, the number of inverted tetrahedra.
        """
        given, mesh = self.problem, self.problem.mesh
        moved = self.points - mesh.points
        surface = given.surface.points + self.surface.interpolate(mesh, moved)
        carry(surface, given, number)
        free = np.delete(forces(self.points, self.network), self.fixed, axis=0)
        unbalanced = float(np.linalg.norm(free, axis=1).max(initial=0.0))
        scalars = {"unbalanced_max": unbalanced, "inverted_tets": float(self._inverted())}
        fibres = given.fibres.points + self.fibres.interpolate(mesh, moved)
        return Frame(number, surface, fibres, self.points.copy(), scalars)

    def _inverted(self) -> int:
        """The number of inverted tetrahedra."""
        return int((tet_volumes(self.points, self.problem.mesh.tets) <= 0).sum())

    def ending(self) -> Outcome:
        """The outcome, always *converged*. Its message states the number of inverted tetrahedra at the last frame and, if
        ``frame_time`` differs from the interval of the scene, both times.
        """
        frames, count, tets = self.problem.frames, self._inverted(), len(self.problem.mesh.tets)
        done = f"{frames[-1] - frames[0]} frame numbers with {self.steps} steps of {self.time_step:.3g} s each"
        note = f"; {count} of {tets} tetrahedra are inside out at the last frame" if count else ""
        return Outcome("converged", done + note + other_clock(self.problem, self.settings.frame_time))


def solve(problem: MuscleProblem, settings: MassSpringSettings, sink: Sink) -> Outcome:
    """Advance from rest at the first of ``problem.frames`` to the last; each requested frame goes to ``sink``.

    The status is *out of steps* if the motion to a frame number needs too many time steps.
    """
    quick = settings.model_copy(update={"time_step": settings.frame_time})
    model = timed(MassSpringModel, problem, settings, quick)
    if model.wanted <= _MOST_STEPS:
        return follow(model, problem, sink)
    what, helps = "", "a longer time_step may help"
    if settings.time_step is None:
        stiffness, damping = model.network.stiffness, model.network.damping
        what = f"a stiffness of {stiffness:.3g} N/mm and a damping of {damping:.3g} N s/mm need "
        helps = "a lower stiffness, less damping, a greater density or a shorter frame_time may help"
    why = f"{what}{model.wanted:.3g} steps for each frame number, but at most {_MOST_STEPS} are allowed; {helps}"
    return refused(model, problem.frames[0], sink, Trouble("out of steps", why))


_EXAMPLE = {"stiffness": "1 N/mm", "density": "1060 kg/m3", "frame_time": "20 ms", "damping": "eq. 5.5"}
_TABLE = TableRow(
    "MSS",
    "mass_spring",
    {"stiffness": "0.1 N/mm", "density": "1060 kg/m3", "frame_time": "20 ms", "damping": "0.005 N s/m"}
    | {"collision": {"gap": "0.5 mm", "stiffness": 1.0}},
)
SOLVES = (
    MuscleSolver(
        settings=MassSpringSettings,
        solve=solve,
        moves="tetrahedra",
        example=_EXAMPLE,
        depends_on=("size",),
        table=(_TABLE,),
    ),
)
