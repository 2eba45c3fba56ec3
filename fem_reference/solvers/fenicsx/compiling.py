"""Compilation of forms for this machine: one process at a time compiles a form and removes incomplete files of others."""

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

PATIENCE = 300  # [s] that a process waits for a compilation without a lock
_LOCKS = 64  # shared by the forms; a locked one shows that something is compiled


@cache
def machine() -> str:
    """The kind of this processor, as a hash: code compiled for one kind need not run on another."""
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
        known = next(line for line in lines if line.startswith(("flags", "Features")))
    except (OSError, StopIteration):
        known = platform.processor()
    return hashlib.sha256(f"{platform.machine()} {known}".encode()).hexdigest()[:12]


# All instructions of this machine, and sums in any order. Never -ffast-math itself: it assumes that nothing is NaN, but NaN
# shows a state without a value; and it makes the whole process round denormal numbers to zero.
FLAGS = [
    "-O3",
    "-march=native",
    "-fno-math-errno",
    "-fno-trapping-math",
    "-fno-signed-zeros",
    "-fassociative-math",
    "-freciprocal-math",
]
# FFCx stores compiled forms under their content and these options, the machine among them.
OPTIONS: dict[str, Any] = {
    "timeout": PATIENCE,
    "cffi_extra_compile_args": [*FLAGS, f"-DFEM_REFERENCE_MACHINE={machine()}"],
}


def lock(folder: Path, number: int) -> FileLock:
    """The lock of that ``number``, among those that forms share, in the ``folder`` of compiled forms."""
    return FileLock(folder / f".fem_reference_{number}.lock")


def _alone[R](compiled: Callable[..., R]) -> Callable[..., R]:
    """FFCx's compilation, run by one process at a time for the same form. FFCx assumes that no file of a form exists once it has
    compiled it, and fails on files that an interrupted or presumed dead process left.
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
    """A compiled form; ``entity_maps`` relate the meshes that it combines."""
    return fem.form(expression, jit_options=OPTIONS, entity_maps=entity_maps)


def expression(value: Any, points: Any) -> Any:
    """A compiled expression at reference ``points`` (q, 3)."""
    return fem.Expression(_expanded(value), points, jit_options=OPTIONS)


def expressions(values: list[Any], points: Any, first: int) -> tuple[Any, Any]:
    """Compiled expressions at reference ``points`` (q, 3): the ``first`` ones of the scalars ``values``, and all of them."""
    whole = _expanded(ufl.as_vector(values))
    parts = ufl.as_vector(whole.ufl_operands[:first])
    return tuple(fem.Expression(one, points, jit_options=OPTIONS) for one in (parts, whole))


def _expanded(value: Any) -> Any:
    """``value`` with its derivatives expanded and without its variables of differentiation: UFL numbers these through the whole
    process, so a compiled form would not be found again.
    """
    return map_expr_dag(_WithoutVariables(), expand_derivatives(value))


class _WithoutVariables(MultiFunction):  # type: ignore[misc]  # UFL has no types
    expr = MultiFunction.reuse_if_untouched

    def variable(self, _: Any, operand: Any, label: Any) -> Any:  # noqa: ARG002
        return operand


def library(source: Path, sizes: dict[str, int]) -> CDLL:
    """The functions of a C file, compiled with ``sizes`` and kept beside FFCx's compiled forms."""
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
            made.replace(kept)  # atomic, also where several processes compile it
    return CDLL(str(kept))


def _compile(command: list[str]) -> None:
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode:
        raise RuntimeError(f"{command[0]} cannot compile {command[-3]}: {done.stderr.strip()}")


def prepare() -> None:
    """Make an interrupted compilation clean up, and remove incomplete files of processes that could not: others would wait for
    them.
    """
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the parent process ends this one
    signal.signal(signal.SIGTERM, _stop)
    folder = Path(jit.get_options()["cache_dir"])
    with ExitStack() as locks:
        try:
            for path in folder.glob(".fem_reference_*.lock"):
                locks.enter_context(FileLock(path).acquire(timeout=0))
        except Timeout:  # an incomplete file may still be in progress
            return
        _remove_broken(folder)


def _remove_broken(folder: Path) -> None:
    """Remove files begun ``PATIENCE`` ago and not finished, and marks of finished forms that lack a file."""
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
