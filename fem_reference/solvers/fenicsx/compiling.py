"""Compilation of forms for this machine. One process compiles at a time, after removing the files of incomplete compilations."""

import signal
from collections.abc import Callable, Sequence
from ctypes import CDLL
from functools import cache, wraps
from importlib.machinery import EXTENSION_SUFFIXES
from pathlib import Path
from types import FrameType
from typing import Any, NamedTuple

import ffcx.codegeneration.jit as generator
import ufl
from dolfinx import cpp, default_scalar_type, fem, jit
from filelock import FileLock
from ufl.algorithms import expand_derivatives, extract_coefficients
from ufl.algorithms.analysis import extract_constants, extract_type
from ufl.algorithms.signature import compute_expression_signature
from ufl.classes import Label
from ufl.corealg.map_dag import map_expr_dag
from ufl.corealg.multifunction import MultiFunction
from ufl.domain import extract_domains

from fem_reference.foundations import native

# Use all instructions of this machine, and let the compiler reorder sums. Not -ffast-math itself: it assumes that no value is NaN,
# which here marks a state without a value, and it makes the process round denormal numbers to zero.
FLAGS = ["-O3", "-march=native", "-fno-math-errno", "-fno-trapping-math", "-fno-signed-zeros"]
FLAGS += ["-fassociative-math", "-freciprocal-math"]
# FFCx stores compiled forms under a hash of their content and these options, which include the kind of machine.
OPTIONS: dict[str, Any] = {"cffi_extra_compile_args": [*FLAGS, f"-DFEM_REFERENCE_MACHINE={native.machine()}"]}


def _alone[R](compiled: Callable[..., R]) -> Callable[..., R]:
    """Let one process at a time run FFCx's compilation. A lock per form would need the form's signature, slow to compute."""

    @wraps(compiled)
    def waiting(objects: list[Any], *given: Any, **options: Any) -> R:
        folder = Path(str(options["cache_dir"]))
        folder.mkdir(parents=True, exist_ok=True)
        with FileLock(folder / ".fem_reference.lock"):
            return compiled(objects, *given, **options)

    return waiting


def _complete[R](search: Callable[..., R]) -> Callable[..., R]:
    """Wrap FFCx's search for a compiled form: search once for each form, after removing its incomplete files. As this process holds
    the lock, no other process is writing these files; they are left from an interrupted or killed process, and FFCx would wait for
    them to be completed.
    """
    loaded: dict[str, R] = {}

    @wraps(search)
    def found(name: str, objects: list[str], cache_dir: Path, timeout: int) -> R:
        if name in loaded:
            return loaded[name]
        source = Path(cache_dir, f"{name}.c")
        libraries = [source.with_suffix(ending) for ending in EXTENSION_SUFFIXES]
        marks = source, source.with_suffix(".c.cached")
        if not (any(path.exists() for path in libraries) and all(path.exists() for path in marks)):
            for path in (*libraries, *marks):
                path.unlink(missing_ok=True)
        result = search(name, objects, cache_dir, timeout)
        return result if result == (None, None) else loaded.setdefault(name, result)

    return found


generator.compile_forms = _alone(generator.compile_forms)
generator.compile_expressions = _alone(generator.compile_expressions)
generator.get_cached_module = _complete(generator.get_cached_module)
# UFL creates an element's cell, with all cells of its boundary, at each access, which takes a fifth of a small body's set-up time.
ufl.cell.Cell = cache(ufl.cell.Cell)


def form(expression: Any) -> Any:
    """A compiled form."""
    return fem.form(expression, jit_options=OPTIONS)


class _Code(NamedTuple):
    """A compiled expression, its ``module``, and the indices, in the formula's lists, of the functions and constants it reads."""

    expression: Any
    module: Any
    functions: tuple[int, ...]
    constants: tuple[int, ...]


class BoundExpression(fem.Expression):  # type: ignore[misc]  # generic in the type of its values
    """A compiled expression that reads the functions and constants of one body."""

    def __init__(self, code: _Code, functions: Sequence[Any], constants: Sequence[Any]) -> None:
        ffi = code.module.ffi
        read = [functions[i]._cpp_object for i in code.functions], [constants[i]._cpp_object for i in code.constants]
        self._argument_space = None
        address = ffi.cast("uintptr_t", ffi.addressof(code.expression))
        self._cpp_object = cpp.fem.create_expression_float64(address, *read, [], None)


_codes: dict[tuple[str, str, tuple[int, ...]], tuple[_Code, ...]] = {}  # by signature, points and numbers of components


def expression(value: Any, points: Any) -> Any:
    """A compiled expression of a ``value`` at reference ``points`` (q, 3)."""
    return _bound(value, points, ())[0]


def expressions(values: list[Any], points: Any, first: int) -> tuple[Any, Any]:
    """Two compiled expressions at reference ``points`` (q, 3): of the first n = ``first`` of the scalar ``values``, and of all."""
    whole, part = _bound(ufl.as_vector(values), points, (first,))
    return part, whole


def _bound(value: Any, points: Any, firsts: tuple[int, ...]) -> list[BoundExpression]:
    """Compiled expressions of a ``value`` at reference ``points`` (q, 3): one of all components, then one of the first n components
    for each n in ``firsts``. A formula is differentiated and looked up only once: another body has other functions and constants,
    but in the same order.
    """
    functions, constants = extract_coefficients(value), extract_constants(value)
    labels = sorted(extract_type(value, Label), key=Label.count)
    known = (functions, constants, labels, extract_domains(value))
    numbers = {one: i for kind in known for i, one in enumerate(kind)}
    key = compute_expression_signature(value, numbers), points.tobytes().hex(), firsts
    if key not in _codes:
        whole = map_expr_dag(_WithoutVariables(), expand_derivatives(value))
        parts = [ufl.as_vector(whole.ufl_operands[:count]) for count in firsts]
        _codes[key] = tuple(_code(one, points, functions, constants) for one in (whole, *parts))
    return [BoundExpression(code, functions, constants) for code in _codes[key]]


def _code(value: Any, points: Any, functions: list[Any], constants: list[Any]) -> _Code:
    (domain,) = extract_domains(value)
    options = {"form_compiler_options": {"scalar_type": default_scalar_type}, "jit_options": OPTIONS}
    code, module, _ = jit.ffcx_jit(domain.ufl_cargo().comm, (value, points), **options)
    own = extract_coefficients(value)
    read = [own[code.original_coefficient_positions[i]] for i in range(code.num_coefficients)]
    return _Code(code, module, tuple(map(functions.index, read)), tuple(map(constants.index, extract_constants(value))))


class _WithoutVariables(MultiFunction):  # type: ignore[misc]  # UFL has no types
    """Replaces UFL variables with their values. Their labels, and with them the signatures of forms, differ between processes."""

    expr = MultiFunction.reuse_if_untouched

    def variable(self, _: Any, operand: Any, label: Any) -> Any:  # noqa: ARG002
        return operand


def library(source: Path, sizes: dict[str, int]) -> CDLL:
    """The functions of a C file, compiled with ``sizes`` as macros and stored with FFCx's compiled forms."""
    flags = [*FLAGS, *(f"-D{name}={value}" for name, value in sizes.items())]
    return native.library(source, flags, Path(jit.get_options()["cache_dir"]))


def prepare() -> None:
    """Let FFCx clean up after an interrupted compilation."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the parent process ends this one
    signal.signal(signal.SIGTERM, _stop)


def _stop(_number: int, _frame: FrameType | None) -> None:
    # FFCx cleans up after an Exception; SystemExit is not one.
    raise RuntimeError("asked to stop")
