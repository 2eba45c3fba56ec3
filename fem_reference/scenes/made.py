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
    """Make a case from the keys and tables of a ``case.toml`` (``cases/hip_flexion/case.toml`` explains each), without a file.

    A ``table`` with a ``domain`` is the case of a scalar field; any other is the case of a muscle. Instead of text with a unit,
    numbers in mm, N, MPa, s, rad and tonne are accepted too. Effects may be made by :func:`fem_reference.make_effect`.
    ``candidate``, ``expect`` and ``negative_control`` may be left out. Files are named relative to ``folder``; pages show the
    ``name``. An InputError for a missing, unknown or wrong key names the key, the given value and the expected value.
    """
    if not isinstance(table, Mapping) or not all(isinstance(key, str) for key in table):
        raise InputError("case", said(table), "keys and tables, as a case.toml has them")
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
    """``value`` with every number as text with its unit, if the field of the records in ``annotation`` has a unit."""
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
