"""Strict frozen records read from TOML: an unknown key, a missing key or a wrong value is one InputError that names it."""

from typing import Any

from pydantic import BaseModel, ConfigDict, ValidationError

from fem_reference.errors import InputError


class Record(BaseModel):
    """A frozen record whose keys are all known."""

    model_config = ConfigDict(frozen=True, extra="forbid", strict=False, arbitrary_types_allowed=True)


def parse[R: Record](record: type[R], table: object, place: str) -> R:
    """``table`` as a ``record``; ``place`` is what its keys are reported below, for example ``"case.toml: effect[0]"``."""
    try:
        return record.model_validate(table)
    except ValidationError as error:
        raise _as_input_error(error.errors()[0], record, place) from None


def join(place: str, key: str) -> str:
    """``place`` with ``key`` below it: a file takes a colon, a key takes a dot."""
    return place if not key else f"{place}{': ' if place.endswith('.toml') else '.'}{key}"


def _as_input_error(first: Any, record: type[Record], place: str) -> InputError:
    path = "".join(f"[{part}]" if isinstance(part, int) else f".{part}" for part in first["loc"]).lstrip(".")
    if first["type"] == "extra_forbidden":
        return InputError(join(place, path), "an unknown key", f"one of {', '.join(_known(record, first['loc'][:-1]))}")
    if first["type"] == "missing":
        return InputError(join(place, path), "nothing", "this key")
    got = first["input"]
    want = first["msg"].removeprefix("Value error, ").removeprefix("Input should be ")
    return InputError(join(place, path), f'"{got}"' if isinstance(got, str) else repr(got), want)


def _known(record: Any, path: tuple[int | str, ...]) -> list[str]:
    """The keys of the record that ``path`` leads to (a list index stays in the same record)."""
    for part in path:
        if isinstance(part, str) and part in getattr(record, "model_fields", {}):
            record = _record_inside(record.model_fields[part].annotation)
    return sorted(getattr(record, "model_fields", {}))


def _record_inside(annotation: Any) -> Any:
    if isinstance(annotation, type) and issubclass(annotation, Record):
        return annotation
    inside = (_record_inside(argument) for argument in getattr(annotation, "__args__", ()))
    return next((record for record in inside if record is not None), None)
