"""The worker processes of FEniCSx: whether there can be any, one that runs, what it reports, and how it ended."""

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
from fem_reference.runs.store import Outcome

# One thread a rank. Open MPI, where it is used, refuses root and more ranks than cores unless set otherwise.
_SETTINGS = {
    "OMP_NUM_THREADS": "1",
    "PYTHONUNBUFFERED": "1",
    "OMPI_ALLOW_RUN_AS_ROOT": "1",
    "OMPI_ALLOW_RUN_AS_ROOT_CONFIRM": "1",
    "OMPI_MCA_rmaps_base_oversubscribe": "1",
}
_PATIENCE = 5.0  # [s] until a process that was asked to end is killed
MARK = "@fem_reference "  # begins each line of the worker's output that is meant for us


def installed() -> bool:
    """Whether FEniCSx is."""
    return any(importlib.util.find_spec(name) for name in ("dolfinx_solver", "dolfinx"))


def require_installed() -> None:
    """MissingSoftware where FEniCSx is not installed."""
    if not installed():
        raise MissingSoftware(
            "FEniCSx is not installed: pip install 'fem_reference[fenicsx]' (Linux x86-64), or conda's fenics-dolfinx"
        )


class Process:
    """A running ``process``, whose error output is read as it comes."""

    def __init__(self, process: subprocess.Popen[str]) -> None:
        self.process = process
        self.overran: float | None = None  # the time limit [s] that ended it
        self.errors: list[str] = []
        self.listener = threading.Thread(target=self._listen)
        self.listener.start()

    def _listen(self) -> None:
        assert self.process.stderr is not None
        self.errors.extend(line for line in self.process.stderr if line.strip())

    def events(self) -> Iterator[dict[str, Any]]:
        """What it reports, until its output ends."""
        assert self.process.stdout is not None
        for line in self.process.stdout:
            if line.startswith(MARK):
                yield json.loads(line.removeprefix(MARK))

    def ending(self, kept: str) -> Outcome:
        """How it ended without a report; ``kept`` says what there is all the same."""
        code = self.process.wait()
        self.listener.join(timeout=5)  # its last lines may still arrive
        if self.overran is not None:
            return Outcome("timed out", f"stopped after {self.overran:g} s, the time limit; {kept}")
        return Outcome("crashed", f"the FEniCSx process ended with exit status {code} ({self._reason()}); {kept}")

    def _reason(self) -> str:
        """The line of its error output that says most: the last that names an error, else the last."""
        named = [line for line in self.errors if re.match(r"\w*(\.\w+)*(Error|Exception)\b", line)]
        return (named or self.errors or ["without a word"])[-1].strip()

    def feed(self, line: str) -> None:
        """Write a line to its standard input; one that died does not read it, which its exit shows."""
        assert self.process.stdin is not None
        with suppress(BrokenPipeError):
            self.process.stdin.write(f"{line}\n")
            self.process.stdin.flush()

    @contextmanager
    def limited(self, time_limit: float | None) -> Iterator[None]:
        """End it where what is done meanwhile takes longer than ``time_limit`` [s]."""
        seconds = threading.TIMEOUT_MAX if time_limit is None else time_limit
        timer = threading.Timer(seconds, self._overrun, [seconds])
        timer.daemon = True
        timer.start()
        try:
            yield
        finally:
            timer.cancel()
            timer.join()  # where it has begun to end the process, that is over after this

    def _overrun(self, time_limit: float) -> None:
        self.overran = time_limit
        self.end()

    def end(self) -> None:
        """End it: ask again and again, as mpiexec ignores a signal that comes before its own processes; at last kill it."""
        asked = time.monotonic()
        while self.process.poll() is None:
            patient = time.monotonic() - asked < _PATIENCE
            self.process.send_signal(signal.SIGTERM if patient else signal.SIGKILL)
            with suppress(subprocess.TimeoutExpired):
                self.process.wait(timeout=0.5)


@contextmanager
def running(command_line: list[str], time_limit: float | None, *, fed: bool = False) -> Iterator[Process]:
    """The process that ``command_line`` starts; it has ended when this does. One that is ``fed`` reads lines from us until then."""
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
