"""Formulas: what they are worth, and that nothing else than a formula is one."""

import math

import numpy as np
import pytest

from fem_reference.foundations.errors import InputError
from fem_reference.foundations.formula import Formula, evaluate
from fem_reference.foundations.records import Record, parse


class Holder(Record):
    """A record with a formula."""

    value: Formula


@pytest.mark.parametrize(
    ("text", "value"),
    [("x**2/2 - 2*x", -1.5), ("-y", -2.0), ("sin(pi*x) + exp(0)", 1 + math.sin(math.pi)), ("2**3 / z", 2.0)],
)
def test_values(text, value) -> None:
    assert evaluate(text, (1.0, 2.0, 4.0), vars(math)) == pytest.approx(value, rel=1e-15)


def test_arrays_of_points() -> None:
    x = np.linspace(0, 1, 5)
    assert evaluate("sqrt(x)*2", (x,), vars(np)) == pytest.approx(2 * np.sqrt(x), rel=1e-15)


@pytest.mark.parametrize("value", [1, -0.5, "3e-2", "1/x", "1/(x - 0.5)", " tanh(y)"])
def test_what_is_a_formula(value) -> None:
    assert isinstance(parse(Holder, {"value": value}, "case.toml").value, str)


@pytest.mark.parametrize(
    "value",
    [
        True,
        10**400,
        None,
        [1],
        float("nan"),
        "",
        "x +",
        "w",
        "x; y",
        "open('a')",
        "x.real",
        "().__class__",
        "sin(x, y)",
        "True",
        "[x]",
    ]
    + ["x if y else z", "lambda: x", "'a'", "+" * 2000],
)
def test_what_is_none(value) -> None:
    with pytest.raises(InputError, match=r"case\.toml: value: got .*, want a number, or a formula of x, y, z"):
        parse(Holder, {"value": value}, "case.toml")


def test_a_coordinate_that_is_not_there() -> None:
    with pytest.raises(InputError, match=r'got "z", want a formula of x, y, pi'):
        evaluate("z", (1.0, 2.0), {})
