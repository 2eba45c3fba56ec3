"""Processor time per iteration of the fast solvers of Table 5.1, and the speed of the machine and of the report's program.

Processor time of all threads is measured, as wall time is not reliable on a shared machine.
"""

import time
from dataclasses import replace
from math import nan
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks import over
from fem_reference import solvers
from fem_reference.assessment.solver_table import report_speeds
from fem_reference.foundations.errors import InputError
from fem_reference.foundations.records import Record
from fem_reference.problems import setup as muscles  # not its Setup, a name that has a meaning for asv
from fem_reference.runs.store import Frame
from fem_reference.scenes import casefile
from fem_reference.studies.execution import Bench

CASES = ("hip_flexion", "box_squeeze", "gluteus_maximus", "box_squeeze_report")
SOLVERS = {one.name: one for one in solvers.in_table()}
# The maximum number of timed iterations, those of a short run whose time is subtracted, and the number of repeats.
ITERATIONS, WARM_UP, REPEATS = 100, 2, 3


def spent(solver: str, settings: Record, setup: Any, iterations: int) -> float:
    """Processor time [s] of ``iterations`` from the first frame on; NaN if the solver failed."""
    first = setup.frames[0]

    def drop(frame: Frame) -> None:
        """Discard a frame."""

    moved: Any = replace(setup, frames=(first, first + iterations))  # surface solvers need no more of a problem
    begin = time.process_time()
    ended = solvers.find(solver, "benchmarks").solve(moved, settings, drop)
    return time.process_time() - begin if ended.status == "converged" else nan


def per_iteration(solver: str, settings: Record, setup: muscles.Setup, counts: tuple[int, int], repeats: int) -> float:
    """Processor time [s] per iteration, from the difference between runs of the two ``counts`` of iterations, each the fastest of
    its repeats; NaN if the solver failed, or took too little time to be measured.
    """
    times = [[spent(solver, settings, setup, count) for count in counts] for _ in range(repeats)]
    less, more = np.min(times, axis=0)  # disturbances only make runs longer
    return float(more - less) / (counts[1] - counts[0]) if more > less else nan


class Iteration:
    """An iteration of each solver on cases; skipped if the data of a case are missing."""

    timeout = 600

    def setup(self, case: str, solver: str) -> None:
        """Read the case and compile all that the solver needs; asv skips a benchmark with a NotImplementedError."""
        self.bench = Bench(casefile.read_muscle(case), Path())
        try:
            self.bench.setup()
        except InputError as error:
            raise NotImplementedError(str(error)) from error
        self.solver = SOLVERS[solver].solver
        self.settings = self.bench.settings(SOLVERS[solver], solver)
        made: Any = self.bench.given(solvers.find(self.solver, self.solver), self.settings)
        self.made = made
        spent(self.solver, self.settings, made, WARM_UP)

    @over("s", case=CASES, solver=SOLVERS)
    def track_seconds(self, case: str, solver: str) -> float:  # noqa: ARG002
        """Processor time [s]."""
        frames = self.bench.scene.frames
        counts = (WARM_UP, min(ITERATIONS, frames.last - frames.first))
        return per_iteration(self.solver, self.settings, self.made, counts, REPEATS)

    @over("times as fast", case=[case for case in CASES if case in report_speeds()], solver=SOLVERS)
    def track_times_as_fast_as_the_report(self, case: str, solver: str) -> float:
        """Iterations per second relative to the report's program, on cases for which the report states its speed."""
        return 1 / (self.track_seconds(case, solver) * report_speeds()[case].per_second)


class Machine:
    """The speed of one thread of the machine: a copy of arrays too large for a cache, a product of matrices that fit into it."""

    def setup(self) -> None:
        """Make arrays of 128 MiB, and a matrix of 256 by 256."""
        self.source, self.matrix = np.ones(2**24), np.ones((256, 256))
        self.target = np.empty_like(self.source)

    def time_copy(self) -> None:
        """A copy of 128 MiB."""
        np.copyto(self.target, self.source)

    def time_multiply(self) -> None:
        """A product by plain loops, 33.6 million multiplications and additions."""
        np.einsum("ij,jk->ik", self.matrix, self.matrix, optimize=False)
