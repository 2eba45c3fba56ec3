"""Provenance of every number: the effects, the runs and the file of the case."""

import json
from pathlib import Path
from typing import Any

from fem_reference.assessment.comparison import Comparison
from fem_reference.assessment.second_check import RECORD
from fem_reference.foundations.errors import InputError
from fem_reference.scenes import casefile
from fem_reference.scenes.case import Case


def facts(comparison: Comparison) -> dict[str, Any]:
    """The origin of each run as a table, and the text of the case file."""
    path = Path(comparison.scene.place)
    tables = [{key: value for key, value in run.origin.items() if key != RECORD} for run in comparison.runs]
    origins = [(run, _flat(table)) for run, table in zip(comparison.runs, tables, strict=True)]
    return {"origins": origins, "scene_text": path.read_text(encoding="utf-8") if path.is_file() else ""}


def _flat(table: Any, key: str = "") -> list[tuple[str, Any]]:
    """All keys and values in a nested ``table``; the keys of the levels are joined by dots."""
    if isinstance(table, dict):
        return [entry for name, value in table.items() for entry in _flat(value, f"{key}.{name}".lstrip("."))]
    return [(key, table if isinstance(table, str | float | int | None) else json.dumps(table, default=str))]


def changes(case: Case) -> list[tuple[str, Any, Any]]:
    """The keys in which a case differs from its file, with their values in the file and in the case."""
    if not case.place.endswith(".toml"):  # made without a file
        return []
    try:
        in_file = dict(_flat(_table(casefile.read(case.place))))
    except InputError as error:
        return [("the scene file", "no longer readable", str(error))]
    here = dict(_flat(_table(case)))
    changed = [key for key in in_file | here if in_file.get(key) != here.get(key)]
    return [(key, in_file.get(key, ""), here.get(key, "")) for key in changed]


def _table(case: Case) -> dict[str, Any]:
    """The case as nested tables. Entries of lists have their number as key. All effects of the file are included, even those that
    are left out.
    """
    effects = [one.effect for one in case.decisions] or case.effects
    listed: dict[str, Any] = {"effect": [effect.model_dump(mode="json") for effect in effects]}
    listed |= {"choice": "auto"} if case.decisions else {}
    return dict(_numbered(case.model_dump(mode="json", exclude={"folder", "effect"}) | listed))


def _numbered(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _numbered(inside) for key, inside in value.items()}
    if isinstance(value, list):
        return {f"[{i}]": _numbered(inside) for i, inside in enumerate(value)}
    return value
