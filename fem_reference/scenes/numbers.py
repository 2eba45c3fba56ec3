"""Numbers in a case, addressed by keys such as ``effect[0].mu``: reading, changing and naming them."""

import re
from typing import Annotated, Any

from pydantic import TypeAdapter, ValidationError

from fem_reference.effects import Effect, name_of
from fem_reference.foundations.errors import InputError
from fem_reference.foundations.records import Record, join, parse
from fem_reference.foundations.units import LENGTH_UNITS, field_unit, kinds, length_unit, written
from fem_reference.scenes.case import Case


def parts(key: str) -> list[str | int]:
    """The parts of a ``key``, with list indices as integers.

    >>> parts("effect[0].ramp[1].amount")
    ['effect', 0, 'ramp', 1, 'amount']
    """
    found = re.findall(r"[^.\[\]]+", key) or [""]
    return [int(part) if part.isdecimal() and len(part) < 10 else part for part in found]


def canonical(key: str) -> str:
    """The canonical spelling of a ``key``.

    >>> canonical("effect.0.mu"), canonical("effect[00].ramp[1].amount")
    ('effect[0].mu', 'effect[0].ramp[1].amount')
    """
    return "".join(f"[{part}]" if isinstance(part, int) else f".{part}" for part in parts(key)).lstrip(".")


def number(case: Case, key: str) -> float:
    """The number at a ``key`` of a ``case``, in its internal unit. Raises InputError if there is no number."""
    found = _along(case, key)[-1]
    if isinstance(found, bool) or not isinstance(found, float | int):
        got = "no value" if found is None else f"{type(found).__name__}"
        raise InputError(join(case.place, key), got, "the key of a number that this case has")
    return float(found)


def unit(case: Case, key: str) -> str:
    """The internal unit of the number at a ``key``; empty for a dimensionless number."""
    return field_unit(_field(case, key))


def read(case: Case, key: str, value: str | float) -> float:
    """Convert a ``value`` for the number at a ``key`` to the internal unit of this number.

    ``value``: text with a unit as in scene files, or a number in the internal unit. Raises InputError if the value is invalid.
    """
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
    """A copy of the ``case`` with new numbers. ``values``: the numbers by key, in internal units.

    Each number and the records that contain it are checked as in a scene file. To make the checks across records too, use
    :func:`fem_reference.scenes.casefile.with_numbers`.
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
    """A copy of ``record`` with ``value`` in its field ``name``, checked as if read from a file at ``place``."""
    fields = type(record).model_fields
    stated = {one: getattr(record, one) for one in fields if one in record.model_fields_set} | {name: value}
    table = {fields[one].alias or one: _in_file(fields[one], inside) for one, inside in stated.items()}
    return parse(type(record), table, place)


def _in_file(field: Any, value: Any) -> Any:
    """The ``value`` of a ``field``, as it is written in files."""
    readers = [one for kind in kinds(field.annotation) for one in getattr(kind, "__metadata__", ())]
    if any(getattr(one, "func", None) is length_unit for one in (*field.metadata, *readers)):
        return next((unit for unit, length in LENGTH_UNITS.items() if length == value), value)
    return written(value, field_unit(field))


def title(case: Case, key: str) -> str:
    """A ``key`` in words, in which list entries are replaced by their names: ``neo_hooke mu`` for ``effect[0].mu``."""
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
    """The pydantic field of the number at a ``key``."""
    number(case, key)
    owner, name = _along(case, key)[-2], parts(key)[-1]
    if not isinstance(owner, Record):
        raise InputError(join(case.place, key), "a number in a list", "the key of a number with a name")
    return type(owner).model_fields[str(name)]


def _along(case: Case, key: str) -> list[Any]:
    """The ``case``, then for each part of the ``key`` the value at this part, which is inside the previous value.

    Raises InputError if one of these values does not exist.
    """
    found: list[Any] = [case]
    for part in parts(key):
        inside = found[-1]
        fields = getattr(type(inside), "model_fields", ())
        known = isinstance(inside, tuple) and part < len(inside) if isinstance(part, int) else part in fields
        if not known:
            raise InputError(join(case.place, key), "nothing", "the key of a number that this case has")
        found.append(inside[part] if isinstance(part, int) else getattr(inside, part))
    return found
