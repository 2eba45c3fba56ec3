"""Small C files, compiled once for the processor of this machine and stored."""

import hashlib
import os
import platform
import subprocess
import sysconfig
import tempfile
from collections.abc import Sequence
from ctypes import CDLL
from functools import cache
from pathlib import Path


@cache
def machine() -> str:
    """Hash of the type of this processor: code compiled for one type may not run on another."""
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
        known = next(line for line in lines if line.startswith(("flags", "Features")))
    except (OSError, StopIteration):
        known = platform.processor()
    return hashlib.sha256(f"{platform.machine()} {known}".encode()).hexdigest()[:12]


def library(source: Path, flags: Sequence[str], folder: Path) -> CDLL:
    """Load the functions of a C file, which is compiled with ``flags`` unless ``folder`` already contains the result.

    Raises OSError without a compiler or a usable folder, and RuntimeError with the compiler's message if the compiler fails.
    """
    compiler = (os.environ.get("CC") or sysconfig.get_config_var("CC") or "cc").split()
    key = hashlib.sha256("\n".join([source.read_text(encoding="utf-8"), *compiler, *flags, machine()]).encode())
    kept = folder / f"fem_reference_{source.stem}_{key.hexdigest()[:16]}.so"
    if not kept.exists():
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryDirectory(dir=folder) as new:
            made = Path(new) / kept.name
            command = [*compiler, *flags, "-std=gnu11", "-shared", "-fPIC", str(source), "-o", str(made), "-lm"]
            done = subprocess.run(command, capture_output=True, text=True, check=False)
            if done.returncode:
                raise RuntimeError(f"{command[0]} cannot compile {source}: {done.stderr.strip()}")
            made.replace(kept)  # atomic, so that several processes may compile the file at the same time
    return CDLL(str(kept))
