"""Compilation of forms for this machine: one process at a time compiles a form, and removes incomplete files of it before."""

import signal
from collections.abc import Callable
from ctypes import CDLL
from functools import wraps
from pathlib import Path
from types import FrameType
from typing import Any

import ffcx.codegeneration.jit as generator
import ufl
from dolfinx import fem, jit
from ffcx import naming
from filelock import FileLock
from ufl.algorithms import expand_derivatives
from ufl.corealg.map_dag import map_expr_dag
from ufl.corealg.multifunction import MultiFunction

from fem_reference.foundations import native

_LOCKS = 64  # shared by the forms


# All instructions of this machine, and sums in any order. Never -ffast-math itself: it assumes that nothing is NaN, but NaN
# shows a state without a value; and it makes the whole process round denormal numbers to zero.
FLAGS = ["-O3", "-march=native", "-fno-math-errno", "-fno-trapping-math", "-fno-signed-zeros"]
FLAGS += ["-fassociative-math", "-freciprocal-math"]
# FFCx stores compiled forms under their content and these options, the machine among them.
OPTIONS: dict[str, Any] = {"cffi_extra_compile_args": [*FLAGS, f"-DFEM_REFERENCE_MACHINE={native.machine()}"]}


def _alone[R](compiled: Callable[..., R]) -> Callable[..., R]:
    """FFCx's compilation, run by one process at a time for the same form."""

    @wraps(compiled)
    def waiting(objects: list[Any], *given: Any, **options: Any) -> R:
        folder = Path(str(options["cache_dir"]))
        folder.mkdir(parents=True, exist_ok=True)
        number = int(naming.compute_signature(objects, "")[:8], 16) % _LOCKS
        with FileLock(folder / f".fem_reference_{number}.lock"):
            return compiled(objects, *given, **options)

    return waiting


def _complete[R](search: Callable[..., R]) -> Callable[..., R]:
    """FFCx's search for a compiled form, after incomplete files of it are removed. As the process has the form's lock, none is in
    progress: an interrupted or killed process left them, and FFCx would wait for them.
    """

    @wraps(search)
    def found(name: str, objects: list[str], cache_dir: Path, timeout: int) -> R:
        source = Path(cache_dir, f"{name}.c")
        libraries, marks = list(source.parent.glob(f"{name}.*so")), (source, source.with_suffix(".c.cached"))
        if not (libraries and all(path.exists() for path in marks)):
            for path in (*libraries, *marks):
                path.unlink(missing_ok=True)
        return search(name, objects, cache_dir, timeout)

    return found


generator.compile_forms = _alone(generator.compile_forms)
generator.compile_expressions = _alone(generator.compile_expressions)
generator.get_cached_module = _complete(generator.get_cached_module)


def form(expression: Any) -> Any:
    """A compiled form."""
    return fem.form(expression, jit_options=OPTIONS)


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
    flags = [*FLAGS, *(f"-D{name}={value}" for name, value in sizes.items())]
    return native.library(source, flags, Path(jit.get_options()["cache_dir"]))


def prepare() -> None:
    """Let FFCx clean up after an interrupted compilation."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the parent process ends this one
    signal.signal(signal.SIGTERM, _stop)


def _stop(_number: int, _frame: FrameType | None) -> None:
    # FFCx cleans up after an Exception, which SystemExit is not.
    raise RuntimeError("asked to stop")
