"""Sessions: one FEniCSx process that solves one problem after another, and reuses compiled and loaded code."""

from collections.abc import Iterator
from contextlib import AbstractContextManager, contextmanager, nullcontext
from contextvars import ContextVar
from dataclasses import replace
from pathlib import Path

import cloudpickle
import numpy as np

from fem_reference.foundations.errors import InputError
from fem_reference.foundations.subprocesses import scratch_folder
from fem_reference.problems.body import Body
from fem_reference.problems.checks import check
from fem_reference.problems.scalar import FieldProblem
from fem_reference.runs.store import Frame, Outcome, Run, Sink, collected
from fem_reference.solvers.fenicsx.jobs import Job
from fem_reference.solvers.fenicsx.processes import Process, command_line, installed, require_installed
from fem_reference.solvers.fenicsx.settings import BodySettings, FieldSettings


class Session:
    """Solves problems in a subprocess on ``ranks``, restarted if it died; jobs and frames are passed as files in a ``folder``."""

    def __init__(self, folder: Path, ranks: int) -> None:
        self.folder, self.ranks = folder.resolve(), ranks  # the process may have another working directory
        self.process: Process | None = None
        self.closed = False

    def solve(self, body: Body, settings: BodySettings) -> Run:
        """Solve for ``body`` and return the run, in memory."""
        frames: list[Frame] = []
        outcome = self.follow(body, settings, frames.append)
        return replace(collected(frames, outcome), solver="fenicsx", body=body, settings=settings)

    def follow(self, body: Body, settings: BodySettings, sink: Sink) -> Outcome:
        """Solve for ``body`` and pass its frames to ``sink``. Raises InputError if element, ranks or solver do not suit it."""
        check(body, settings.element, settings.quadrature_degree)
        if body.touching and self.ranks > 1:
            raise InputError("ranks", self.ranks, "1, as touching parts are supported on one rank only")
        if body.touching and settings.linear_solver == "multigrid":
            want = "another solver, as multigrid does not support touching parts"
            raise InputError("linear_solver", '"multigrid"', want)
        return self.run(Job(body, settings), settings.time_limit, sink)

    def run(self, job: Job | FieldProblem, time_limit: float | None, sink: Sink) -> Outcome:
        """Solve the ``job`` and pass each frame to ``sink``. No exception is raised if the process dies (status *crashed*) or is
        ended at the time limit (*timed out* or *stalled*). Raises RuntimeError if the session is closed.
        """
        if self.closed:
            raise RuntimeError("the session is closed")
        path = self.folder / "job.pickle"
        path.write_bytes(cloudpickle.dumps(job))
        process = self.process = self.process or Process(command_line(self.ranks))
        lasts = False
        try:
            outcome = process.solve(path, time_limit, sink)
            lasts = process.overran is None and outcome.status != "crashed"
        finally:
            if not lasts:  # late reports on this job must not reach the next job
                self.process = None
                process.end()
        return outcome


@contextmanager
def session(ranks: int = 1) -> Iterator[Session]:
    """A context with a session, whose process ends with the context. Raises MissingSoftware if FEniCSx is not installed."""
    require_installed()
    with scratch_folder() as folder:
        own = Session(folder, ranks)
        try:
            yield own
            if own.process:
                own.process.finish()
        finally:
            own.closed = True
            if own.process:
                own.process.end()


_shared: ContextVar[Session | None] = ContextVar("shared", default=None)


@contextmanager
def shared(own: Session | None = None) -> Iterator[None]:
    """A context in which one process solves all problems on one rank, and reuses loaded and compiled code. A process that is
    already shared remains in use. With a session ``own``, its process solves all problems on as many ranks as the session has.
    Without FEniCSx nothing is shared.
    """
    used = own or _shared.get()
    with session() if used is None and installed() else nullcontext(used) as common:
        before = _shared.set(common)
        try:
            yield
        finally:
            _shared.reset(before)


def opened(ranks: int = 1) -> AbstractContextManager[Session]:
    """The shared session if it has this number of ``ranks``, otherwise a new one. Raises MissingSoftware without FEniCSx."""
    common = _shared.get()
    if common is None or common.ranks != ranks:
        return session(ranks)
    require_installed()
    return nullcontext(common)


def solve_on(body: Body, settings: BodySettings, sink: Sink) -> Outcome:
    """Solve for ``body``, in the shared session or in a new one, and pass its frames to ``sink``."""
    with opened() as solver:
        return solver.follow(body, settings, sink)


def solve_body(body: Body, settings: BodySettings) -> Run:
    """The run of ``body`` in memory, solved in the shared session or in a new one."""
    with opened() as solver:
        return solver.solve(body, settings)


def solve_scalar(problem: FieldProblem, settings: FieldSettings, sink: Sink) -> Outcome:
    """Solve for a scalar field, in the shared session or a new one, and pass it (NaN if the process died) to ``sink``."""
    frames: list[Frame] = []
    with opened() as solver:
        outcome = solver.run(problem, settings.time_limit, frames.append)
    lost = Frame.of_field(problem, np.full(len(problem.fixed), np.nan), problem.form)
    sink(frames[0] if frames else lost)
    return outcome
