"""Resources that processes use: memory since it was last reset, and processor time of those that this one started."""

import os
import resource
from contextlib import suppress
from pathlib import Path


def forget_peak_memory() -> None:
    """Watch the memory of this process anew, which may have been larger before; Linux can."""
    with suppress(OSError):
        Path("/proc/self/clear_refs").write_text("5", encoding="utf-8")


def processor_times(process: int) -> dict[int, float]:
    """The processor time [s] by number of a ``process`` and of each that descends from it and has not ended; nothing where the
    system does not say.
    """
    parents, times = dict[int, int](), dict[int, float]()
    for path in Path("/proc").glob("[0-9]*/stat"):
        with suppress(OSError, ValueError, IndexError):  # it may end meanwhile
            fields = path.read_text(encoding="utf-8", errors="replace").rpartition(")")[2].split()
            number = int(path.parent.name)
            parents[number] = int(fields[1])
            times[number] = (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")
    found, size = {process} & set(times), 0
    while len(found) > size:
        size = len(found)
        found |= {number for number, parent in parents.items() if parent in found}
    return {number: times[number] for number in found}


def peak_memory() -> float:
    """The most memory [MB] since then, or since this process began."""
    with suppress(OSError, StopIteration):
        lines = Path("/proc/self/status").read_text(encoding="utf-8").splitlines()
        return next(float(line.split()[1]) / 1024 for line in lines if line.startswith("VmHWM"))
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
