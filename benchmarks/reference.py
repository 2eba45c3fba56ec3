"""Costs of the finite element reference by phase: on generated fusiform bodies, and on muscles with bones."""

import os
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import replace
from math import nan
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from benchmarks import over
from benchmarks.bodies import fusiform
from fem_reference import solvers
from fem_reference.assessment.second_check import RECORD
from fem_reference.foundations.errors import InputError
from fem_reference.foundations.mesh import Floats
from fem_reference.foundations.subprocesses import processor_times
from fem_reference.problems.body import Body
from fem_reference.runs.store import Frame, Outcome
from fem_reference.scenes import casefile
from fem_reference.solvers import fenicsx
from fem_reference.solvers.fenicsx.session import Session
from fem_reference.studies.execution import Bench

# Rings and slices of the fusiform body by element: 25 000 to 29 000 unknowns.
BODIES = {"Q1/P0": (4, 30), "P2/P0": (2, 18), "P2/P1": (2, 20)}
# Muscle cases: the last frame and the number of MPI processes (None: that of the case).
MUSCLES: dict[str, tuple[str, int | None, int | None]] = {
    "hip_flexion": ("hip_flexion", None, None),
    "gluteus_maximus to frame 100": ("gluteus_maximus", 100, None),
    "gluteus_maximus to frame 100 on 2 ranks": ("gluteus_maximus", 100, 2),
    "gluteus_maximus": ("gluteus_maximus", None, None),
}
# Costs as in outcomes [s, MB, counts]. Wall time is the sum of the ``PARTS``, which contain the phases; ``moved_mm`` is the root
# mean square of the final displacement, which shows whether two commits solve the same problem.
PARTS = ("seconds_set_up", "seconds_solve", "seconds_stability")
PHASES = ("seconds_assembly", "seconds_contact", "seconds_factorisation", "seconds_krylov")
COUNTS = ("factorisations", "krylov_iterations", "newton_iterations", "load_steps", "cut_backs", "unknowns")
COSTS = ("seconds_wall", "seconds_processor", *PARTS, *PHASES, *COUNTS, "peak_memory_mb", "moved_mm")
REPEATS = 3
# Muscles whose second check is measured relative to the run that it checks, at the quick size with all frames of the case.
CHECKED = ("hip_flexion", "gluteus_medius", "gluteus_maximus")

Costs = dict[str, float]


def processor() -> float:
    """Processor time [s] of this process and of its running subprocesses."""
    return sum(processor_times(os.getpid()).values())


def costs(outcome: Outcome, moved: Floats) -> Costs:
    """The cost of a solution that displaced its nodes by ``moved`` (n, 3) [mm]; RuntimeError if it did not converge."""
    if outcome.status != "converged":
        raise RuntimeError(f"{outcome.status}: {outcome.message}")
    more = {
        "seconds_wall": sum(outcome.cost[part] for part in PARTS),
        "moved_mm": float(np.sqrt((moved**2).mean() * 3)),
    }
    return {**outcome.cost, **more}


def median(repeats: list[Costs]) -> Costs:
    """The median of each cost over repeats."""
    return {name: float(np.median([one[name] for one in repeats])) for name in repeats[0]}


def solve_fusiform(own: Session, body: Body, element: str) -> Costs:
    """The costs of a fusiform body, solved in the process of a session."""
    solved = own.solve(body, fenicsx.BodySettings(element=element, first_step=1.0))
    return costs(solved.outcome, solved.states[-1].points - body.mesh.points)


@contextmanager
def prepared(element: str) -> Iterator[Callable[[], Costs]]:
    """A function that solves the fusiform body in a separate process, which has compiled and loaded all code for it."""
    body = fusiform(element, *BODIES[element])
    with fenicsx.session() as own:
        solve_fusiform(own, replace(body, frames=body.frames[:1]), element)
        yield lambda: solve_fusiform(own, body, element)


def solve_muscle(case: str, last: int | None, ranks: int | None) -> Costs:
    """The costs of the reference of a muscle, which is not stored; InputError if its data are missing."""
    bench = Bench(casefile.read_muscle(case), Path(), ranks)
    settings, problem = bench.settings(bench.scene.reference, "reference"), bench.problem()
    frames = tuple(frame for frame in problem.frames if last is None or frame <= last)
    reached = list[Frame]()
    solve = solvers.find(bench.scene.reference.solver, bench.scene.place).solve
    outcome = solve(replace(problem, frames=frames), settings, reached.append)
    rest, tets = problem.mesh.points, reached[-1].points if reached else None
    return costs(outcome, rest - rest if tets is None else tets - rest)


def second_check(case: str) -> Costs:
    """The second check of a muscle at its quick size: its processor time [s], and its ``share`` [%] of the processor time of the
    complete run from reading the surface to this check. The run is not stored. InputError if the data of the case are missing.
    """
    scene = casefile.read_muscle(case, casefile.read_muscle(case).quick)
    with TemporaryDirectory() as folder:
        before = sum(os.times()[:4])  # with processes that have ended
        run = Bench(scene, Path(folder)).reference()
        whole = sum(os.times()[:4]) - before
    seconds = run.origin[RECORD]["seconds"]
    return {"seconds": seconds, "share": 100 * seconds / whole}


class Fusiform:
    """The reference on fusiform bodies."""

    timeout = 3600

    def setup_cache(self) -> dict[str, Costs]:
        """The costs by element, medians over repeats."""
        found = {}
        for element in BODIES:
            with prepared(element) as solve:
                found[element] = median([solve() for _ in range(REPEATS)])
        return found

    @over("s, MB, mm or 1", element=BODIES, cost=COSTS)
    def track_cost(self, found: dict[str, Costs], element: str, cost: str) -> float:
        """A cost."""
        return found[element].get(cost, nan)


class Muscle:
    """The reference on muscles with bones, each solved once; NaN if the data of a case are missing."""

    timeout = 7200

    def setup_cache(self) -> dict[str, Costs]:
        """The costs by muscle; code is compiled before, with the first two frames."""
        found = {}
        for name, (case, last, ranks) in MUSCLES.items():
            try:
                solve_muscle(case, casefile.read_muscle(case).numbers[1], ranks)
                found[name] = solve_muscle(case, last, ranks)
            except InputError:
                found[name] = {}
        return found

    @over("s, MB, mm or 1", muscle=MUSCLES, cost=COSTS)
    def track_cost(self, found: dict[str, Costs], muscle: str, cost: str) -> float:
        """A cost."""
        return found[muscle].get(cost, nan)


class SecondCheck:
    """The second check of muscles with bones; NaN if the data of a case are missing."""

    timeout = 3600

    def setup_cache(self) -> dict[str, Costs]:
        """The time and the share by muscle."""
        found = dict[str, Costs]()
        for case in CHECKED:
            with suppress(InputError):
                found[case] = second_check(case)
        return found

    @over("s or %", muscle=CHECKED, cost=("seconds", "share"))
    def track_cost(self, found: dict[str, Costs], muscle: str, cost: str) -> float:
        """The time or the share."""
        return found.get(muscle, {}).get(cost, nan)


class Interleaved:
    """The reference on fusiform bodies as timed by asv: commits alternate, so that other load of the machine affects both."""

    timeout = 3600
    number, repeat, rounds, warmup_time = 1, 1, 3, 0
    timer = staticmethod(processor)

    def setup(self, element: str) -> None:
        """Start a process that has compiled and loaded all code."""
        self.stack = ExitStack()
        self.solve = self.stack.enter_context(prepared(element))

    @over("seconds", element=BODIES)
    def time_solve(self, element: str) -> None:  # noqa: ARG002
        """Processor time [s] of a solution."""
        self.solve()

    def teardown(self, element: str) -> None:  # noqa: ARG002
        """End the process."""
        self.stack.close()
