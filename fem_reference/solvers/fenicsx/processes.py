"""The worker processes of FEniCSx: whether there can be any, one that runs, what it reports, and how it ended."""

import importlib.util
import json
import re
import subprocess
import threading
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from typing import Any

from fem_reference.children import environment
from fem_reference.errors import MissingSoftware
from fem_reference.runs import Outcome

# One thread a rank. Open MPI, where it is used, refuses root and more ranks than cores unless told otherwise.
_SETTINGS = {
    "OMP_NUM_THREADS": "1",
    "PYTHONUNBUFFERED": "1",
    "OMPI_ALLOW_RUN_AS_ROOT": "1",
    "OMPI_ALLOW_RUN_AS_ROOT_CONFIRM": "1",
    "OMPI_MCA_rmaps_base_oversubscribe": "1",
}
MARK = "@fem_reference "  # begins each line of the worker's output that is meant for us


def require_installed() -> None:
    """MissingSoftware where FEniCSx is not installed."""
    if not any(importlib.util.find_spec(name) for name in ("dolfinx_solver", "dolfinx")):
        raise MissingSoftware(
            "FEniCSx is not installed: pip install 'fem_reference[fenicsx]' (Linux x86-64), or conda's fenics-dolfinx"
        )


@dataclass(frozen=True, eq=False)
class Worker:
    """A running ``process``; ``timed_out`` is set when the ``time_limit`` [s] ended it, ``errors`` are the lines of its error
    output so far, which the ``listener`` reads.
    """

    process: subprocess.Popen[str]
    time_limit: float | None
    errors: list[str]
    listener: threading.Thread
    timed_out: threading.Event = field(default_factory=threading.Event)

    def events(self) -> Iterator[dict[str, Any]]:
        """What it reports, until its output ends."""
        assert self.process.stdout is not None
        for line in self.process.stdout:
            if line.startswith(MARK):
                yield json.loads(line.removeprefix(MARK))

    def ending(self, kept: str) -> Outcome:
        """How it ended without a report; ``kept`` says what there is all the same."""
        code = self.process.wait()
        self.listener.join(timeout=5)  # its last words may still be under way
        if self.timed_out.is_set():
            return Outcome("timed out", f"stopped after {self.time_limit:.0f} s, the time limit; {kept}")
        return Outcome("crashed", f"the FEniCSx process ended with exit status {code} ({self._reason()}); {kept}")

    def _reason(self) -> str:
        """The line of its error output that tells most: the last that names an error, else the last."""
        named = [line for line in self.errors if re.match(r"\w*(\.\w+)*(Error|Exception)\b", line)]
        return (named or self.errors or ["without a word"])[-1].strip()

    def feed(self, line: str) -> None:
        """Write a line to its standard input; one that died does not read it, which its ending tells."""
        assert self.process.stdin is not None
        with suppress(BrokenPipeError):
            self.process.stdin.write(f"{line}\n")
            self.process.stdin.flush()

    def stop(self) -> None:
        """End it for the time limit: mpiexec ignores a signal that comes before its own processes."""
        self.timed_out.set()
        while self.process.poll() is None:
            self.process.terminate()
            with suppress(subprocess.TimeoutExpired):
                self.process.wait(timeout=0.5)


@contextmanager
def running(command_line: list[str], time_limit: float | None, *, fed: bool = False) -> Iterator[Worker]:
    """The worker that ``command_line`` starts; it has ended when this does. One that is ``fed`` reads lines from us until then."""
    process = subprocess.Popen(
        command_line,
        stdin=subprocess.PIPE if fed else subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        errors="replace",
        env=environment(**_SETTINGS),
    )
    assert process.stderr is not None
    errors: list[str] = []
    listener = threading.Thread(
        target=lambda stream: errors.extend(line for line in stream if line.strip()), args=[process.stderr]
    )
    worker = Worker(process, time_limit, errors, listener)
    listener.start()
    timer = threading.Timer(time_limit or threading.TIMEOUT_MAX, worker.stop)
    timer.daemon = True
    timer.start()
    try:
        yield worker
        if process.stdin is not None:
            with suppress(BrokenPipeError):
                process.stdin.close()
        process.wait()
    finally:
        timer.cancel()
        if process.poll() is None:
            process.terminate()
            process.wait()
        listener.join()
        for stream in (process.stdin, process.stdout, process.stderr):
            if stream is not None:
                stream.close()
