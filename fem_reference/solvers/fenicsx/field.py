"""Scalar fields by Lagrange elements of FEniCSx, solved in a subprocess; this module needs no FEniCSx."""

import pickle
from contextlib import nullcontext
from pathlib import Path
from typing import Any

import numpy as np

from fem_reference.foundations import scratch
from fem_reference.foundations.records import Record
from fem_reference.foundations.units import Time
from fem_reference.problems.scalar import FieldProblem
from fem_reference.runs.store import Frame, Outcome, Run, Sink
from fem_reference.solvers.common.protocol import solved
from fem_reference.solvers.fenicsx.processes import require_installed
from fem_reference.solvers.fenicsx.session import present, session


class FieldSettings(Record):
    """``time_limit``: processor time after which to give up, by default none."""

    time_limit: Time | None = None


def solve(problem: FieldProblem, settings: FieldSettings, sink: Sink) -> Outcome:
    """Solve in the shared process or in a new one; a process that dies is the status *crashed*, not an exception."""
    require_installed()
    values = np.full(len(problem.fixed), np.nan)

    def take(event: dict[str, Any]) -> None:
        with np.load(event["file"], allow_pickle=False) as arrays:
            values[:] = arrays["values"]
        Path(event["file"]).unlink()

    shared = present()
    with scratch.folder() as folder, nullcontext(shared) if shared else session() as solver:
        job = folder.resolve() / "job.pickle"  # a shared process may have been started elsewhere
        job.write_bytes(pickle.dumps(problem))
        outcome = solver.run(job, settings.time_limit, take, "fields")
    sink(Frame.of_field(problem, values, problem.form))
    return outcome


def solve_field(problem: FieldProblem, settings: FieldSettings) -> Run:
    """The run of a scalar field, in memory."""
    return solved(solve, problem, settings)
