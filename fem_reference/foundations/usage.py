"""What this process uses: the most memory since it was last reset, and its processor time."""

import resource
from contextlib import suppress
from pathlib import Path


def forget_peak_memory() -> None:
    """Watch the memory of this process anew, which may have been larger before; Linux can."""
    with suppress(OSError):
        Path("/proc/self/clear_refs").write_text("5", encoding="utf-8")


def peak_memory() -> float:
    """The most memory [MB] since then, or since this process began."""
    with suppress(OSError, StopIteration):
        lines = Path("/proc/self/status").read_text(encoding="utf-8").splitlines()
        return next(float(line.split()[1]) / 1024 for line in lines if line.startswith("VmHWM"))
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
