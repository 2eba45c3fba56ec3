"""Python subprocesses: starting and ending them, measuring their use of resources, and sharing folders with them.

Subprocesses import this copy of the package, and nothing from the folder in which they are started.
"""

import math
import os
import resource
import shutil
import sys
import tempfile
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import NamedTuple, Self

from filelock import FileLock, Timeout

_STARTER = "FEM_REFERENCE_STARTER"
_ROOT = Path(__file__).resolve().parent.parent.parent
_PREFIX, _LOCK = "fem_reference_scratch-", ".lock"
# The age [s] above which a folder that nobody has locked is considered abandoned. A younger one may be about to be locked.
_SETTLED = 60.0


def command(*words: str) -> list[str]:
    """Command line that starts Python, ignoring modules in the working directory, with the arguments ``words``."""
    return [sys.executable, "-P", *words]


def environment(**settings: str) -> dict[str, str]:
    """Environment of this process with this copy of the package first on the import path, and with the additional ``settings``."""
    theirs = [str(Path(path).absolute()) for path in os.environ.get("PYTHONPATH", "").split(os.pathsep) if path]
    paths = [str(_ROOT), *theirs]
    return {**os.environ, "PYTHONPATH": os.pathsep.join(paths), _STARTER: str(os.getpid()), **settings}


def end_with_starter() -> None:
    """End this process at most about two seconds after its starter (direct or indirect) ends, even if the starter is killed."""
    starter = os.environ.get(_STARTER)
    if starter is not None:
        threading.Thread(target=_watch, args=(int(starter),), daemon=True).start()


def _watch(process: int) -> None:
    while lives(process):
        time.sleep(1.0)
    os._exit(1)


def lives(process: int) -> bool:
    """True if a process is running; False for a zombie."""
    try:
        os.kill(process, 0)
        return Path(f"/proc/{process}/stat").read_text(encoding="utf-8").rpartition(")")[2].split()[0] != "Z"
    except ProcessLookupError:
        return False
    except (OSError, IndexError):  # the process belongs to another user, or there is no /proc
        return True


def forget_peak_memory() -> None:
    """Restart the measurement of the peak memory of this process, if the system supports this (Linux)."""
    with suppress(OSError):
        Path("/proc/self/clear_refs").write_text("5", encoding="utf-8")


def processor_times(process: int, *, of_ended: bool = False) -> dict[int, float]:
    """Processor times [s] of a ``process`` and its running descendants, by process number; empty if the system does not report
    times. With ``of_ended``, the time of a process includes the times of ended subprocesses for which it has waited.
    """
    parents, times = dict[int, int](), dict[int, float]()
    for folder in Path("/proc").glob("[0-9]*"):
        with suppress(OSError, ValueError, IndexError):  # the process may end meanwhile
            fields = (folder / "stat").read_bytes().rpartition(b")")[2].split()
            number = int(folder.name)
            parents[number] = int(fields[1])
            times[number] = sum(map(int, fields[11 : 15 if of_ended else 13])) / os.sysconf("SC_CLK_TCK")
    found, size = {process} & set(times), 0
    while len(found) > size:
        size = len(found)
        found |= {number for number, parent in parents.items() if parent in found}
    return {number: times[number] for number in found}


class MachineTime(NamedTuple):
    """Readings of clocks at one moment: the clock time ``seconds`` [s], the processor time ``ours`` [s] of this process and its
    descendants, and the processor time ``all`` [s] of all processes on the machine, NaN if the system does not report it.
    """

    seconds: float
    ours: float
    all: float

    @classmethod
    def now(cls) -> Self:
        """Read the clocks."""
        busy = math.nan
        with suppress(OSError, ValueError):
            user, nice, system, _, _, *interrupts = map(
                int, Path("/proc/stat").read_text().splitlines()[0].split()[1:9]
            )
            busy = (user + nice + system + sum(interrupts)) / os.sysconf("SC_CLK_TCK")
        return cls(time.perf_counter(), sum(processor_times(os.getpid(), of_ended=True).values()), busy)

    def load(self) -> float | None:
        """Fraction of the machine that other processes have used since this moment; None if the system does not report it."""
        now = MachineTime.now()
        capacity = (now.seconds - self.seconds) * (os.cpu_count() or 1)
        share = (now.all - self.all - (now.ours - self.ours)) / capacity if capacity > 0 else math.nan
        return None if math.isnan(share) else min(max(share, 0.0), 1.0)


def spent_since(before: MachineTime) -> dict[str, str]:
    """Processor time of this process and its descendants since ``before``, and load by others, as provenance of clock times."""
    ours, load = MachineTime.now().ours - before.ours, before.load()
    found = {"processor time": f"{ours:.1f} s"}
    return found if load is None else found | {"load by other processes": f"{100 * load:.0f} % of the machine"}


def peak_memory(process: int | None = None) -> float:
    """Peak memory [MB] since :func:`forget_peak_memory` or the start, of this or another ``process`` (0 if unavailable)."""
    with suppress(OSError, StopIteration):
        lines = Path(f"/proc/{process or 'self'}/status").read_text(encoding="utf-8").splitlines()
        return next(float(line.split()[1]) / 1024 for line in lines if line.startswith("VmHWM"))
    return 0.0 if process else resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024


@contextmanager
def scratch_folder() -> Iterator[Path]:
    """Context with a new folder in the system's temporary folder, which is locked until it is removed or this process ends."""
    _clear(Path(tempfile.gettempdir()))
    with tempfile.TemporaryDirectory(prefix=_PREFIX, ignore_cleanup_errors=True) as name, FileLock(Path(name) / _LOCK):
        yield Path(name)


def _clear(root: Path) -> None:
    """Remove folders that killed processes have left behind; folders that cannot be removed remain."""
    for path in root.glob(f"{_PREFIX}*"):
        with suppress(OSError, Timeout):
            if time.time() - path.stat().st_mtime > _SETTLED and (path / _LOCK).is_file():
                with FileLock(path / _LOCK).acquire(timeout=0):
                    shutil.rmtree(path)
