"""A case made in Python, without a file."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from fem_reference.effects import find, name_of, names
from fem_reference.foundations.errors import InputError
from fem_reference.foundations.given import path, said
from fem_reference.foundations.records import Record
from fem_reference.foundations.units import field_unit, kinds, written
from fem_reference.scenes.case import Case
from fem_reference.scenes.casefile import made
from fem_reference.scenes.muscle import MuscleCase


def make_case(table: Mapping[str, Any], folder: str | Path = ".", name: str = "case") -> Case:
    """Make a case from a ``table`` with the keys of a ``case.toml``, but without a file.

    A table with a ``domain`` is the case of a scalar field; any other table is the case of a muscle. A quantity is text with a
    unit, or a number in mm, N, MPa, s, rad or tonne. An effect is a table or a result of :func:`fem_reference.make_effect`. The
    keys ``candidate``, ``expect`` and ``negative_control`` are optional. File names are relative to ``folder``. ``name``: the name
    of the case on pages. Raises InputError if a key is missing, unknown or invalid; the message names the key, the given value and
    the expected value. ``cases/hip_flexion/case.toml`` explains each key.
    """
    if not isinstance(table, Mapping) or not all(isinstance(key, str) for key in table):
        raise InputError("case", said(table), "keys and tables as in a case.toml")
    given, place = dict(table), path(folder, "folder").resolve()
    if "domain" not in given:
        given = _with_units(MuscleCase, given)
    if isinstance(effects := given.get("effect"), list | tuple):
        given["effect"] = [_effect(entry) for entry in effects]
    return made(given, {"name": name, "folder": place, "place": "case"})


def _effect(entry: Any) -> Any:
    if isinstance(entry, Record):
        values = {key: value for key, value in entry.model_dump(by_alias=True).items() if value is not None}
        entry = {"name": name_of(entry)} | values
    if isinstance(entry, Mapping) and entry.get("name") in names(Record):
        return _with_units(find(str(entry["name"])), dict(entry))
    return entry


def _with_units(annotation: Any, value: Any, unit: str = "") -> Any:
    """A ``value`` of type ``annotation`` in which each number is replaced by text with a unit, if its field has a unit.

    ``unit``: the unit of ``value`` itself.
    """
    if isinstance(value, Mapping):
        records = [kind for kind in kinds(annotation) if isinstance(kind, type) and issubclass(kind, Record)]
        fields = {name: field for record in records for name, field in record.model_fields.items()}
        return {
            key: _with_units(fields[key].annotation, one, field_unit(fields[key])) if key in fields else one
            for key, one in value.items()
        }
    if isinstance(value, list | tuple) and not unit:
        return [_with_units(annotation, one) for one in value]
    return value if value is None else written(value, unit)
