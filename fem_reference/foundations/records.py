"""Strict frozen records read from TOML. Unknown keys, missing keys and wrong values are reported together in one InputError."""

import math
import re
from collections.abc import Callable, Iterator, Sequence
from difflib import get_close_matches
from itertools import pairwise
from typing import Annotated, Any

import pydantic
from pydantic import AfterValidator, BaseModel, ConfigDict, TypeAdapter, ValidationError

from fem_reference.foundations.errors import InputError


class Record(BaseModel):
    """A frozen record that accepts only known keys, values of the declared types, and finite numbers.

    Text and Boolean values are not accepted as numbers; an integer is accepted as a float.
    """

    model_config = ConfigDict(
        frozen=True, extra="forbid", strict=True, allow_inf_nan=False, arbitrary_types_allowed=True
    )


def rule(holds: Callable[[Any], object], want: str) -> Any:
    """Create a check of a record: an error with the text ``want`` unless ``holds`` is true for the record."""

    def check(record: Any) -> Any:
        if not holds(record):
            raise ValueError(want)
        return record

    return pydantic.model_validator(mode="after")(check)


def key_rule(key: str, holds: Callable[[Any, dict[str, Any]], object], want: str) -> Any:
    """Create a check of a ``key`` of a record, like :func:`rule`; ``holds`` takes its value and the values of earlier keys."""

    def check(value: Any, info: Any) -> Any:
        if not holds(value, info.data):
            raise ValueError(want)
        return value

    return pydantic.field_validator(key)(check)


def one_of(*keys: str) -> Any:
    """Create a check that exactly one of the ``keys`` of a record has a value."""
    named = (" and " if len(keys) == 2 else ", ").join(f'"{key}"' for key in keys)
    return rule(lambda one: sum(getattr(one, key) is not None for key in keys) == 1, f"exactly one of {named}")


def increasing(values: Sequence[float] | None, want: str) -> Any:
    """Return the ``values``, which may be None; ValueError unless each value is larger than the one before it."""
    if values is not None and any(late <= early for early, late in pairwise(values)):
        raise ValueError(want)
    return values


def directed(vector: tuple[float, float, float], name: str) -> tuple[float, float, float]:
    """Return the ``vector``; ValueError, with its ``name``, unless the length of the vector is between 1e-9 and 1e9."""
    if not 1e-9 < math.hypot(*vector) < 1e9:
        raise ValueError(f"{name} that is not zero, with a length from 1e-9 to 1e9")
    return vector


def check_name(name: str) -> str:
    """Return the ``name``; ValueError if it is not a valid name."""
    if not name.isprintable() or name != name.strip() or not 0 < len(name) <= _LONGEST_NAME:
        raise ValueError(f"a name of 1 to {_LONGEST_NAME} letters, digits and punctuation, with no blank at either end")
    return name


def _check_file_name(name: str) -> str:
    if not re.fullmatch(rf"[\w-][\w.-]{{0,{_LONGEST_NAME - 1}}}", name):
        raise ValueError(f"a name of 1 to {_LONGEST_NAME} letters, digits and . _ -, without a dot at its start")
    return name


def _check_part_name(name: str) -> str:
    if not re.fullmatch(rf"[\w-]{{1,{_LONGEST_NAME}}}", name):  # a dot follows it in names of scalars
        raise ValueError(f"a name of 1 to {_LONGEST_NAME} letters, digits and _ -, without a dot")
    return name


def check_once(names: Sequence[str], place: str) -> None:
    """Raise InputError if one of ``names`` occurs twice."""
    twice = next((name for name in names if names.count(name) > 1), None)
    if twice is not None:
        raise InputError(place, f'the name "{twice}" twice', "every name once")


def check_used(known: Sequence[str], uses: Sequence[tuple[str, str]], place: str) -> None:
    """Raise InputError if a name in ``uses``, which are pairs (key, name), is not ``known``."""
    for key, name in uses:
        if name not in known:
            want = f"one of {', '.join(known)}" if known else "none, as none is defined"
            raise InputError(join(place, key), f'"{name}"', want)


_SHOWN = 12  # the maximum number of further errors that are shown for a file
_LONGEST_NAME = 100
# A name for pages and messages.
Name = Annotated[str, AfterValidator(check_name)]
# A name that can also be the name of a file or folder.
FileName = Annotated[str, AfterValidator(_check_file_name)]
# A name that can be the name of a folder and, followed by a dot, the first part of the name of a scalar.
PartName = Annotated[str, AfterValidator(_check_part_name)]


def parse[R](record: type[R], table: object, place: str) -> R:
    """Convert ``table`` to a ``record`` or dataclass; errors name keys inside ``place``, for example ``"case.toml: effect[0]"``."""
    try:
        strict = issubclass(record, Record)
        return TypeAdapter(record).validate_python(_turned(table, list, tuple) if strict else table)
    except RecursionError as error:
        raise InputError(place, "tables that are nested too deeply", "the keys of a file") from error
    except ValidationError as error:
        # Unknown keys come first: a message about a mistyped key helps more than one about the missing key that was intended.
        wrong = sorted(_own(error.errors()), key=lambda one: one["type"] != "extra_forbidden")
        raise together([_as_input_error(one, record, place, table) for one in wrong]) from None


def _own(errors: Sequence[Any]) -> list[Any]:
    """Leave out errors about lists that are too short only because some of their entries are wrong."""
    inside = {one["loc"][:i] for one in errors for i in range(len(one["loc"]))}
    return [one for one in errors if one["type"] != "too_short" or one["loc"] not in inside]


def together(wrong: Sequence[InputError]) -> InputError:
    """Combine the errors ``wrong`` into one error at the place of the first of them, with at most one error for each key."""
    places = {str(one.place): one for one in reversed(wrong)}
    first, *others = sorted(places.values(), key=wrong.index)
    if not others:
        return first
    shown = "".join(f"\n  and {one}" for one in others[:_SHOWN])
    more = f"\n  and {len(others) - _SHOWN} more" if len(others) > _SHOWN else ""
    return InputError(first.place, first.got, f"{first.want}{shown}{more}")


def _turned(value: Any, kind: type[Sequence[Any]], into: Callable[[Iterator[Any]], Any]) -> Any:
    """Convert all sequences of type ``kind`` (lists from files, or tuples of records) in a ``value`` with the function ``into``."""
    if isinstance(value, dict):
        return {key: _turned(inside, kind, into) for key, inside in value.items()}
    return into(_turned(inside, kind, into) for inside in value) if isinstance(value, kind) else value


def join(place: str, key: str) -> str:
    """Append ``key`` to ``place``: after a colon if the place is a file, after a dot if it is a key."""
    return place if not key else f"{place}{': ' if place.endswith(('.toml', '.json')) else '.'}{key}"


def _as_input_error(first: Any, record: type, place: str, table: object) -> InputError:
    keys = _keys(table, first["loc"])
    path = "".join(f"[{part}]" if isinstance(part, int) else f".{part}" for part in keys).lstrip(".")
    if first["type"] == "extra_forbidden":
        known = _known(record, first["loc"][:-1])
        near = get_close_matches(str(first["loc"][-1]), known, 1)
        meant = f"{near[0]}, or another " if near else ""
        return InputError(join(place, path), "an unknown key", f"{meant}one of {', '.join(known)}")
    if first["type"] == "missing":
        return InputError(join(place, path), "nothing", "this key")
    got = _turned(first["input"], tuple, list)
    want = first["msg"].removeprefix("Value error, ").removeprefix("Input should be ")
    return InputError(join(place, path), f'"{got}"' if isinstance(got, str) else repr(got), want)


def _keys(table: object, path: tuple[int | str, ...]) -> tuple[int | str, ...]:
    """Shorten ``path`` to the keys and indices of ``table``; pydantic adds names of types where several are allowed."""
    inside: Any = table
    for i, part in enumerate(path):
        if not hasattr(inside, "__getitem__") or isinstance(inside, str):
            return path[:i]
        try:
            inside = inside[part]
        except (KeyError, IndexError, TypeError):  # a missing key is part of the path
            return path
    return path


def _known(record: Any, path: tuple[int | str, ...]) -> list[str]:
    """Keys, as written in files, of the record to which ``path`` leads (a list index stays in the same record)."""
    for part in path:
        if isinstance(part, str) and part in getattr(record, "model_fields", {}):
            record = _record_inside(record.model_fields[part].annotation)
    return keys(record)


def keys(record: Any) -> list[str]:
    """Keys of a ``record`` class, as written in files; empty if it is not a record."""
    fields = getattr(record, "model_fields", {})
    return sorted(field.alias or name for name, field in fields.items() if not field.exclude)


def _record_inside(annotation: Any) -> Any:
    if isinstance(annotation, type) and issubclass(annotation, Record):
        return annotation
    inside = (_record_inside(argument) for argument in getattr(annotation, "__args__", ()))
    return next((record for record in inside if record is not None), None)
