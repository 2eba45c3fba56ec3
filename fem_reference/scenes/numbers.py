"""Numbers of a case by their keys, such as ``effect[0].mu``: read, changed and named."""

import re
from typing import Annotated, Any

from pydantic import TypeAdapter, ValidationError

from fem_reference.effects import Effect, name_of
from fem_reference.foundations.errors import InputError
from fem_reference.foundations.records import Record, join, parse
from fem_reference.foundations.units import LENGTH_UNITS, field_unit, kinds, length_unit, written
from fem_reference.scenes.case import Case


def parts(key: str) -> list[str | int]:
    """The parts of a ``key``, with positions in a list as numbers.

    >>> parts("effect[0].ramp[1].amount")
    ['effect', 0, 'ramp', 1, 'amount']
    """
    found = re.findall(r"[^.\[\]]+", key) or [""]
    return [int(part) if part.isdecimal() and len(part) < 10 else part for part in found]


def canonical(key: str) -> str:
    """The canonical text of a ``key``.

    >>> canonical("effect.0.mu"), canonical("effect[00].ramp[1].amount")
    ('effect[0].mu', 'effect[0].ramp[1].amount')
    """
    return "".join(f"[{part}]" if isinstance(part, int) else f".{part}" for part in parts(key)).lstrip(".")


def number(case: Case, key: str) -> float:
    """The number of a ``case`` at a ``key``, in its internal unit; InputError if there is none."""
    found = _along(case, key)[-1]
    if isinstance(found, bool) or not isinstance(found, float | int):
        got = "no value" if found is None else f"{type(found).__name__}"
        raise InputError(join(case.place, key), got, "the key of a number that this case has")
    return float(found)


def unit(case: Case, key: str) -> str:
    """The internal unit of the number at a ``key``; empty if it has none."""
    return field_unit(_field(case, key))


def read(case: Case, key: str, value: str | float) -> float:
    """A ``value`` for the number at a ``key``, as in scene files or in its internal unit; InputError if it is not valid."""
    field = _field(case, key)
    kind: Any = Annotated[(field.annotation, *field.metadata)] if field.metadata else field.annotation
    try:
        return float(TypeAdapter(kind).validate_python(written(value, field_unit(field)), strict=True))
    except ValidationError as error:
        want = error.errors()[0]["msg"].removeprefix("Value error, ").removeprefix("Input should be ")
        raise InputError(
            join(case.place, key), f'"{value}"' if isinstance(value, str) else repr(value), want
        ) from error


def changed[C: Case](case: C, values: dict[str, float]) -> C:
    """The ``case`` with other numbers by key, in their internal units. Each number and the records around it are checked as in a
    scene file. :func:`fem_reference.scenes.casefile.with_numbers` also makes the checks across records.
    """
    for key, value in values.items():
        found: Any = read(case, key, value)
        names = parts(key)
        for i in reversed(range(len(names))):
            inside, part = _along(case, key)[i], names[i]
            if isinstance(part, int):
                found = (*inside[:part], found, *inside[part + 1 :])
            else:
                found = _with(inside, part, found, join(case.place, canonical(".".join(map(str, names[:i])))))
        case = found
    return case


def _with(record: Record, name: str, value: Any, place: str) -> Record:
    """A ``record`` with another value, read again as from a file."""
    fields = type(record).model_fields
    stated = {one: getattr(record, one) for one in fields if one in record.model_fields_set} | {name: value}
    table = {fields[one].alias or one: _in_file(fields[one], inside) for one, inside in stated.items()}
    return parse(type(record), table, place)


def _in_file(field: Any, value: Any) -> Any:
    """A ``value`` of a field as files write it."""
    readers = [one for kind in kinds(field.annotation) for one in getattr(kind, "__metadata__", ())]
    if any(getattr(one, "func", None) is length_unit for one in (*field.metadata, *readers)):
        return next((unit for unit, length in LENGTH_UNITS.items() if length == value), value)
    return written(value, field_unit(field))


def title(case: Case, key: str) -> str:
    """A ``key`` in words: effects and other entries by their names, such as ``neo_hooke mu`` for ``effect[0].mu``."""
    words = list[str]()
    for part, inside in zip(parts(key), _along(case, key)[1:], strict=True):
        if isinstance(inside, Effect):
            words[-1] = name_of(inside)
        elif isinstance(part, int):
            words.append(str(getattr(inside, "name", part + 1)))
        else:
            words.append(part)
    return " ".join(words)


def _field(case: Case, key: str) -> Any:
    """The field of a record that contains the number at a ``key``."""
    number(case, key)
    owner, name = _along(case, key)[-2], parts(key)[-1]
    if not isinstance(owner, Record):
        raise InputError(join(case.place, key), "a number of a list", "the key of a number with a name")
    return type(owner).model_fields[str(name)]


def _along(case: Case, key: str) -> list[Any]:
    """The ``case`` and the values along the parts of a ``key``, each inside the previous one; InputError if one does not exist."""
    found: list[Any] = [case]
    for part in parts(key):
        inside = found[-1]
        fields = getattr(type(inside), "model_fields", ())
        known = isinstance(inside, tuple) and part < len(inside) if isinstance(part, int) else part in fields
        if not known:
            raise InputError(join(case.place, key), "nothing", "the key of a number that this case has")
        found.append(inside[part] if isinstance(part, int) else getattr(inside, part))
    return found
