"""Scalar fields by Lagrange elements of FEniCSx, solved in a process of its own; this module needs no FEniCSx."""

import pickle

import numpy as np

from fem_reference.foundations import scratch
from fem_reference.foundations.records import Record
from fem_reference.foundations.subprocesses import command
from fem_reference.foundations.units import Time
from fem_reference.problems.scalar import FieldProblem
from fem_reference.runs.scalar import Solution
from fem_reference.runs.store import Outcome
from fem_reference.solvers.fenicsx.processes import require_installed, running


class FieldSettings(Record):
    """``time_limit``: when to give up, by default never."""

    time_limit: Time | None = None


def solve_field(problem: FieldProblem, settings: FieldSettings) -> Solution:
    """Solve in one worker process; one that dies is the status *crashed*, not an exception."""
    require_installed()
    with scratch.folder() as folder:
        job = folder / "job.pickle"
        job.write_bytes(pickle.dumps(problem))
        return _run(command("-m", f"{__package__}.field_worker", str(job)), settings, len(problem.fixed))


def _run(command_line: list[str], settings: FieldSettings, count: int) -> Solution:
    """What the worker that ``command_line`` starts makes of a problem with ``count`` nodes."""
    with running(command_line, settings.time_limit) as worker:
        for event in worker.events():
            with np.load(event["file"], allow_pickle=False) as arrays:
                return Solution(arrays["values"], Outcome(event["status"], event["message"], event["cost"]))
        return Solution(np.full(count, np.nan), worker.ending("there are no values"))
