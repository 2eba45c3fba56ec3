"""Text with a unit -> a number in mm, N, MPa, s, rad: the only place where a unit is text.

The annotated types are what scene records are made of: a field of type ``Pressure`` takes ``"30 kPa"`` and holds 0.03.
"""

import math
import re
import sys
from functools import cache, partial
from typing import Annotated

import pint
from pydantic import BeforeValidator

# What people call each kind of quantity, and the unit that numbers of this kind have inside.
_INSIDE = {
    "a length": "mm",
    "an angle": "rad",
    "a pressure": "MPa",
    "a fraction": "",
    "a time": "s",
    "a volume": "mm**3",
}
# A number, then what may be a unit.
_NUMBER_AND_UNIT = re.compile(r"\s*([+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?)\s*(.*?)\s*", re.ASCII)


@cache
def _registry() -> pint.UnitRegistry:
    return pint.UnitRegistry(cache_folder=None)


def quantity(text: object, kind: str) -> float:
    """Read ``text``, a number and then its unit, as a quantity of ``kind`` (``"a pressure"``); ValueError when it is none.

    A fraction is in per cent or has no unit.

    >>> quantity("30 kPa", "a pressure"), quantity("2 cm", "a length"), quantity("0.5 %", "a fraction")
    (0.03, 20.0, 0.005)
    """
    wrong = ValueError(f"{kind} with its unit, such as {_EXAMPLE[kind]}")
    number, unit = _split(text)
    if not number or (kind == "a fraction" and unit not in ("", "%", "percent")):
        raise wrong
    try:
        read = _registry().Quantity(float(number), _registry().parse_units(unit))
        value = float(read.to(_INSIDE[kind] or "dimensionless").magnitude)
        same = read.to_root_units().units == _registry().Quantity(1.0, _INSIDE[kind]).to_root_units().units
    except Exception as error:  # pint raises its own errors, tokenizer errors and TypeError for text that is no unit
        raise wrong from error
    if not math.isfinite(value) or not same:  # to pint an angle has no dimension, its root unit tells it apart
        raise wrong
    return value


def _split(text: object) -> tuple[str, str]:
    """Number and unit as text; both empty where ``text`` does not begin with a number."""
    match = _NUMBER_AND_UNIT.fullmatch(text) if isinstance(text, str) else None
    return (match[1], match[2]) if match else ("", "")


_EXAMPLE = {
    "a length": '"2 mm"',
    "an angle": '"30 deg"',
    "a pressure": '"30 kPa"',
    "a fraction": '"0.5 %"',
    "a time": '"0.01 s"',
    "a volume": '"3 ml"',
}


def point(text: object) -> tuple[float, float, float]:
    """Three lengths that share one unit: ``"146, 238, -431 mm"`` -> (146.0, 238.0, -431.0) [mm]."""
    parts = [_split(part) for part in text.split(",")] if isinstance(text, str) else []
    shared = parts[-1][1] if parts else ""
    try:
        x, y, z = (quantity(f"{number} {shared}", "a length") for number, unit in parts if unit in ("", shared))
    except ValueError as error:
        raise ValueError('three lengths with one unit, such as "146, 238, -431 mm"') from error
    return x, y, z


def length_unit(text: object) -> float:
    """How many mm a unit of length has: ``"m"`` -> 1000.0."""
    if not isinstance(text, str) or not text.strip().isalpha():
        raise ValueError('a unit of length, such as "mm"')
    return quantity(f"1 {text}", "a length")


def _positive(value: float) -> float:
    if not value >= sys.float_info.min:  # below it numbers lose their digits
        raise ValueError("more than zero")
    return value


def _kind(kind: str) -> BeforeValidator:
    return BeforeValidator(partial(quantity, kind=kind))


Length = Annotated[float, _kind("a length")]
PositiveLength = Annotated[float, BeforeValidator(lambda text: _positive(quantity(text, "a length")))]
Angle = Annotated[float, _kind("an angle")]
PositivePressure = Annotated[float, BeforeValidator(lambda text: _positive(quantity(text, "a pressure")))]
Time = Annotated[float, BeforeValidator(lambda text: _positive(quantity(text, "a time")))]
Point = Annotated[tuple[float, float, float], BeforeValidator(point)]
LengthUnit = Annotated[float, BeforeValidator(length_unit)]
