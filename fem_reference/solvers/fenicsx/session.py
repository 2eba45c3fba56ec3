"""One process of FEniCSx that solves bodies one after the other: what it has compiled and loaded serves the next."""

import pickle
import tempfile
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import Any

import numpy as np

from fem_reference.children import command
from fem_reference.continuum import Continuum, Reached, Solved, check
from fem_reference.runs import Outcome
from fem_reference.solvers.fenicsx.jobs import Job, stored_state
from fem_reference.solvers.fenicsx.processes import Process, require_installed, running
from fem_reference.solvers.fenicsx.settings import BodySettings


class Session:
    """Solves bodies in a process of its own, which is started anew after it died."""

    def __init__(self, folder: Path, stack: ExitStack) -> None:
        """``folder``: where jobs and states are passed; ``stack`` ends the processes."""
        self.folder, self.stack = folder, stack
        self.process: Process | None = None
        self.closed = False

    def solve(self, body: Continuum, settings: BodySettings) -> Solved:
        """The states of ``body``; a process that dies is the status *crashed*, and one that takes longer than the time limit is
        ended and *timed out*, not an exception. RuntimeError once it is closed.
        """
        if self.closed:
            raise RuntimeError("the session is closed")
        check(body, settings.element)
        job = self.folder / "job.pickle"
        job.write_bytes(pickle.dumps(Job(body, settings, {})))
        if self.process is None:
            self.process = self.stack.enter_context(running(command("-m", _WORKER, "-"), None, fed=True))
        with self.process.limited(settings.time_limit):
            solved = _solved(self.process, job)
        if self.process.overran is not None or solved.outcome.status == "crashed":
            self.process = None
        return solved


_WORKER = "fem_reference.solvers.fenicsx.worker"


def _solved(process: Process, job: Path) -> Solved:
    """What ``process`` makes of the ``job``."""
    process.feed(str(job))
    states: list[Reached] = []
    for event in process.events():
        if "frame" not in event:
            return Solved(tuple(states), Outcome(event["status"], event["message"], event["cost"]))
        states.append(_state(event))
    return Solved(tuple(states), process.ending(f"{len(states)} states are kept"))


def _state(event: dict[str, Any]) -> Reached:
    path = Path(event["file"])
    with np.load(path) as arrays:
        forces, moments = (
            {name.removeprefix(kind): arrays[name] for name in arrays if name.startswith(kind)}
            for kind in ("force ", "moment ")
        )
        state = Reached(event["frame"], arrays["nodes"], forces, moments, event["scalars"], stored_state(arrays))
    path.unlink()
    return state


@contextmanager
def session() -> Iterator[Session]:
    """A session; its process ends with it. MissingSoftware where FEniCSx is not installed."""
    require_installed()
    with tempfile.TemporaryDirectory(prefix="fem_reference-") as folder, ExitStack() as stack:
        own = Session(Path(folder), stack)
        try:
            yield own
        finally:
            own.closed = True


def solve_body(body: Continuum, settings: BodySettings) -> Solved:
    """The states of ``body`` by a session of its own."""
    with session() as own:
        return own.solve(body, settings)
