"""Compilation of forms for this machine: each by one process at a time, which removes what another left half-done."""

import hashlib
import os
import platform
import signal
import subprocess
import sysconfig
import tempfile
import time
from collections.abc import Callable
from contextlib import ExitStack, suppress
from ctypes import CDLL
from functools import cache, wraps
from pathlib import Path
from types import FrameType
from typing import Any

import ffcx.codegeneration.jit as generator
import ufl
from dolfinx import fem, jit
from ffcx import naming
from filelock import FileLock, Timeout
from ufl.algorithms import expand_derivatives
from ufl.corealg.map_dag import map_expr_dag
from ufl.corealg.multifunction import MultiFunction

PATIENCE = 300  # [s] that a process waits for the compilation of one that takes no lock
_LOCKS = 64  # forms share them; one that is taken shows that something is compiled


@cache
def machine() -> str:
    """The kind of this processor, as a hash: what is compiled for one need not run on another."""
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
        known = next(line for line in lines if line.startswith(("flags", "Features")))
    except (OSError, StopIteration):
        known = platform.processor()
    return hashlib.sha256(f"{platform.machine()} {known}".encode()).hexdigest()[:12]


# All instructions of this machine, and sums in any order. Never -ffast-math itself: it takes for granted that nothing is NaN, by
# which a state without a value is detected, and makes the whole process round denormal numbers to zero.
FLAGS = [
    "-O3",
    "-march=native",
    "-fno-math-errno",
    "-fno-trapping-math",
    "-fno-signed-zeros",
    "-fassociative-math",
    "-freciprocal-math",
]
# FFCx keeps what it compiled by what it is and by these words, the machine among them.
OPTIONS: dict[str, Any] = {
    "timeout": PATIENCE,
    "cffi_extra_compile_args": [*FLAGS, f"-DFEM_REFERENCE_MACHINE={machine()}"],
}


def lock(folder: Path, number: int) -> FileLock:
    """The lock of that ``number``, of those that forms share, in the ``folder`` of what is compiled."""
    return FileLock(folder / f".fem_reference_{number}.lock")


def _alone[R](compiled: Callable[..., R]) -> Callable[..., R]:
    """FFCx's compilation, by one process at a time for what is the same: it takes for granted that nothing of a form is there
    when it has compiled it, and ends with an error where an interrupted process, or one that was taken for dead, left some.
    """

    @wraps(compiled)
    def waiting(objects: list[Any], *given: Any, **options: Any) -> R:
        folder = Path(str(options["cache_dir"]))
        folder.mkdir(parents=True, exist_ok=True)
        with lock(folder, int(naming.compute_signature(objects, "")[:8], 16) % _LOCKS):
            try:
                return compiled(objects, *given, **options)
            except (FileExistsError, ModuleNotFoundError, TimeoutError):
                _remove_broken(folder)
            return compiled(objects, *given, **options)

    return waiting


generator.compile_forms = _alone(generator.compile_forms)
generator.compile_expressions = _alone(generator.compile_expressions)


def form(expression: Any, entity_maps: Any = None) -> Any:
    """A compiled form; ``entity_maps``: how meshes that meet in it lie in each other."""
    return fem.form(expression, jit_options=OPTIONS, entity_maps=entity_maps)


def expression(value: Any, points: Any) -> Any:
    """A compiled expression at reference ``points`` (q, 3)."""
    return fem.Expression(_expanded(value), points, jit_options=OPTIONS)


def expressions(values: list[Any], points: Any, first: int) -> tuple[Any, Any]:
    """Compiled expressions at reference ``points`` (q, 3): of the ``first`` ones of the scalars ``values``, and of all of them."""
    whole = _expanded(ufl.as_vector(values))
    parts = ufl.as_vector(whole.ufl_operands[:first])
    return tuple(fem.Expression(one, points, jit_options=OPTIONS) for one in (parts, whole))


def _expanded(value: Any) -> Any:
    """``value`` with its derivatives worked out, and without the variables that it was differentiated by: they are numbered through
    the whole process, so that what is compiled would not be found again.
    """
    return map_expr_dag(_WithoutVariables(), expand_derivatives(value))


class _WithoutVariables(MultiFunction):  # type: ignore[misc]  # UFL has no types
    expr = MultiFunction.reuse_if_untouched

    def variable(self, _: Any, operand: Any, label: Any) -> Any:  # noqa: ARG002
        return operand


def library(source: Path, sizes: dict[str, int]) -> CDLL:
    """The functions of a C file, compiled with ``sizes`` and kept beside what FFCx compiles."""
    words = [*FLAGS, *(f"-D{name}={value}" for name, value in sizes.items())]
    compiler = (os.environ.get("CC") or sysconfig.get_config_var("CC") or "cc").split()
    key = hashlib.sha256("\n".join([source.read_text(encoding="utf-8"), *compiler, *words, machine()]).encode())
    folder = Path(jit.get_options()["cache_dir"])
    kept = folder / f"fem_reference_{source.stem}_{key.hexdigest()[:16]}.so"
    if not kept.exists():
        folder.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryDirectory(dir=folder) as new:
            made = Path(new) / kept.name
            _compile([*compiler, *words, "-std=gnu11", "-shared", "-fPIC", str(source), "-o", str(made)])
            made.replace(kept)  # whole or not at all, also where several processes compile it
    return CDLL(str(kept))


def _compile(command: list[str]) -> None:
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode:
        raise RuntimeError(f"{command[0]} cannot compile {command[-3]}: {done.stderr.strip()}")


def prepare() -> None:
    """Make an interrupted compilation clean up after itself, and clean up after processes that could not: what they left half-done
    others would wait for.
    """
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # ours to end is the parent's business
    signal.signal(signal.SIGTERM, _stop)
    folder = Path(jit.get_options()["cache_dir"])
    with ExitStack() as locks:
        try:
            for path in folder.glob(".fem_reference_*.lock"):
                locks.enter_context(FileLock(path).acquire(timeout=0))
        except Timeout:  # what looks half-done may be in the making
            return
        _remove_broken(folder)


def _remove_broken(folder: Path) -> None:
    """Remove what was begun ``PATIENCE`` ago and not ended, and what says that it is there and of which a part is missing."""
    for source in folder.glob("*.c"):
        with suppress(FileNotFoundError):
            done = source.with_suffix(".c.cached").exists()
            if not done and time.time() - source.stat().st_mtime > PATIENCE:
                source.unlink()
    libraries = {path.name.partition(".")[0] for path in folder.glob("*.so")}
    for ready in folder.glob("*.c.cached"):
        source = ready.with_suffix("")
        if not source.exists() or source.stem not in libraries:
            source.unlink(missing_ok=True)
            ready.unlink(missing_ok=True)


def _stop(_number: int, _frame: FrameType | None) -> None:
    # FFCx cleans up after an Exception, which SystemExit is not.
    raise RuntimeError("asked to stop")
