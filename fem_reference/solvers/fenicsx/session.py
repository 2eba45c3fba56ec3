"""One FEniCSx process that solves bodies one after the other, and reuses what it has compiled and loaded."""

from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager, nullcontext
from contextvars import ContextVar
from dataclasses import replace
from pathlib import Path
from typing import Any

import cloudpickle
import numpy as np

from fem_reference.foundations import scratch
from fem_reference.foundations.subprocesses import command
from fem_reference.problems.body import Body, check_quadrature
from fem_reference.problems.checks import check
from fem_reference.runs.store import Frame, Outcome, Run, Sink, collected
from fem_reference.solvers.fenicsx.jobs import Job, stored_state
from fem_reference.solvers.fenicsx.processes import Process, installed, require_installed, running
from fem_reference.solvers.fenicsx.settings import BodySettings


class Session:
    """Solves bodies in a subprocess of its own, which is restarted after it died."""

    def __init__(self, folder: Path, stack: ExitStack) -> None:
        """``folder``: for jobs and states; ``stack`` ends the processes."""
        self.folder, self.stack = folder, stack
        self.process: Process | None = None
        self.closed = False

    def solve(self, body: Body, settings: BodySettings) -> Run:
        """The run of ``body``, in memory."""
        frames: list[Frame] = []
        outcome = self.follow(body, settings, frames.append)
        return replace(collected(frames, outcome), solver="fenicsx", body=body, settings=settings)

    def follow(self, body: Body, settings: BodySettings, sink: Sink) -> Outcome:
        """Pass the frames of ``body`` to ``sink``. A process that dies is the status *crashed*, and one over the time limit is
        ended and *timed out* or *stalled*, not an exception. RuntimeError once the session is closed.
        """
        if self.closed:
            raise RuntimeError("the session is closed")
        check(body, settings.element)
        check_quadrature(settings.element, settings.quadrature_degree, "quadrature_degree")
        job = self.folder / "job.pickle"
        job.write_bytes(cloudpickle.dumps(Job(body, settings)))
        return self.run(job, settings.time_limit, lambda event: sink(_state(event)), "states")

    def run(self, job: Path, time_limit: float | None, sink: Callable[[dict[str, Any]], None], kept: str) -> Outcome:
        """Solve the ``job`` in a file and pass each reported frame to ``sink``; ``kept`` names what remains of them."""
        if self.process is None:
            self.process = self.stack.enter_context(running(command("-m", _WORKER, "-"), None, fed=True))
        try:
            with self.process.limited(time_limit):
                outcome = _followed(self.process, job, sink, kept)
        except BaseException:  # later reports on this job must not reach the next
            self.process.end()
            self.process = None
            raise
        if self.process.overran is not None or outcome.status == "crashed":
            self.process = None
        return outcome


_WORKER = "fem_reference.solvers.fenicsx.worker"


def _followed(process: Process, job: Path, sink: Callable[[dict[str, Any]], None], kept: str) -> Outcome:
    """The outcome of the ``job`` in ``process``."""
    process.feed(str(job))
    count = 0
    for event in process.events():
        if "frame" not in event:
            return Outcome(event["status"], event["message"], event["cost"])
        sink(event)
        count += 1
    return process.ending(f"{count} {kept} are kept")


def _state(event: dict[str, Any]) -> Frame:
    path = Path(event["file"])
    with np.load(path, allow_pickle=False) as arrays:
        forces, moments = (
            {name.removeprefix(kind): arrays[name] for name in arrays if name.startswith(kind)}
            for kind in ("force ", "moment ")
        )
        state = Frame(
            event["frame"],
            points=arrays["nodes"],
            scalars=event["scalars"],
            state=stored_state(arrays),
            forces=forces,
            moments=moments,
            residuals=tuple(event["residuals"]),
        )
    path.unlink()
    return state


@contextmanager
def session() -> Iterator[Session]:
    """A session, whose process ends with it. MissingSoftware where FEniCSx is not installed."""
    require_installed()
    with scratch.folder() as folder, ExitStack() as stack:
        own = Session(folder, stack)
        try:
            yield own
        finally:
            own.closed = True


@contextmanager
def _opened() -> Iterator[Session]:
    """The shared session, or else a new one."""
    if (shared_now := present()) is not None:
        yield shared_now
    else:
        with session() as own:
            yield own


def solve_on(body: Body, settings: BodySettings, sink: Sink) -> Outcome:
    """Pass the frames of ``body`` to ``sink``, by the shared session or by a new one."""
    with _opened() as solver:
        return solver.follow(body, settings, sink)


def solve_body(body: Body, settings: BodySettings) -> Run:
    """The run of ``body``, in memory, by the shared session or by a new one."""
    with _opened() as solver:
        return solver.solve(body, settings)


_shared: ContextVar[Session | None] = ContextVar("shared", default=None)


@contextmanager
def shared() -> Iterator[None]:
    """Meanwhile all solutions on one rank run in one process, which reuses what it has loaded and compiled; an already shared
    process remains in use. Without FEniCSx nothing is solved and nothing shared.
    """
    with session() if installed() and present() is None else nullcontext(present()) as own:
        before = _shared.set(own)
        try:
            yield
        finally:
            _shared.reset(before)


def present() -> Session | None:
    """The shared session, None where there is none."""
    return _shared.get()
