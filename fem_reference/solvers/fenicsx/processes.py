"""The worker processes of FEniCSx: installation check, a running process, its events and its outcome."""

import importlib.util
import json
import re
import signal
import subprocess
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from typing import Any

from fem_reference.foundations.errors import MissingSoftware
from fem_reference.foundations.subprocesses import environment
from fem_reference.foundations.usage import processor_times
from fem_reference.runs.contents import Status
from fem_reference.runs.store import Outcome

# One thread a rank. Open MPI, where it is used, refuses root and more ranks than cores unless set otherwise.
_SETTINGS = {
    "OMP_NUM_THREADS": "1",
    "PYTHONUNBUFFERED": "1",
    "OMPI_ALLOW_RUN_AS_ROOT": "1",
    "OMPI_ALLOW_RUN_AS_ROOT_CONFIRM": "1",
    "OMPI_MCA_rmaps_base_oversubscribe": "1",
}
PATIENCE = 5.0  # [s] from the request to end a process until it is killed
# Clock time that may pass, as a multiple of a limit of processor time and of the start-up: beyond it the machine is too busy
# for any conclusion.
CLOCK, _START = 20, 3.0  # [s]
_GLANCE = 0.02  # [s]
MARK = "@fem_reference "  # begins each line of the worker's output that is meant for the caller


def installed() -> bool:
    """True where FEniCSx is installed."""
    return any(importlib.util.find_spec(name) for name in ("dolfinx_solver", "dolfinx"))


def require_installed() -> None:
    """Raise MissingSoftware where FEniCSx is not installed."""
    if not installed():
        raise MissingSoftware(
            "FEniCSx is not installed: pip install 'fem_reference[fenicsx]' (Linux x86-64), or conda's fenics-dolfinx"
        )


class Process:
    """A running ``process``; its error output is read continuously."""

    def __init__(self, process: subprocess.Popen[str]) -> None:
        self.process = process
        self.overran: tuple[Status, str] | None = None  # the reason where a time limit ended it
        self.errors: list[str] = []
        self.listener = threading.Thread(target=self._listen)
        self.listener.start()

    def _listen(self) -> None:
        assert self.process.stderr is not None
        self.errors.extend(line for line in self.process.stderr if line.strip())

    def events(self) -> Iterator[dict[str, Any]]:
        """The reported events, until its output ends."""
        assert self.process.stdout is not None
        for line in self.process.stdout:
            if line.startswith(MARK):
                yield json.loads(line.removeprefix(MARK))

    def ending(self, kept: str) -> Outcome:
        """The outcome where it ended without a report; ``kept`` states what remains nevertheless."""
        code = self.process.wait()
        self.listener.join(timeout=5)  # its last lines may still arrive
        if self.overran is not None:
            status, why = self.overran
            return Outcome(status, f"{why}; {kept}")
        return Outcome("crashed", f"the FEniCSx process ended with exit status {code} ({self._reason()}); {kept}")

    def _reason(self) -> str:
        """The most informative line of its error output: the last that names an error, else the last."""
        named = [line for line in self.errors if re.match(r"\w*(\.\w+)*(Error|Exception)\b", line)]
        return (named or self.errors or ["without a word"])[-1].strip()

    def feed(self, line: str) -> None:
        """Write a line to its standard input; a dead process does not read it, and its exit status shows that."""
        assert self.process.stdin is not None
        with suppress(BrokenPipeError):
            self.process.stdin.write(f"{line}\n")
            self.process.stdin.flush()

    @contextmanager
    def limited(self, time_limit: float | None) -> Iterator[None]:
        """End it where one of its processes meanwhile takes more than ``time_limit`` [s] of processor time, independent of other
        load on the machine. ``CLOCK`` times that by the clock ends it too, without a conclusion about the work.
        """
        if time_limit is None:
            yield
            return
        done = threading.Event()
        watching = threading.Thread(target=self._watch, args=(time_limit, done), daemon=True)
        watching.start()
        try:
            yield
        finally:
            done.set()
            watching.join()  # if it has begun to end the process, that is over after this

    def _watch(self, time_limit: float, done: threading.Event) -> None:
        begin, before = time.monotonic(), processor_times(self.process.pid)
        longest = CLOCK * (_START + time_limit)
        while True:
            passed = time.monotonic() - begin
            now = processor_times(self.process.pid) if before else {0: passed}
            used = max((seconds - before.get(number, 0.0) for number, seconds in now.items()), default=0.0)
            if used >= time_limit:
                self.overran = "timed out", f"stopped after {time_limit:g} s of processor time, the time limit"
                break
            if passed >= longest:
                self.overran = "stalled", _stalled(passed, used, time_limit)
                break
            if done.wait(max(min(time_limit - used, longest - passed), _GLANCE)):
                return
        self.end()

    def end(self) -> None:
        """End it: ask repeatedly, as mpiexec ignores a signal before its own processes start; kill it in the end."""
        asked = time.monotonic()
        while self.process.poll() is None:
            patient = time.monotonic() - asked < PATIENCE
            self.process.send_signal(signal.SIGTERM if patient else signal.SIGKILL)
            with suppress(subprocess.TimeoutExpired):
                self.process.wait(timeout=0.5)


def _stalled(passed: float, used: float, time_limit: float) -> str:
    return (
        f"stopped after {passed:.3g} s in which it had {used:.3g} s of processor time, of the {time_limit:g} s that it may take: "
        "the machine was busy, or something waited; that says nothing of what was solved"
    )


@contextmanager
def running(command_line: list[str], time_limit: float | None, *, fed: bool = False) -> Iterator[Process]:
    """The process that ``command_line`` starts, ended on exit. A ``fed`` process reads lines from the caller until then."""
    process = subprocess.Popen(
        command_line,
        stdin=subprocess.PIPE if fed else subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        errors="replace",
        env=environment(**_SETTINGS),
    )
    started = Process(process)
    try:
        with started.limited(time_limit):
            yield started
            if process.stdin is not None:
                with suppress(BrokenPipeError):
                    process.stdin.close()
            process.wait()
    finally:
        started.end()
        started.listener.join()
        for stream in (process.stdin, process.stdout, process.stderr):
            if stream is not None:
                stream.close()
