"""The worker processes of FEniCSx: installation check, command line, and a running process with its reports and time limits."""

import importlib.util
import os
import pickle
import re
import shutil
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from fem_reference.foundations.errors import InputError, MissingSoftware
from fem_reference.foundations.subprocesses import command, environment, processor_times
from fem_reference.runs.contents import Status
from fem_reference.runs.store import Frame, Outcome, Sink

# One thread per rank. Unless these variables are set, Open MPI, if used, refuses to run as root or with more ranks than cores.
_SETTINGS = {
    "OMP_NUM_THREADS": "1",
    "PYTHONUNBUFFERED": "1",
    "OMPI_ALLOW_RUN_AS_ROOT": "1",
    "OMPI_ALLOW_RUN_AS_ROOT_CONFIRM": "1",
    "OMPI_MCA_rmaps_base_oversubscribe": "1",
}
# The number of ranks that is accepted on any machine; more ranks need a machine with as many cores.
_MOST_RANKS = 8
PATIENCE = 5.0  # [s] from the request to end a process to the signal that kills it
# The allowed clock time as a multiple of time limit plus start-up time, and the start-up time; a longer run is inconclusive.
CLOCK, _START = 20, 3.0  # [s]
_GLANCE = 0.02  # [s] between checks of the processor time
MARK = "@fem_reference "  # begins each line of output that names the file of a pickled frame or outcome


def installed() -> bool:
    """True if FEniCSx is installed."""
    return any(importlib.util.find_spec(name) for name in ("dolfinx_solver", "dolfinx"))


def require_installed() -> None:
    """Raise MissingSoftware if FEniCSx is not installed."""
    if not installed():
        way = "pip install 'fem_reference[fenicsx]' (Linux x86-64), or conda's fenics-dolfinx"
        raise MissingSoftware(f"FEniCSx is not installed: {way}")


def mpiexec() -> str | None:
    """The wheel's own ``mpiexec`` next to the interpreter, otherwise one on the PATH, perhaps of another MPI; None if missing."""
    beside = Path(sys.executable).with_name("mpiexec")
    return str(beside) if beside.exists() else shutil.which("mpiexec")


def command_line(ranks: int) -> list[str]:
    """The worker's command line. Raises InputError for more ranks than the machine allows, MissingSoftware without ``mpiexec``."""
    # mpi4py's own runner ends all ranks after an error on one; without it the other ranks would wait forever.
    worker, runner = command("-m", "mpi4py", "-m", f"{__package__}.worker"), mpiexec()
    if ranks == 1:
        return worker
    if ranks > (most := max(_MOST_RANKS, os.cpu_count() or 1)):
        raise InputError("ranks", ranks, f"at most {most} on this machine")
    if runner is None:
        raise MissingSoftware(f"{ranks} ranks need mpiexec, which is neither next to {sys.executable} nor on the PATH")
    return [runner, "-n", str(ranks), *worker]


class Process:
    """A process that runs the command ``words``. It reads names of job files, one per line; error output is read continuously."""

    def __init__(self, words: list[str]) -> None:
        pipe = subprocess.PIPE
        self.process = subprocess.Popen(
            words, stdin=pipe, stdout=pipe, stderr=pipe, text=True, errors="replace", env=environment(**_SETTINGS)
        )
        streams = self.process.stdin, self.process.stdout, self.process.stderr
        self.input, self.output, self.error_output = (stream for stream in streams if stream)  # each is a pipe
        self.overran: tuple[Status, str] | None = None  # the reason if a time limit ended it
        self.errors: list[str] = []
        said = (line for line in self.error_output if line.strip())
        self.listener = threading.Thread(target=self.errors.extend, args=(said,))
        self.listener.start()

    def solve(self, job: Path, time_limit: float | None, sink: Sink) -> Outcome:
        """Solve the job in a file and pass each frame to ``sink``. If the process dies, the outcome is *crashed*. If it exceeds the
        time limit, it is ended, and the outcome is *timed out* or *stalled*.
        """
        kept = "no frame was reached"
        with self._limited(time_limit):
            with suppress(BrokenPipeError):  # a dead process reads nothing; its exit status is checked below
                self.input.write(f"{job}\n")
                self.input.flush()
            for line in self.output:
                if not line.startswith(MARK):
                    continue
                path = Path(line.removeprefix(MARK).rstrip("\n"))
                report: Frame | Outcome = pickle.loads(path.read_bytes())
                path.unlink()
                if isinstance(report, Outcome):
                    return report
                sink(report)
                kept = f"frames up to {report.number:g} are kept"
            code = self.process.wait()
        self.listener.join(timeout=5)  # its last lines may still arrive
        if self.overran is not None:
            status, why = self.overran
            return Outcome(status, f"{why}; {kept}")
        return Outcome("crashed", f"the FEniCSx process ended with exit status {code} ({self._reason()}); {kept}")

    def _reason(self) -> str:
        """The most informative line of the error output: the last line that names an error, otherwise the last line."""
        named = [line for line in self.errors if re.match(r"\w*(\.\w+)*(Error|Exception)\b", line)]
        return (named or self.errors or ["without a message"])[-1].strip()

    @contextmanager
    def _limited(self, time_limit: float | None) -> Iterator[None]:
        """A context in which the process is ended if it, or a process that it has started, takes more than ``time_limit`` [s] of
        processor time, or about ``CLOCK`` times as much clock time. The latter allows no conclusion.
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
            watching.join()  # if the watch has begun to end the process, it finishes that first

    def _watch(self, time_limit: float, done: threading.Event) -> None:
        begin = time.monotonic()
        now = before = processor_times(self.process.pid)
        longest = CLOCK * (_START + time_limit)
        while self.overran is None:
            passed = time.monotonic() - begin
            used = max((seconds - before.get(number, 0.0) for number, seconds in now.items()), default=0.0)
            if used >= time_limit:
                self.overran = "timed out", f"stopped after {time_limit:g} s of processor time, the time limit"
            elif passed >= longest:
                why = (
                    f"stopped after {passed:.3g} s in which it had {used:.3g} s of processor time, of the {time_limit:g} s that "
                    "it may take: the machine was busy, or a process waited; this allows no conclusion about the solution"
                )
                self.overran = "stalled", why
            elif done.wait(max(min(time_limit - used, longest - passed), _GLANCE)):
                return
            now = processor_times(self.process.pid) if before else {0: time.monotonic() - begin}
        self._stop()

    def _stop(self) -> None:
        """Ask the process repeatedly to end, as mpiexec ignores signals until its own processes have started; finally kill it."""
        asked = time.monotonic()
        while self.process.poll() is None:
            patient = time.monotonic() - asked < PATIENCE
            self.process.send_signal(signal.SIGTERM if patient else signal.SIGKILL)
            with suppress(subprocess.TimeoutExpired):
                self.process.wait(timeout=0.5)

    def finish(self) -> None:
        """Wait until the process ends by itself, as there are no more jobs."""
        with suppress(BrokenPipeError):
            self.input.close()
        self.process.wait()

    def end(self) -> None:
        """End the process immediately."""
        self._stop()
        self.listener.join()
        for stream in (self.input, self.output, self.error_output):
            with suppress(BrokenPipeError):
                stream.close()
