"""Every solver on every hard case: runs, and what became of them."""

import logging
import re
import signal
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from functools import cached_property

import numpy as np

from fem_reference import solvers
from fem_reference.assessment import health, second_check, stress
from fem_reference.assessment.health import Followed
from fem_reference.assessment.stress import Cell, HardCase, Scene, Stress
from fem_reference.foundations.errors import InputError, MissingSoftware
from fem_reference.foundations.mesh import Floats
from fem_reference.geometry.embedding import Locator
from fem_reference.problems import of_case
from fem_reference.problems.muscle import Problem
from fem_reference.problems.of_case import CaseProblem
from fem_reference.problems.problem import NO_SURFACE
from fem_reference.runs.key import made_with
from fem_reference.runs.store import Frame, Outcome
from fem_reference.scenes.case import SolverChoice
from fem_reference.solvers import fenicsx
from fem_reference.solvers.fenicsx.processes import CLOCK
from fem_reference.studies.hard import blocks, jitters, steps
from fem_reference.studies.hard.choosing import LIMIT, REFERENCE, SECOND, choices
from fem_reference.studies.hard.records import Hard
from fem_reference.studies.hard.steps import StalledError

log = logging.getLogger(__name__)

LONGER = 600.0  # [s] of processor time of all runs of a case, in several numbers of load steps or on several meshes
_MOST_FOR_SECOND = 200  # tetrahedra, for which it takes seconds
# How messages name a place at rest [mm].
_PLACE = re.compile(r"cell \d+ at \((-?[\d.]+), (-?[\d.]+), (-?[\d.]+)\) mm")


class _Late(Exception):  # noqa: N818 - it is what happened to a run, and caught beside it
    """A run took too much processor time."""


class Posed:
    """A hard case with the problem that it poses, made once, and the reference's run of it."""

    def __init__(self, hard: Hard, *, in_steps: bool = False, jitters: int = 0) -> None:
        """``in_steps``: the reference goes to its farthest frame in several numbers of load steps, whether the case asks or not;
        ``jitters``: on how many other meshes it runs.
        """
        self.hard, self.in_steps, self.jitters = hard, in_steps, jitters
        self.truth: tuple[Floats, tuple[int, ...]] | None = None

    @cached_property
    def problem(self) -> CaseProblem:
        """The problem; InputError where the case cannot be posed."""
        if self.hard.block is not None:
            return blocks.problem(self.hard)
        shipped = self.hard.shipped
        assert shipped is not None  # a Hard record has one of the two
        case = shipped.read()
        return of_case.problem(case, of_case.setup(case))

    @cached_property
    def range(self) -> tuple[float, float]:
        """The range of the constant boundary values of a scalar case."""
        assert self.hard.shipped is not None  # asked of no other
        case = of_case.scalar_case(self.hard.shipped.read())
        values = [float(entry.value) for entry in case.boundary if entry.value is not None]
        return min(values), max(values)

    @property
    def row(self) -> HardCase:
        """What pages say of it."""
        return HardCase(self.hard.name, self.hard.title, self.hard.healthy, self.hard.bound)


def run(hard: Sequence[Hard], only: Sequence[str] = (), *, in_steps: bool = False, jitters: int = 0) -> Stress:
    """Every solver, or ``only`` these, on each of the cases; the reference first, which others may be measured against, and
    ``in_steps`` of 1, 10 and 40 to each case's farthest frame, and on so many other meshes.
    """
    begin, cells = time.perf_counter(), list[Cell]()
    chosen = {name: choice for name, choice in choices().items() if not only or name in only}
    with fenicsx.shared():
        for i, one in enumerate(hard):
            posed = Posed(one, in_steps=in_steps, jitters=jitters)
            for name, choice in chosen.items():
                cells.append(cell(posed, one.choice(choice)))
                found = cells[-1]
                log.info(
                    "case %d of %d: %s, %s: %s: %s", i + 1, len(hard), one.name, name, found.verdict, found.sentence
                )
    rows = tuple(Posed(one).row for one in hard)
    return Stress(rows, tuple(chosen), tuple(cells), time.perf_counter() - begin, made_with())


def cell(posed: Posed, choice: SolverChoice) -> Cell:
    """What becomes of a case by a solver: never an exception."""
    begin = time.perf_counter()
    hard, solver = posed.hard, choice.solver
    try:
        if hard.only and solver not in hard.only:
            return Cell(hard.name, solver, "refused", f"the case is about {', '.join(hard.only)} only: {hard.because}")
        if hard.by_effects and not (solver == SECOND or solvers.takes_effects(solver)):
            return Cell(hard.name, solver, "refused", "nothing but effects acts, and this solver simulates none")
        with _limited(LONGER if posed.in_steps or posed.jitters else 2 * LIMIT):
            found = _solved(posed, choice)
    except (InputError, MissingSoftware) as error:
        found = Cell(hard.name, solver, "refused", str(error))
    except _Late:
        found = Cell(hard.name, solver, "failed", "timed out: it took too much processor time", "timed out")
    except StalledError as why:
        found = Cell(hard.name, solver, "inconclusive", f"stalled: {why}", "stalled")
    except Exception as error:  # whatever a solver does wrong is what this measures
        log.info("%s, %s: %r", hard.name, solver, error, exc_info=True)
        found = Cell(hard.name, solver, "failed", f"crashed: {type(error).__name__}: {error}", "crashed")
    return replace(found, seconds=time.perf_counter() - begin)


@contextmanager
def _limited(seconds: float) -> Iterator[None]:
    """_Late where what is done meanwhile takes longer of this process's processor time, StalledError where it takes many times that
    by the clock, as far as it is in the main thread and lets itself be interrupted; processes of the reference have a limit of
    their own.
    """

    def late(*_: object) -> None:
        raise _Late

    def stalled(*_: object) -> None:
        raise StalledError(f"more than {CLOCK * seconds:g} s by the clock, and not {seconds:g} s of processor time")

    timers = ((signal.ITIMER_PROF, signal.SIGPROF, late, 1), (signal.ITIMER_REAL, signal.SIGALRM, stalled, CLOCK))
    try:
        before = [signal.signal(number, handler) for _, number, handler, _ in timers]
    except ValueError:  # in another thread
        yield
        return
    try:
        for timer, _, _, longer in timers:
            signal.setitimer(timer, longer * seconds)
        yield
    finally:
        for timer, *_ in timers:
            signal.setitimer(timer, 0)
        for (_, number, _, _), handler in zip(timers, before, strict=True):
            signal.signal(number, handler)


def _solved(posed: Posed, choice: SolverChoice) -> Cell:
    """The cell of a solver that is asked for the case."""
    hard, muscle = posed.hard, posed.problem.muscle
    of_reference = choice.solver == REFERENCE
    if muscle is None:
        outcome, followed = _field(posed, choice)
    elif choice.solver == SECOND:
        outcome, followed = _second(muscle, choice)
    else:
        outcome, followed = _muscle(muscle, choice)
    blank = Cell(hard.name, choice.solver, "ok", "", outcome.status)
    if of_reference and muscle is not None and outcome.status == "converged":
        posed.truth = followed.positions, followed.numbers
    if posed.truth is not None and posed.truth[1][: len(followed.numbers)] == followed.numbers:
        followed = replace(followed, truth=posed.truth[0][: len(followed.numbers)])
    known = [bound for bound in hard.bound if bound.quantity != "from_reference" or followed.truth is not None]
    histories = [(bound, health.history(followed, bound.quantity)) for bound in known]
    begins = followed.least_determinant
    if hard.start is not None and begins is not None and not begins[0] > 0:
        said = f"it begins with det F down to {begins[0]:.2g}, where it needs more than 0: {outcome.status}"
        found = replace(blank, verdict="refused", sentence=said)
    elif outcome.status != "converged":
        found = stress.unfinished(blank, outcome.message, histories, hard.no_solution)
    else:
        found = stress.judge(blank, histories, hard.contrast)
    wanted = hard.steps or (steps.farthest(followed) if posed.in_steps and hard.start is None else None)
    if of_reference and muscle is not None and wanted is not None:
        ends = steps.compare(muscle, choice, wanted)
        found = replace(found, sentence=f"{found.sentence}; {ends.sentence}")
        found = found if ends.same else replace(found, verdict="failed")
    if of_reference and muscle is not None and posed.jitters:
        others = jitters.compare(
            hard, (outcome, followed), posed.jitters, lambda one: _muscle(_muscle_problem(one), choice)
        )
        found = replace(found, sentence=f"{found.sentence}; {others.sentence}")
        found = found if others.same else replace(found, verdict="failed")
    found = stress.doubted(found, health.unstable(followed), hard.no_solution)
    return replace(found, scene=_scene(found, followed))


def _muscle_problem(hard: Hard) -> Problem:
    built = Posed(hard).problem.muscle
    assert built is not None  # as that of the case is
    return built


def _muscle(built: Problem, choice: SolverChoice) -> tuple[Outcome, Followed]:
    offer = solvers.find(choice.solver, choice.solver)
    if offer.moves not in ("surface", "tetrahedra"):
        raise InputError(
            choice.solver, f"a solver that moves {offer.moves}", "one that moves a surface, which health is of"
        )
    settings = solvers.settings(choice, choice.solver)
    solvers.check(choice.solver, settings, built.effects, choice.solver)
    solvers.require(choice.solver, settings, choice.solver)
    frames = list[Frame]()
    outcome = offer.solve(built, settings, frames.append)
    steps.check_not_stalled(outcome)
    if not frames:
        frames.append(Frame(built.frames[0], np.array(built.surface.points)))
    if solvers.takes_effects(choice.solver):
        outcome = second_check.confirmed_frames(built, frames, outcome, settings)
    return outcome, _followed(built, frames)


def _followed(built: Problem, frames: list[Frame]) -> Followed:
    tets = [frame.points for frame in frames if len(frame.points)]
    whole = len(tets) == len(frames)
    return Followed(
        tuple(int(frame.number) for frame in frames),
        built.surface,
        np.array([frame.surface for frame in frames if frame.surface is not None]),
        built.mesh if whole else None,
        np.array(tets) if whole else None,
        built.bones,
        built.free,
        integrated=_all(frames, "volume_ratio"),
        negative_modes=_all(frames, "negative_modes"),
        material_modes=_all(frames, "material_modes"),
        least_determinant=_least(frames),
    )


def _least(frames: list[Frame]) -> Floats | None:
    """The least det F at any point that a solver looks at (f,), None where it does not say."""
    found = [_all(frames, f"min_det_F_{where}") for where in ("quadrature", "vertices")]
    known = [one for one in found if one is not None]
    return np.min(known, axis=0) if known else None


def _all(frames: list[Frame], scalar: str) -> Floats | None:
    """A scalar of all frames (f,), None where not all have it."""
    found = [frame.scalars[scalar] for frame in frames if scalar in frame.scalars]
    return np.array(found) if len(found) == len(frames) else None


def _second(built: Problem, choice: SolverChoice) -> tuple[Outcome, Followed]:
    """By a solver of bodies of any shape; the surface goes along with the tetrahedra."""
    if len(built.mesh.tets) > _MOST_FOR_SECOND:
        want = f"at most {_MOST_FOR_SECOND}: it is written in Python, to be right and not fast"
        raise InputError(choice.solver, f"{len(built.mesh.tets)} tetrahedra", want)
    offer = solvers.find(choice.solver, choice.solver, "solve_body")
    solved = offer.run(built.body, solvers.settings(choice, choice.solver, "solve_body"))
    where = Locator(built.mesh).embed(built.surface.points)
    frames = [
        Frame(
            state.number,
            built.surface.points + where.interpolate(built.mesh, state.points - built.mesh.points),
            points=state.points,
            scalars=state.scalars,
        )
        for state in solved.states
    ]
    return solved.outcome, _followed(built, frames)


def _field(posed: Posed, choice: SolverChoice) -> tuple[Outcome, Followed]:
    """By a solver of scalar fields, whose settings for bodies do not matter there."""
    offer = solvers.find(choice.solver, choice.solver, "solve_field")
    changes = posed.hard.settings.get(choice.solver, {})
    settings = solvers.settings(SolverChoice(solver=choice.solver, **changes), choice.solver, "solve_field")
    field = posed.problem.field
    assert field is not None  # what is no muscle
    solution = offer.run(field, settings)
    steps.check_not_stalled(solution.outcome)
    nothing = np.zeros((1, 0, 3))
    return solution.outcome, Followed((0,), NO_SURFACE, nothing, values=solution.values, range=posed.range)


def _scene(found: Cell, followed: Followed) -> Scene | None:
    """The picture of the frame that decided, of a run that ended before all of them the last one, with the place that its message
    names; None of what has no surface, or is not finite.
    """
    ended = found.status != "converged"
    i = len(followed.positions) - 1 if ended else found.at
    points, history = followed.positions[i], found.history
    if not len(points) or not np.isfinite(points).all():
        return None
    place = None if history is None or history.points is None else history.points[i]
    if ended and (named := _PLACE.search(found.sentence)):
        off = followed.surface.points - [float(number) for number in named.groups()]
        place = points[np.argmin(np.linalg.norm(off, axis=1))]
    return Scene(points, followed.surface.triangles, place)
