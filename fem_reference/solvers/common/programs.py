"""Programs of other people as subprocesses: their time and memory, a time limit, and the end of every process that they start."""

import os
import shutil
import signal
import subprocess
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryFile
from typing import IO

from fem_reference.foundations.subprocesses import peak_memory, processor_times
from fem_reference.runs.contents import Status

# The ratio of the limit of clock time to the limit of processor time: beyond this the machine is too busy, or the program waits.
CLOCK = 10
# The time between two checks of a program: a fraction of the clock time so far, but within two limits [s].
_SHARE, _GLANCES = 0.05, (0.05, 1.0)
_TAIL = 4096  # the number of bytes that are read from the end of a program's output


@dataclass(frozen=True)
class Ended:
    """The end of a program: its exit status ``code`` (negative: the signal), clock time and processor time [s] including processes
    for which it waited, the peak memory [MB] of the largest process at the last check, the last printed line, and the limit that
    ended it.
    """

    code: int
    seconds: float
    processor: float
    memory: float
    said: str
    limit: tuple[Status, str] | None = None


def found(word: str, directory: Path) -> Path | None:
    """The file of a program called ``word``: in the ``directory`` if the word has a slash, else on the PATH."""
    path = shutil.which(str(directory / word) if os.sep in word else word)
    return None if path is None else Path(path)


def modules(folder: Path) -> set[Path]:
    """The Python files in a ``folder`` and below it, except in caches, hidden folders and virtual environments."""
    found = set[Path]()
    for place, folders, names in folder.walk():
        inner = [name for name in folders if name != "__pycache__" and not name.startswith(".")]
        folders[:] = [name for name in inner if not (place / name / "pyvenv.cfg").exists()]
        found |= {path for name in names if (path := place / name).suffix == ".py" and path.is_file()}
    return found


def run(words: list[str], directory: Path, time_limit: float) -> Ended:
    """Run a program in a ``directory`` to its end, without a shell and without input; none of its processes outlives the call.

    More than ``time_limit`` [s] of processor time, or ``CLOCK`` times as much elapsed time, ends it. OSError if it does not start.
    """
    with TemporaryFile() as printed:
        begin = time.perf_counter()
        with _started(words, directory, printed) as process:
            watch = _Watch(process.pid, time_limit)
            try:
                _, status, used = os.wait4(process.pid, 0)
            finally:
                watch.done.set()
        process.returncode = os.waitstatus_to_exitcode(status)
        seconds, processor = time.perf_counter() - begin, used.ru_utime + used.ru_stime
        return Ended(process.returncode, seconds, processor, watch.memory, _last_line(printed), watch.overran)


@contextmanager
def _started(words: list[str], directory: Path, printed: IO[bytes]) -> Iterator[subprocess.Popen[bytes]]:
    """A context with the process, in its own session; at the end of the context all processes of this session are killed."""
    process = subprocess.Popen(
        words, cwd=directory, stdin=subprocess.DEVNULL, stdout=printed, stderr=printed, start_new_session=True
    )
    try:
        yield process
    except BaseException:  # the process still runs: a caller's limit or an interruption ended the wait
        _kill(process.pid)
        process.wait()
        raise
    finally:
        with suppress(ProcessLookupError):
            os.killpg(process.pid, signal.SIGKILL)


def _kill(process: int) -> None:
    """Kill a running process and all its descendants, including those in other sessions."""
    for number in processor_times(process) or (process,):
        with suppress(ProcessLookupError):
            os.kill(number, signal.SIGKILL)


class _Watch:
    """A thread that kills a ``process`` that takes more than ``limit`` [s]; ``overran``: the reason, if it was killed; ``memory``
    [MB]: the maximum peak of its processes (the peak in ``os.wait4`` includes the memory of the process that starts them).
    """

    def __init__(self, process: int, limit: float) -> None:
        self.process, self.limit, self.memory = process, limit, 0.0
        self.overran: tuple[Status, str] | None = None
        self.done = threading.Event()
        threading.Thread(target=self._look, daemon=True).start()

    def _look(self) -> None:
        begin, passed = time.monotonic(), 0.0
        while not self.done.wait(min(max(_GLANCES[0], _SHARE * passed), _GLANCES[1])):
            times = processor_times(self.process, of_ended=True)
            used, passed = sum(times.values()), time.monotonic() - begin
            self.memory = max(self.memory, *map(peak_memory, times), 0.0)
            if used >= self.limit:
                self.overran = "timed out", f"ended after {self.limit:g} s of processor time, the time limit"
            elif passed >= CLOCK * self.limit:
                why = f"it waited, or the machine was busy: {used:.3g} s of processor time in {passed:.3g} s"
                self.overran = "stalled", why
            if self.overran is not None:
                _kill(self.process)
                return


def _last_line(printed: IO[bytes]) -> str:
    """The last line that was printed; empty if there is none."""
    size = printed.seek(0, os.SEEK_END)
    printed.seek(max(0, size - _TAIL))
    lines = [line for line in printed.read().decode(errors="replace").splitlines() if line.strip()]
    return lines[-1].strip()[-300:] if lines else ""
