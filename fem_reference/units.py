"""Text with a unit -> a number in mm, N, MPa, s, rad: the only place where a unit is text.

The annotated types are what scene records are made of: a field of type ``Pressure`` takes ``"30 kPa"`` and holds 0.03.
"""

import math
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


@cache
def _registry() -> pint.UnitRegistry:
    return pint.UnitRegistry(cache_folder=None)


def quantity(text: object, kind: str) -> float:
    """Read ``text`` as a quantity of ``kind`` (a key such as ``"a pressure"``); ValueError when it is none.

    >>> quantity("30 kPa", "a pressure"), quantity("2 cm", "a length"), quantity("0.5 %", "a fraction")
    (0.03, 20.0, 0.005)
    """
    wrong = ValueError(f"{kind} with its unit, such as {_EXAMPLE[kind]}")
    if not isinstance(text, str):
        raise wrong
    try:
        read = _registry().Quantity(text)
        value = float(read.to(_INSIDE[kind] or "dimensionless").magnitude)
    except (
        Exception
    ) as error:  # pint raises its own errors, tokenizer errors and TypeError for text that is no quantity
        raise wrong from error
    if not math.isfinite(value) or (kind == "an angle" and read.unitless):
        raise wrong
    return value


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
    parts = text.split(",") if isinstance(text, str) else []
    unit = parts[-1].split()[-1] if parts and parts[-1].split() else ""
    try:
        x, y, z = (quantity(part if unit in part else f"{part} {unit}", "a length") for part in parts)
    except ValueError as error:
        raise ValueError('three lengths with one unit, such as "146, 238, -431 mm"') from error
    return x, y, z


def length_unit(text: object) -> float:
    """How many mm a unit of length has: ``"m"`` -> 1000.0."""
    if not isinstance(text, str) or not text.strip().isalpha():
        raise ValueError('a unit of length, such as "mm"')
    return quantity(f"1 {text}", "a length")


def _positive(value: float) -> float:
    if not value > 0:
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
