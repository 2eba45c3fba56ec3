"""A mass-spring system: report section 5.5.1, eqs 5.3 to 5.7.

A volumetric model, as Table 5.1 has it: the masses are the points of the tetrahedra, the springs their edges. (Janak's masses
sample fibres and are joined to those near them; here the mesh says which are.) They carry the surface and the fibres along.
Springs resist neither a change of volume nor a tetrahedron that turns inside out. Attachments are exact, whatever the stiffness
of an attachment. Contact acts on the masses of the surface: what is between those may be inside.
"""

import math
import time
from dataclasses import dataclass
from itertools import combinations
from typing import Annotated, Literal

import numpy as np
from pydantic import BeforeValidator

from fem_reference.foundations.mesh import Floats, Ints, Surface, TetMesh, boundary, tet_volumes
from fem_reference.foundations.motion import apply
from fem_reference.foundations.records import Record
from fem_reference.foundations.units import AccelerationVector, Density, Stiffness, Time, positive
from fem_reference.geometry.embedding import Embedding, Locator
from fem_reference.problems.muscle import Problem
from fem_reference.runs.store import Frame, Outcome, Sink
from fem_reference.solvers import collision_kernels
from fem_reference.solvers.collision_kernels import Obstacle, move_out
from fem_reference.solvers.common.frame_loop import follow, other_clock, refused
from fem_reference.solvers.common.protocol import MuscleSolver, Trade
from fem_reference.solvers.common.state_checks import Trouble, trouble
from fem_reference.solvers.pbd import Collision
from fem_reference.solvers.spring_kernels import Network, PrescribedPath, advance, forces

# Where no time step is asked for, it is this share of the greatest that is stable.
SHARE_OF_STABLE = 0.9
# More steps than this in a frame number are not begun: on 3,000 tetrahedra they take two seconds, and runs have hundreds of them.
_MOST_STEPS = 100_000
# Compiled code is asked for so many steps at once: only in between can the user interrupt.
_AT_ONCE = 200
_REPORT = "eq. 5.5"


def _damping(text: object) -> float | str:
    """A damping coefficient [N s/mm], or the report's as it is."""
    if text == _REPORT:
        return _REPORT
    try:
        return positive(text, "a damping")
    except ValueError as error:
        raise ValueError(f'"{_REPORT}" or {error}') from error


class Settings(Record):
    """How stiff and heavy the muscle is, and how fast it is moved.

    ``stiffness``: of every spring. ``density``: of the muscle, shared out evenly over the masses: equilibrium does
    not depend on them, and a small one would make every time step small.
    ``frame_time``: the solver's own time from a frame number to the next, and the longer it is the nearer the muscle is to
    equilibrium; the scene's interval is the clock of what the reference and recorded sequences do in time. ``damping``: the
    coefficient c, or ``"eq. 5.5"``, see ``report_damping``; without it none.
    ``gravity``: an acceleration; without it none. ``collision``: contact with bones, at every step; without it none.
    ``time_step``: the longest step wanted; without it one that is stable.
    """

    stiffness: Stiffness
    density: Density
    frame_time: Annotated[Time, Trade(("5 ms", "20 ms", "80 ms"))]
    damping: Annotated[float | Literal["eq. 5.5"] | None, BeforeValidator(_damping)] = None
    gravity: AccelerationVector | None = None
    collision: Collision | None = None
    time_step: Time | None = None


def network_of(mesh: TetMesh, settings: Settings) -> Network:
    """The masses and springs of a mesh."""
    pairs = np.concatenate([mesh.tets[:, list(pair)] for pair in combinations(range(4), 2)])
    springs = np.unique(np.sort(pairs, axis=1), axis=0)
    mass = settings.density * float(tet_volumes(mesh.points, mesh.tets).sum()) / len(mesh.points)
    return Network(
        masses=np.full(len(mesh.points), mass),
        springs=springs,
        lengths=np.linalg.norm(mesh.points[springs[:, 1]] - mesh.points[springs[:, 0]], axis=1),
        stiffness=settings.stiffness,
        damping=_coefficient(settings, mass),
        gravity=np.array(settings.gravity or (0.0, 0.0, 0.0)),
    )


def _coefficient(settings: Settings, mass: float) -> float:
    """The damping coefficient c [N s/mm] of settings."""
    if settings.damping is None:
        return 0.0
    return settings.damping if isinstance(settings.damping, float) else report_damping(mass, settings.stiffness)


def report_damping(mass: float, stiffness: float) -> float:
    """Eq. 5.5, c = 2 sqrt(2 m (2 + 4 / k_a)), as a coefficient [N s/mm] of a ``mass`` [tonne] and a ``stiffness`` [N/mm].

    It adds a number to one over a stiffness and is valid in one system of units only, which the report does not name. Read in SI
    (kg, N/m, N s/m), as here, it is the critical damping 2 sqrt(m k) of a mass on a spring of k = 4 + 8 / k_a: of k_a itself
    where that is 2 + sqrt(12) = 5.46 N/m, and of 4 N/m where k_a is large.
    """
    kilograms, newtons_per_metre = 1000 * mass, 1000 * stiffness
    return 2 * math.sqrt(2 * kilograms * (2 + 4 / newtons_per_metre)) / 1000


def stable_time_step(network: Network, fixed: Ints) -> float:
    """The time step [s] below which eqs 5.6 and 5.7 are stable, whatever the shape.

    A mode of the free masses is stable where ``4 m - 2 c dt - k dt^2 > 0`` (the Jury conditions), with k its stiffness. Of springs
    that is at most ``2 n_i k`` of mass i with n_i springs, stretched or not, so each mass has a limit, and the least counts. The
    positive root is ``4 m / (c + sqrt(c^2 + 4 k m))``, which takes no difference of great numbers. For c = 0 it is 2 / omega
    with omega^2 = 2 n k / m, which two masses on one spring reach.
    """
    springs = network.stiffness * np.bincount(network.springs.ravel(), minlength=len(network.masses))
    c = network.damping
    limits = 4 * network.masses / (c + np.hypot(c, np.sqrt(8 * springs * network.masses)))
    return float(np.delete(limits, fixed).min(initial=math.inf))


@dataclass(frozen=True, eq=False)
class Model:
    """A muscle as masses and springs: its ``network``, the masses of each attachment and all of them together, ``fixed``,
    the bones as ``obstacles`` with ``stiffness``, and where the ``surface`` and the ``fibres`` are in the tetrahedra.
    """

    problem: Problem
    network: Network
    attached: tuple[Ints, ...]
    fixed: Ints
    obstacles: list[Obstacle]
    stiffness: float
    surface: Embedding
    fibres: Embedding

    @classmethod
    def of(cls, problem: Problem, settings: Settings) -> "Model":
        """The model of a problem."""
        attached = tuple(np.unique(problem.mesh.facets[entry.attachment]) for entry in problem.attached)
        fixed = np.unique(np.concatenate([np.zeros(0, np.int64), *attached]))
        locator, collision = Locator(problem.mesh), settings.collision
        return cls(
            problem=problem,
            network=network_of(problem.mesh, settings),
            attached=attached,
            fixed=fixed,
            obstacles=[] if collision is None else _obstacles(problem, fixed, collision.gap),
            stiffness=0.0 if collision is None else collision.stiffness,
            surface=locator.embed(problem.surface.points),
            fibres=locator.embed(problem.fibres.points),
        )

    def move(self, points: Floats, previous: Floats, number: int, time_step: float, steps: int) -> None:
        """Take ``points`` and those a step before, (n, 3) [mm], in place from the frame number before to ``number``."""
        before, after = (self._carried(frame)[self.fixed] for frame in (number - 1, number))
        if not self.obstacles:
            for done in range(0, steps, _AT_ONCE):
                upto = min(done + _AT_ONCE, steps)
                start, end = ((1 - step / steps) * before + step / steps * after for step in (done, upto))
                advance(points, previous, self.network, PrescribedPath(self.fixed, start, end), time_step, upto - done)
            return
        for share in np.arange(1, steps + 1) / steps:
            there = (1 - share) * before + share * after
            advance(points, previous, self.network, PrescribedPath(self.fixed, there, there), time_step, 1)
            for one in self.obstacles:
                one.move(number - 1 + share)
            move_out(points, self.obstacles, self.stiffness)

    def _carried(self, number: int) -> Floats:
        """The masses (n, 3) [mm] at rest, but attached ones where they are at frame ``number``."""
        points = np.array(self.problem.mesh.points)
        for entry, masses in zip(self.problem.attached, self.attached, strict=True):
            points[masses] = apply(entry.bone.pose(number), points[masses])
        return points

    def frame(self, points: Floats, number: int) -> Frame:
        """What masses at ``points`` (n, 3) make of surface and fibres; attached vertices are where the bones have them.

        Scalars: ``unbalanced_max`` [N], the greatest force on a free mass, and ``inverted_tets``, how many are inside
        out.
        """
        given, mesh = self.problem, self.problem.mesh
        moved = points - mesh.points
        surface = given.surface.points + self.surface.interpolate(mesh, moved)
        for entry in given.attached:
            surface[entry.vertices] = apply(entry.bone.pose(number), given.surface.points[entry.vertices])
        free = np.delete(forces(points, self.network), self.fixed, axis=0)
        scalars = {
            "unbalanced_max": float(np.linalg.norm(free, axis=1).max(initial=0.0)),
            "inverted_tets": float((tet_volumes(points, mesh.tets) <= 0).sum()),
        }
        return Frame(
            number, surface, given.fibres.points + self.fibres.interpolate(mesh, moved), points.copy(), scalars
        )


def _obstacles(problem: Problem, fixed: Ints, gap: float) -> list[Obstacle]:
    """All bones, as obstacles of the free masses of the surface."""
    loose = np.zeros(len(problem.mesh.points), bool)
    loose[boundary(problem.mesh.tets)[0]] = True
    loose[fixed] = False
    return [Obstacle(bone, problem.mesh.points, loose, gap) for bone in problem.bones]


class Motion:
    """The masses of a ``model`` going from frame number to frame number, each in as many ``steps`` of the same length."""

    def __init__(self, model: Model, settings: Settings, wanted: float, seconds_compile: float) -> None:
        """``wanted``: how many steps, rounded up, in a frame number."""
        self.model, self.settings = model, settings
        self.points = model.problem.begin(model.problem.mesh.points)
        self.previous = self.points.copy()
        self.rest = Surface(model.problem.mesh.points, boundary(model.problem.mesh.tets)[0])
        self.steps = max(1, math.ceil(wanted - 1e-9))
        self.time_step = settings.frame_time / self.steps
        free = len(self.points) - len(model.fixed)
        self.cost: dict[str, float] = {"seconds_compile": seconds_compile, "unknowns": 3.0 * free, "time_steps": 0}

    @property
    def advice(self) -> str:
        """What may help: a stable time step, else what brings the masses to rest."""
        limit = stable_time_step(self.model.network, self.model.fixed)
        if self.time_step > limit:
            return f"the time step of {self.time_step:.3g} s is above the stable one of {limit:.3g} s"
        return "a longer frame_time or more damping may help"

    def move(self, number: int) -> None:
        """Take the steps of a frame number."""
        self.model.move(self.points, self.previous, number, self.time_step, self.steps)
        self.cost["time_steps"] += self.steps

    def trouble(self) -> Trouble | None:
        """What is wrong with the boundary of the tetrahedra."""
        return trouble(self.points, self.rest, self.model.fixed)

    def frame(self, number: int) -> Frame:
        """What the masses make of surface and fibres."""
        return self.model.frame(self.points, number)

    def ending(self) -> Outcome:
        """Converged, as every step is; how many tetrahedra are inside out in the end, and whether the scene has another clock."""
        problem, frames = self.model.problem, self.model.problem.frames
        steps = f"{frames[-1] - frames[0]} frame numbers of {self.steps} steps of {self.time_step:.3g} s"
        notes = _inverted(self.points, problem.mesh.tets) + other_clock(problem, self.settings.frame_time)
        return Outcome("converged", steps + notes)


def solve(problem: Problem, settings: Settings, sink: Sink) -> Outcome:
    """Step from rest at the first of ``problem.frames`` to the last of them; each frame wanted goes into ``sink``."""
    seconds_compile, model = _compile(settings), Model.of(problem, settings)
    longest = settings.time_step or SHARE_OF_STABLE * stable_time_step(model.network, model.fixed)
    wanted = settings.frame_time / longest
    motion = Motion(model, settings, wanted, seconds_compile)
    if wanted > _MOST_STEPS:
        why = Trouble("out of steps", _too_many(wanted, settings, model.network))
        return refused(motion, problem.frames[0], sink, why)
    return follow(motion, problem, sink)


def _too_many(steps: float, settings: Settings, network: Network) -> str:
    """Why nothing was begun: what makes so many ``steps`` of a frame number."""
    if settings.time_step is not None:
        return f"{steps:.3g} steps in a frame number, at most {_MOST_STEPS}; a longer time_step may help"
    what = f"a stiffness of {network.stiffness:.3g} N/mm and a damping of {network.damping:.3g} N s/mm"
    helps = "a lower stiffness, less damping, a greater density or a shorter frame_time may help"
    return f"{what} want {steps:.3g} steps in a frame number, at most {_MOST_STEPS}; {helps}"


def _inverted(points: Floats, tets: Ints) -> str:
    """How many tetrahedra are inside out in the end, empty if none is."""
    count = int((tet_volumes(points, tets) <= 0).sum())
    return f"; {count} of {len(tets)} tetrahedra are inside out at the last frame" if count else ""


def _compile(settings: Settings) -> float:
    """Run every compiled function once, on one spring; seconds."""
    begin = time.perf_counter()
    points, nothing = np.array([[0.0, 0, 0], [1, 0, 0]]), np.zeros((0, 3))
    network = Network(np.ones(2), np.array([[0, 1]]), np.ones(1), 1.0, 0.0, np.zeros(3))
    advance(points, points.copy(), network, PrescribedPath(np.zeros(0, np.int64), nothing, nothing), 0.1, 1)
    forces(points, network)
    if settings.collision is not None:
        collision_kernels.compile_all()
    return time.perf_counter() - begin


_EXAMPLE = {"stiffness": "1 N/mm", "density": "1060 kg/m3", "frame_time": "20 ms", "damping": "eq. 5.5"}
SOLVES = (MuscleSolver(settings=Settings, solve=solve, moves="tetrahedra", example=_EXAMPLE),)
