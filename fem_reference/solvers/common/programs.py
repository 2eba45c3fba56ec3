"""Other people's programs as subprocesses: measured time and memory, a time limit, and cleanup of all processes they start."""

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

# The limit on clock time divided by the limit on processor time. A program that takes longer is waiting, or the machine is busy.
CLOCK = 10
# The time between two checks of a program: a fraction of the clock time so far, between a minimum and a maximum [s].
_SHARE, _GLANCES = 0.05, (0.05, 1.0)
_TAIL = 4096  # the number of bytes that are read at the end of a program's output


@dataclass(frozen=True)
class Ended:
    """The end of a program.

    ``code``: the exit status; if negative, the signal. ``seconds``: the clock time. ``processor``: the processor time [s],
    including that of processes for which the program waited. ``memory`` [MB]: the highest peak memory of any of its processes.
    ``said``: the last line that was printed. ``limit``: the status and the reason if a limit ended the program, otherwise None.
    """

    code: int
    seconds: float
    processor: float
    memory: float
    said: str
    limit: tuple[Status, str] | None = None


def found(word: str, directory: Path) -> Path | None:
    """The executable file of a program: relative to ``directory`` if ``word`` contains a slash, otherwise on the PATH.

    None if there is no such file.
    """
    path = shutil.which(str(directory / word) if os.sep in word else word)
    return None if path is None else Path(path)


def modules(folder: Path) -> set[Path]:
    """The Python files in a ``folder`` and its subfolders, except in caches, hidden folders and virtual environments."""
    found = set[Path]()
    for place, folders, names in folder.walk():
        inner = [name for name in folders if name != "__pycache__" and not name.startswith(".")]
        folders[:] = [name for name in inner if not (place / name / "pyvenv.cfg").exists()]
        found |= {path for name in names if (path := place / name).suffix == ".py" and path.is_file()}
    return found


def run(words: list[str], directory: Path, time_limit: float) -> Ended:
    """Run a program in ``directory``, without a shell and without input, and wait for its end. No process outlives the call.

    ``words``: the program and its arguments. ``time_limit`` [s]: the limit on processor time; the limit on clock time is ``CLOCK``
    times as long. Raises OSError if the program does not start.
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
    """A context with the process, which has a new session. All processes of this session are killed at the end of the context."""
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
    """Kill a running ``process`` and all of its descendants, including those in other sessions."""
    for number in processor_times(process) or (process,):
        with suppress(ProcessLookupError):
            os.kill(number, signal.SIGKILL)


class _Watch:
    """A thread that kills a ``process`` after ``limit`` [s] of processor time, or after ``CLOCK`` times as much clock time.

    ``overran``: the status and the reason if it was killed, otherwise None. ``memory`` [MB]: the highest peak memory of any of its
    processes. (The peak from ``os.wait4`` is not used, as it includes the memory of the process that starts the program.)
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
                why = f"it was waiting, or the machine was busy: {used:.3g} s of processor time in {passed:.3g} s"
                self.overran = "stalled", why
            if self.overran is not None:
                _kill(self.process)
                return


def _last_line(printed: IO[bytes]) -> str:
    """The last line that the program ``printed``; empty if there is none."""
    size = printed.seek(0, os.SEEK_END)
    printed.seek(max(0, size - _TAIL))
    lines = [line for line in printed.read().decode(errors="replace").splitlines() if line.strip()]
    return lines[-1].strip()[-300:] if lines else ""
