"""Formulas as text, such as ``"x**2/2 - 2*x"``: checked when they are read, and evaluated with numbers, arrays or symbols."""

import ast
import math
import sys
from collections.abc import Callable, Mapping, Sequence
from typing import Annotated, Any

import numpy as np
from pydantic import BeforeValidator

from fem_reference.foundations.errors import InputError

FUNCTIONS = ("sin", "cos", "exp", "sqrt", "tanh")
COORDINATES = ("x", "y", "z")
_WANT = f'a number, or a formula of x, y, z, pi, + - * / ** and {", ".join(FUNCTIONS)}, such as "sin(pi*x)"'
_LONGEST = 1000  # the maximum number of characters, too few to exceed Python's recursion limit in ``evaluate``
_OPERATORS: dict[type[ast.operator], Callable[[Any, Any], Any]] = {
    ast.Add: lambda a, b: a + b,
    ast.Sub: lambda a, b: a - b,
    ast.Mult: lambda a, b: a * b,
    ast.Div: lambda a, b: a / b,
    ast.Pow: lambda a, b: a**b,
}


def _checked(value: object) -> str:
    """Return the text of a formula, given as a number or as text; ValueError if ``value`` is not a formula."""
    if isinstance(value, int | float) and not isinstance(value, bool) and abs(value) <= sys.float_info.max:
        return repr(float(value))
    if not isinstance(value, str) or len(value) > _LONGEST:
        raise ValueError(_WANT)
    try:
        with np.errstate(all="ignore"):
            if np.iscomplexobj(evaluate(value, (np.float64(0.5),) * 3, vars(np))):
                raise ValueError(_WANT)
    except (SyntaxError, InputError, RecursionError) as error:
        raise ValueError(_WANT) from error
    except ArithmeticError:
        pass  # it is still a formula, although its value at the tested point is not finite
    return value


Formula = Annotated[str, BeforeValidator(_checked)]


def evaluate(text: str, position: Sequence[Any], functions: Mapping[str, Any]) -> Any:
    """Evaluate the formula ``text`` at a ``position`` (x, y, z), (x, y) or (x,); ``functions`` maps names to callables.

    Raises InputError if ``text`` contains anything but numbers, coordinates, pi, operators and functions.

    >>> evaluate("x**2/2 - 2*x", (1.0,), {})
    -1.5
    """
    known = dict(zip(COORDINATES, position, strict=False)) | {"pi": math.pi}

    def value(node: ast.AST) -> Any:
        match node:
            case ast.Constant(value=int() | float() as number) if not isinstance(number, bool):
                return float(number)
            case ast.Name(id=name) if name in known:
                return known[name]
            case ast.BinOp(left, operator, right) if type(operator) in _OPERATORS:
                return _OPERATORS[type(operator)](value(left), value(right))
            case ast.UnaryOp(ast.USub(), operand):
                return -value(operand)
            case ast.Call(ast.Name(id=name), [argument], []) if name in FUNCTIONS:
                return functions[name](value(argument))
        want = f"a formula of {', '.join(known)}, + - * / ** and {', '.join(FUNCTIONS)}"
        raise InputError("formula", f'"{text}"', want)

    return value(ast.parse(text.strip(), mode="eval").body)
