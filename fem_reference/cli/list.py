"""The verb ``list``: cases, solvers, metrics and stored runs."""

import argparse
import json
import os
from pathlib import Path
from typing import Any

from fem_reference import metrics, solvers
from fem_reference.cli import DONE, out, write_output
from fem_reference.runs import store
from fem_reference.scenes import casefile
from fem_reference.scenes.case import DATA_SETTING, Case

HELP = "list cases and whether their data is installed, solvers with their settings, metrics, stored runs"
REQUIRED = "required"


def add_options(parser: argparse.ArgumentParser) -> None:
    """Add no options; the verb writes nothing into ``--out``."""
    parser.set_defaults(writes=False)


def run(options: argparse.Namespace) -> int:
    """Print the lists."""
    scenes = [casefile.read(name) for name in casefile.cases()]
    data = {scene.name: missing for scene in scenes if (missing := _data(scene)) is not None}
    known, runs = {name: _settings(name) for name in solvers.names()}, (out(options) / "runs").rglob("run.json")
    status = {path.parent: store.status(path.parent) for path in sorted(runs)}
    stored = [str(folder) if end == "converged" else f"{folder} ({end})" for folder, end in status.items()]
    facts: dict[str, Any] = {"cases": {scene.name: scene.title for scene in scenes}, "data": data}
    facts |= {"solvers": solvers.names(), "settings": known, "metrics": metrics.names(), "runs": stored}
    needs = {name: f" [needs data{f': {missing}' if missing else ', installed'}]" for name, missing in data.items()}
    width = max(len(scene.name) for scene in scenes)
    lines = ["cases:", *(f"  {scene.name:{width}}  {scene.title}{needs.get(scene.name, '')}" for scene in scenes)]
    lines += ["solvers, with their settings and defaults:"]
    lines += [f"  {name:{width}}  {_in_words(settings)}" for name, settings in known.items()]
    lines += [f"metrics: {', '.join(facts['metrics'])}"]
    lines += ["stored runs:", *(f"  {path}" for path in stored)] if stored else []
    write_output(facts, "\n".join(lines), options)
    return DONE


def _data(case: Case) -> str | None:
    """The reason why the data of a case is missing, or "" if the data is present; None for a case that needs no data."""
    root = os.environ.get(DATA_SETTING)
    if not case.needed_data:
        return None
    if not root:
        return f"{DATA_SETTING} is not set"
    lacking = [name for name in case.needed_data if not (Path(root) / name).exists()]
    return f"{DATA_SETTING} has no {lacking[0]}" if lacking else ""


def _settings(name: str) -> dict[str, Any]:
    """The settings of a solver with their defaults, for all kinds of problems that it solves."""
    found: dict[str, Any] = {}
    for offer in solvers.offers(name):
        fields = offer.settings.model_fields
        found |= {key: REQUIRED for key, field in fields.items() if field.is_required()}
        stated = {*offer.settings.model_fields}  # without the computed hashes of files, which may not exist
        found |= offer.settings.model_construct().model_dump(mode="json", include=stated, warnings=False)
    return found


def _in_words(settings: dict[str, Any]) -> str:
    needed = ", ".join(key for key, value in settings.items() if value == REQUIRED)
    given = {key: value for key, value in settings.items() if value != REQUIRED}
    known = ", ".join(f"{key} = {'none' if value is None else json.dumps(value)}" for key, value in given.items())
    return "; ".join(filter(None, [f"{needed} (required)" if needed else "", known])) or "none"
