"""Runs of every solver on every hard case, and their verdicts."""

import logging
import re
import signal
import threading
import time
from collections.abc import Collection, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from fem_reference import solvers
from fem_reference.assessment import health, stress
from fem_reference.assessment.health import Followed
from fem_reference.assessment.stress import Cell, HardCase, Scene, Stress, Verdict
from fem_reference.effects import name_of
from fem_reference.foundations.errors import InputError, MissingSoftware
from fem_reference.foundations.mesh import Floats
from fem_reference.foundations.subprocesses import MachineTime, spent_since
from fem_reference.problems import of_case
from fem_reference.problems.of_case import CaseProblem, effects_of, mechanical
from fem_reference.runs.key import made_with
from fem_reference.runs.store import Outcome
from fem_reference.scenes.case import Candidate, SolverChoice
from fem_reference.solvers import fenicsx
from fem_reference.solvers.fenicsx.processes import CLOCK
from fem_reference.studies.hard import blocks, following
from fem_reference.studies.hard.following import SameEnd, StalledError, follow
from fem_reference.studies.hard.records import LIMIT, REFERENCE, SECOND, Hard, choices
from fem_reference.studies.law_split import LAW

log = logging.getLogger(__name__)

# The minimum time [s] until a limit raises its exception again, long enough for the first exception to end the run.
_AGAIN = 1.0
# The limit of processor time [s] if a case is repeated with several numbers of load steps or on several meshes.
LONGER = 600.0
# The pattern of a position at rest [mm] in messages.
_PLACE = re.compile(r"cell \d+ at \((-?[\d.]+), (-?[\d.]+), (-?[\d.]+)\) mm")


class _Late(Exception):  # noqa: N818 - it is an event in a run, not an error, and caught in this module
    """Raised if a run takes too much processor time."""


@dataclass(eq=False)
class Posed:
    """A hard case with its problem, which is made once, and with the positions and frame numbers of the reference (``truth``).

    ``in_steps``: the reference is solved again with several numbers of load steps, up to the frame at which it is farthest from its
    first state, even if the case does not request this. ``jitters``: the number of jittered meshes on which it is solved again.
    """

    hard: Hard
    in_steps: bool = False
    jitters: int = 0
    truth: tuple[Floats, tuple[int, ...]] | None = None

    @cached_property
    def problem(self) -> CaseProblem:
        """The problem of the case. Raises InputError if the case is invalid."""
        if self.hard.block is not None:
            return blocks.several(self.hard) if self.hard.beside else blocks.problem(self.hard)
        shipped = self.hard.shipped
        assert shipped is not None  # a Hard record has either a block or a shipped case
        case = shipped.read()
        return of_case.problem(case, of_case.setup(case))


def run(
    hard: Sequence[Hard],
    only: Sequence[str] = (),
    own: Mapping[Candidate, Collection[str] | None] | None = None,
    *,
    in_steps: bool = False,
    jitters: int = 0,
) -> Stress:
    """Run every solver on each case, the reference first.

    ``only``: the names of the solvers of this package that run, by default all. ``own``: the user's solvers, each with the effects
    that it models in addition to a law of the whole muscle, None if these are unknown. ``in_steps``, ``jitters``: see ``Posed``.
    """
    begin, clock, cells = time.perf_counter(), MachineTime.now(), list[Cell]()
    chosen = {name: choice for name, choice in choices().items() if not only or name in only}
    limit = {"time_limit": f"{LIMIT:g} s"}
    own = own or {}
    chosen |= {one.name: SolverChoice(**{"solver": one.solver, **limit, **one.settings}) for one in own}
    takes = {one.name: effects for one, effects in own.items()}
    with fenicsx.shared():
        for i, one in enumerate(hard):
            posed, place = Posed(one, in_steps=in_steps, jitters=jitters), f"case {i + 1} of {len(hard)}: {one.name}"
            for name, choice in chosen.items():
                found = replace(cell(posed, one.choice(choice), takes.get(name)), solver=name)
                log.info("%s, %s: %s: %s", place, name, found.verdict, found.sentence)
                cells.append(found)
    rows = tuple(HardCase(one.name, one.title, one.healthy, one.bound) for one in hard)
    return Stress(rows, tuple(chosen), tuple(cells), time.perf_counter() - begin, made_with() | spent_since(clock))


def cell(posed: Posed, choice: SolverChoice, takes: Collection[str] | None = None) -> Cell:
    """Run a solver on a case, and return the cell with its verdict; a failure is a verdict, never an exception. ``takes``: the
    effects that the solver models in addition to a law, None if unknown; a case with another effect is not applicable.
    """
    begin = time.perf_counter()
    hard, solver = posed.hard, choice.solver
    try:
        if hard.only and solver not in hard.only:
            return Cell(hard.name, solver, "not applicable", f"only for {', '.join(hard.only)}: {hard.because}")
        if hard.by_effects and not (solver == SECOND or solvers.takes_effects(solver)):
            return Cell(
                hard.name,
                solver,
                "not applicable",
                "the case depends on its effects, which this solver does not simulate",
            )
        if takes is not None and (problem := mechanical(posed.problem)) is not None:
            acting = dict.fromkeys(name_of(one) for one in effects_of(problem))
            if lacks := [name for name in acting if name not in (*LAW, *takes)]:
                return Cell(
                    hard.name, solver, "not applicable", f"it leaves out effects of this case: {', '.join(lacks)}"
                )
        with _limited(LONGER if posed.in_steps or posed.jitters else 2 * LIMIT):
            found = _solved(posed, choice)
    except (InputError, MissingSoftware) as error:
        found = Cell(hard.name, solver, "not applicable", str(error))
    except _Late:
        found = Cell(hard.name, solver, "failed", "timed out: it took too much processor time", "timed out")
    except StalledError as why:
        found = Cell(hard.name, solver, "inconclusive", f"stalled: {why}", "stalled")
    except Exception as error:  # an error of a solver is a result here
        log.info("%s, %s: %r", hard.name, solver, error, exc_info=True)
        found = Cell(hard.name, solver, "failed", f"crashed: {type(error).__name__}: {error}", "crashed")
    return replace(found, seconds=time.perf_counter() - begin)


@contextmanager
def _limited(seconds: float) -> Iterator[None]:
    """Raise _Late after ``seconds`` of processor time of this process, and StalledError after ``CLOCK`` times as much clock time.

    Both limits apply only in the main thread. The exceptions are raised repeatedly, because Python may lose one. Processes of the
    reference have a limit of their own.
    """

    def late(*_: object) -> None:
        raise _Late

    def stalled(*_: object) -> None:
        raise StalledError(
            f"more than {CLOCK * seconds:g} s of clock time, but less than {seconds:g} s of processor time"
        )

    if threading.current_thread() is not threading.main_thread():
        yield
        return
    timers = ((signal.ITIMER_PROF, signal.SIGPROF, late, 1), (signal.ITIMER_REAL, signal.SIGALRM, stalled, CLOCK))
    before = [signal.signal(number, handler) for _, number, handler, _ in timers]
    try:
        for timer, _, _, longer in timers:
            signal.setitimer(timer, longer * seconds, max(longer * seconds, _AGAIN))
        yield
    finally:
        for (timer, number, _, _), handler in zip(timers, before, strict=True):
            signal.setitimer(timer, 0)
            signal.signal(number, handler)


def _solved(posed: Posed, choice: SolverChoice) -> Cell:
    """Solve the case, and return the cell with its verdict."""
    hard, solver = posed.hard, choice.solver
    if posed.problem.field is not None:  # the default settings are for bodies, not for fields
        choice = SolverChoice(**{"solver": solver, **hard.settings.get(solver, {})})
    outcome, followed = follow(posed.problem, choice)
    if solver == REFERENCE and posed.problem.field is None and outcome.status == "converged":
        posed.truth = followed.positions, followed.numbers
    if posed.truth is not None and posed.truth[1][: len(followed.numbers)] == followed.numbers:
        followed = replace(followed, truth=posed.truth[0][: len(followed.numbers)])
    found = _judged(hard, Cell(hard.name, solver, "ok", "", outcome.status), outcome.message, followed)
    for ends in _repeated(posed, choice, outcome, followed):
        verdict: Verdict = found.verdict if ends.same else "failed"
        found = replace(found, sentence=f"{found.sentence}; {ends.sentence}", verdict=verdict)
    found = stress.doubted(found, health.unstable(followed), hard.no_solution)
    return replace(found, scene=_scene(found, followed))


def _judged(hard: Hard, blank: Cell, message: str, followed: Followed) -> Cell:
    """Judge a run by the quantities that the case bounds, and return the cell ``blank`` with the verdict."""
    known = [bound for bound in hard.bound if bound.quantity != "from_reference" or followed.truth is not None]
    histories = [(bound, health.history(followed, bound.quantity)) for bound in known]
    begins = followed.least_determinant
    if hard.start is not None and begins is not None and not begins[0] > 0:
        said = f"det F is as low as {begins[0]:.2g} at the start, but this solver needs it above 0 ({blank.status})"
        return replace(blank, verdict="not applicable", sentence=said)
    if blank.status != "converged":
        return stress.unfinished(blank, message, histories, hard.no_solution)
    return stress.judge(blank, histories, hard.contrast)


def _repeated(posed: Posed, choice: SolverChoice, outcome: Outcome, followed: Followed) -> Iterator[SameEnd]:
    """Comparisons of the reference's end states after different numbers of load steps, and of its run with runs on other meshes."""
    hard, built = posed.hard, mechanical(posed.problem)
    if built is None or choice.solver != REFERENCE:
        return
    # With friction the end state depends on the load path.
    asked = posed.in_steps and hard.start is None and not built.body.rubs
    wanted = hard.steps or (following.farthest(followed) if asked else None)
    if wanted is not None:
        yield following.in_steps(built, choice, wanted)
    if posed.jitters:
        first = outcome, followed
        yield following.on_meshes(hard, first, posed.jitters, lambda one: follow(Posed(one).problem, choice))


def _scene(found: Cell, followed: Followed) -> Scene | None:
    """The surface at the decisive frame (the last frame of an unfinished run), with the decisive point or the point that the
    message names. None if the surface is empty or not finite.
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
