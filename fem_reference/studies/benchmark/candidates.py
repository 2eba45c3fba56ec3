"""The speed of solvers in processor time, beside that of the machine and that of the report's own program.

Processor time, of all threads together, is what a machine shared by many can report; and a ratio within one run is what compares
with another.
"""

import logging
import time
from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np

from fem_reference import solvers
from fem_reference.assessment.solver_table import report_speeds, solver_kinds
from fem_reference.foundations.errors import InputError
from fem_reference.foundations.records import Record
from fem_reference.report.tables import finite
from fem_reference.runs.store import Frame
from fem_reference.scenes.case import Candidate
from fem_reference.scenes.muscle import MuscleCase
from fem_reference.studies.execution import Bench
from fem_reference.studies.table_5_1 import chosen

log = logging.getLogger(__name__)

# Iterations that are timed, less those of a short run that sets up the same; and how often: the fastest counts.
ITERATIONS, WARM_UP = 100, 2
REPEATS = 3


@dataclass(frozen=True)
class Timing:
    """How fast ``name`` is on a muscle of ``triangles``: CPU time for an iteration in each repeat (r,) [s], and how many of them
    a second the report's program makes on that case, None where the report does not say.
    """

    case: str
    name: str
    solver: str
    triangles: int
    seconds: tuple[float, ...]
    limit: float | None

    @property
    def per_second(self) -> float | None:
        """Iterations in a second of CPU time, in the fastest repeat; None where one failed."""
        return 1 / min(self.seconds) if np.isfinite(self.seconds).all() else None

    @property
    def ratio(self) -> float | None:
        """How many times as fast as the report's program."""
        return None if self.limit is None or self.per_second is None else self.per_second / self.limit


@dataclass(frozen=True)
class Machine:
    """What one thread of the machine does: ``copied`` [GB/s] between arrays too large for a cache, ``multiplied`` [GFLOP/s] of
    matrices that fit into it, by plain loops; the fastest of the repeats.
    """

    copied: float
    multiplied: float


def check(scene: MuscleCase) -> None:
    """InputError unless a scene is long enough to be timed."""
    if scene.frames.last - scene.frames.first <= WARM_UP:
        raise InputError(f"{scene.place}: frames.last", scene.frames.last, f"more than {WARM_UP} frame numbers")


def measure(benches: Iterable[Bench[MuscleCase]]) -> tuple[list[Timing], Machine]:
    """Every candidate of Table 5.1 that iterates on every scene of ``benches``, each repeat with a look at the machine; one that
    fails has times that are not numbers.
    """
    machines, timings = [_machine()], list[Timing]()
    for bench in benches:
        tasks = {candidate.name: (candidate, _task(bench, candidate, place)) for candidate, place in _candidates(bench)}
        seconds: dict[str, list[float]] = {name: [] for name in tasks}
        for repeat in range(REPEATS):
            for name, (_, task) in tasks.items():
                log.info("%s: %s, repeat %d of %d", bench.scene.name, name, repeat + 1, REPEATS)
                seconds[name].append(_per_iteration(task, bench))
            machines.append(_machine())
        triangles, report = len(bench.setup().surface.triangles), report_speeds().get(bench.scene.name)
        limit = None if report is None else report.per_second
        for name, (candidate, _) in tasks.items():
            spent = tuple(seconds[name])
            timings.append(Timing(bench.scene.name, name, candidate.solver, triangles, spent, limit))
    return timings, Machine(*(max(getattr(one, key) for one in machines) for key in ("copied", "multiplied")))


def _candidates(bench: Bench[MuscleCase]) -> list[tuple[Candidate, str]]:
    """Who iterates from frame number to frame number: what was recorded does not, nor do lines of action."""
    found = [entry for row in solver_kinds() for entry in chosen(bench.scene, row)]
    return [entry for entry in found if entry[0].solver not in ("recorded", "line_of_action")]


def _task(bench: Bench[MuscleCase], candidate: Candidate, place: str) -> Callable[[int], str]:
    """The solver's work as a function of how many iterations; it returns how it ended."""
    return partial(_solve, bench, candidate.solver, bench.settings(candidate, place))


def _solve(bench: Bench[MuscleCase], solver: str, settings: Record, iterations: int) -> str:
    built: Any = bench.given(solvers.find(solver, solver), settings)
    first = built.frames[0]

    def drop(frame: Frame) -> None:
        """Nobody looks at it."""

    shortened = replace(built, frames=(first, first + iterations))
    ended: Any = solvers.find(solver, bench.scene.place).solve(shortened, settings, drop)
    return str(ended.status)


def _per_iteration(task: Callable[[int], str], bench: Bench[MuscleCase]) -> float:
    """CPU time [s] for an iteration; not a number where the solver failed, or took too little to be speed."""
    frames = bench.scene.frames
    count = min(ITERATIONS, frames.last - frames.first)
    if task(WARM_UP) != "converged":  # compiled functions are loaded, which is not counted
        return float("nan")
    spent = []
    for iterations in (WARM_UP, count):
        begin = time.process_time()
        if task(iterations) != "converged":
            return float("nan")
        spent.append(time.process_time() - begin)
    longer = spent[1] - spent[0]
    return longer / (count - WARM_UP) if longer > 0 else float("nan")


def _machine() -> Machine:
    source = np.ones(2**24)
    target, matrix = np.empty_like(source), np.ones((256, 256))
    copy = _fastest(lambda: np.copyto(target, source))
    multiply = _fastest(lambda: np.einsum("ij,jk->ik", matrix, matrix, optimize=False))
    return Machine(2 * source.nbytes / copy / 1e9, 2 * 256**3 / multiply / 1e9)


def _fastest(work: Callable[[], object]) -> float:
    """CPU time [s] of the fastest of five."""
    spent = []
    for _ in range(5):
        begin = time.process_time()
        work()
        spent.append(time.process_time() - begin)
    return min(spent)


def facts(timings: list[Timing], machine: Machine) -> dict[str, Any]:
    """All of it as JSON has it."""
    return {
        "machine": {"copied_GB_per_s": machine.copied, "multiplied_GFLOP_per_s": machine.multiplied},
        "timings": [
            vars(one)
            | {"seconds": [finite(each) for each in one.seconds], "per_second": one.per_second, "ratio": one.ratio}
            for one in timings
        ],
    }


def text(timings: list[Timing], machine: Machine) -> str:
    """The same for people."""
    lines = [
        f"machine: copies {machine.copied:.1f} GB/s, multiplies matrices at {machine.multiplied:.2f} GFLOP/s",
        "iterations a second of CPU time, the fastest of the repeats:",
    ]
    for one in timings:
        beside = "" if one.ratio is None else f", {one.ratio:.2f} times the report's program ({one.limit:g} a second)"
        speed = "failed" if one.per_second is None else f"{1 / max(one.seconds):.4g} to {one.per_second:.4g}"
        lines.append(f"  {one.case}, {one.triangles} triangles: {one.name} {speed}{beside}")
    return "\n".join(lines)
