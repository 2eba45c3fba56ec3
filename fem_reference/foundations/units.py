"""Conversion of text with a unit to numbers in mm, N, MPa, s, rad and tonne; no other module handles units as text.

Scene records use the annotated types: a field of type ``Pressure`` accepts ``"30 kPa"`` and stores 0.03.
"""

import math
import re
import threading
import tomllib
from collections.abc import Sequence
from functools import cache, partial
from numbers import Real
from pathlib import Path
from typing import Annotated, Any, NamedTuple

from pydantic import BeforeValidator, TypeAdapter

# The allowed units of coordinates (in files, in scenes, with frames and on the command line), and their lengths [mm]. A quantity
# that is written with its unit may have any unit of its kind, but for coordinates a slip such as "Mm", 1e9 mm, would go unnoticed.
LENGTH_UNITS = {"mm": 1.0, "cm": 10.0, "m": 1000.0, "um": 1e-3, "in": 25.4, "ft": 304.8}


class Kind(NamedTuple):
    """A kind of quantity. ``unit``: its internal unit; ``examples``: one value, and three values, as written in a file;
    ``greatest``: the maximum accepted magnitude, far above realistic values; ``written``: for a kind without a unit, the texts
    accepted as a unit.
    """

    unit: str
    examples: tuple[str, ...]
    greatest: float = 1e15
    written: tuple[str, ...] = ()


_FILE = tomllib.loads(Path(__file__).with_suffix(".toml").read_text(encoding="utf-8"))
# The kinds, by name, and the conversion factors of common units, by the common unit and the internal unit.
KINDS = TypeAdapter(dict[str, Kind]).validate_python(_FILE["kind"])
COMMON: dict[tuple[str, str], float] = {
    (unit, inside): factor for inside, units in _FILE["common"].items() for unit, factor in units.items()
}
_ONE_BY_ONE = threading.Lock()
# A number, followed by an optional unit.
_NUMBER_AND_UNIT = re.compile(r"\s*([+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?)\s*(.*?)\s*", re.ASCII)
# Forbidden in a unit: an exponent that is not an integer of one or two digits, or that itself has an exponent, as in mm^9^9^9.
_NO_UNIT = re.compile(r"(?:\^|\*\*)(?!\s*[+-]?\d{1,2}(?![\w.])(?!\s*(?:\^|\*\*)))", re.ASCII)
# The maximum number of characters in a quantity.
_LONGEST = 100
# The smallest accepted positive quantity, in its internal unit.
_SMALLEST = 1e-30
# The position before an exponent that directly follows a unit, as in m3.
_EXPONENT = re.compile(r"(?<=[A-Za-z])(?=[23](?!\w))")


@cache
def _registry() -> Any:
    import pint  # imported here because it takes 0.4 s, which is saved if only common units occur

    return pint.UnitRegistry(cache_folder=None)


def quantity(text: object, kind: str) -> float:
    """Convert ``text``, a number followed by its unit, to a quantity of ``kind`` (``"a pressure"``); ValueError if it is not one.

    A fraction is written in per cent or without a unit.

    >>> quantity("30 kPa", "a pressure"), quantity("2 cm", "a length"), quantity("0.5 %", "a fraction")
    (0.03, 20.0, 0.005)
    """
    own = KINDS[kind]
    wrong = ValueError(f"{kind}{' with its unit' if kind != 'a number' else ''}, such as {own.examples[0]}")
    number, unit = _split(text)
    unit = _EXPONENT.sub("^", unit)
    if not number or unit not in (own.written or (unit,)) or _NO_UNIT.search(unit):
        raise wrong
    try:
        value = float(number) * _factor(unit, own.unit)
    except Exception as error:  # pint raises its own errors, tokenizer errors and TypeError for text that is not a unit
        raise wrong from error
    if not math.isfinite(value):
        raise wrong
    if abs(value) > own.greatest:
        raise ValueError(f"{kind} of at most {own.greatest:g} {own.unit}".rstrip())
    return value


@cache
def _factor(unit: str, inside: str) -> float:
    """Factor that converts ``unit`` to ``inside``. For units of different kinds, pint raises an error or the result is NaN."""
    if unit == inside or (unit, inside) in COMMON:
        return COMMON.get((unit, inside), 1.0)
    with _ONE_BY_ONE:  # pint cannot combine quantities of two registries, which two threads could otherwise build
        registry = _registry()
        one = registry.Quantity(1.0, registry.parse_units(unit))
        factor = float(one.to(inside or "dimensionless").magnitude)
        # In pint an angle has no dimension; only its root unit distinguishes it from a number.
        same = one.to_root_units().units == registry.Quantity(1.0, inside).to_root_units().units
    return factor if same else math.nan


def _split(text: object) -> tuple[str, str]:
    """Split ``text`` into a number and a unit, as texts; both are empty if ``text`` does not begin with a number."""
    match = _NUMBER_AND_UNIT.fullmatch(text) if isinstance(text, str) and len(text) <= _LONGEST else None
    return (match[1], match[2]) if match else ("", "")


def three(text: object, kind: str) -> tuple[float, float, float]:
    """Convert ``text`` to three quantities of ``kind`` with a common unit.

    >>> three("146, 238, -431 mm", "a length"), three("0, 6.25, 0 kPa", "a pressure")
    ((146.0, 238.0, -431.0), (0.0, 0.00625, 0.0))
    """
    parts = [_split(part) for part in text.split(",", 3)] if isinstance(text, str) else []
    shared = parts[-1][1] if parts else ""
    try:
        x, y, z = (quantity(f"{number} {shared}", kind) for number, unit in parts if unit in ("", shared))
    except ValueError as error:
        noun = kind.split()[1]
        raise ValueError(f"three {noun}s with one unit, such as {KINDS[kind].examples[1]}") from error
    return x, y, z


def length_unit(text: object) -> float:
    """Length [mm] of a unit of coordinates, which must be one of ``LENGTH_UNITS``: ``"m"`` -> 1000.0."""
    if not isinstance(text, str) or text not in LENGTH_UNITS:
        raise ValueError(f"a unit of length: {', '.join(LENGTH_UNITS)}")
    return LENGTH_UNITS[text]


def positive(text: object, kind: str) -> float:
    """Convert ``text`` to a :func:`quantity` that must be above zero."""
    value = quantity(text, kind)
    if not value > 0:
        raise ValueError("more than zero")
    if not value >= _SMALLEST:
        raise ValueError(f"at least {_SMALLEST:g} {KINDS[kind].unit}".rstrip())
    return value


Length = Annotated[float, BeforeValidator(partial(quantity, kind="a length"))]
PositiveLength = Annotated[float, BeforeValidator(partial(positive, kind="a length"))]
Angle = Annotated[float, BeforeValidator(partial(quantity, kind="an angle"))]
Pressure = Annotated[float, BeforeValidator(partial(quantity, kind="a pressure"))]
PositivePressure = Annotated[float, BeforeValidator(partial(positive, kind="a pressure"))]
PressureVector = Annotated[tuple[float, float, float], BeforeValidator(partial(three, kind="a pressure"))]
AreaStiffness = Annotated[float, BeforeValidator(partial(positive, kind="a stiffness per area"))]
VolumeDamping = Annotated[float, BeforeValidator(partial(positive, kind="a damping per volume"))]
Force = Annotated[float, BeforeValidator(partial(positive, kind="a force"))]
Stiffness = Annotated[float, BeforeValidator(partial(positive, kind="a stiffness"))]
Viscosity = Annotated[float, BeforeValidator(partial(positive, kind="a viscosity"))]
BendingStiffness = Annotated[float, BeforeValidator(partial(positive, kind="a bending stiffness"))]
Rate = Annotated[float, BeforeValidator(partial(positive, kind="a rate"))]
Density = Annotated[float, BeforeValidator(partial(positive, kind="a density"))]
AccelerationVector = Annotated[tuple[float, float, float], BeforeValidator(partial(three, kind="an acceleration"))]
Time = Annotated[float, BeforeValidator(partial(positive, kind="a time"))]
Point = Annotated[tuple[float, float, float], BeforeValidator(partial(three, kind="a length"))]
LengthUnit = Annotated[float, BeforeValidator(length_unit)]


def unit_of(metadata: Sequence[object]) -> str:
    """Internal unit of a field whose type, from this module, has the ``metadata``; empty if it has no unit.

    >>> unit_of(Density.__metadata__), unit_of(())
    ('tonne/mm^3', '')
    """
    readers = [entry.func for entry in metadata if isinstance(entry, BeforeValidator)]
    return next((KINDS[reader.keywords["kind"]].unit for reader in readers if isinstance(reader, partial)), "")


def field_unit(field: Any) -> str:
    """Internal unit of a ``field`` of a record, from its type or from one of the types of a union; empty if it has no unit."""
    inside = (unit_of(getattr(kind, "__metadata__", ())) for kind in kinds(field.annotation))
    return unit_of(field.metadata) or next((unit for unit in inside if unit), "")


def kinds(annotation: Any) -> list[Any]:
    """Return a type and all types that it contains."""
    return [annotation, *(kind for part in getattr(annotation, "__args__", ()) for kind in kinds(part))]


def written(value: Any, unit: str) -> Any:
    """Write a number, or three numbers, as text with the internal ``unit``; return text, and values without a unit, unchanged.

    >>> written(0.01, "MPa"), written((0, 0, -1), "mm"), written("2 cm", "mm"), written(3, "")
    ('0.01 MPa', '0.0, 0.0, -1.0 mm', '2 cm', 3)
    """
    numbers = value if isinstance(value, Sequence) else (value,)
    if not unit or isinstance(value, str | bool) or not all(isinstance(number, Real) for number in numbers):
        return value
    return f"{', '.join(repr(float(number)) for number in numbers)} {unit}"
