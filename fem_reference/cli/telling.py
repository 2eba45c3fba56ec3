"""What a command says, and where: on standard output, as JSON, as exit status."""

import argparse
import json
from pathlib import Path
from typing import Any

from fem_reference.io import files

DONE, VERDICT_FAIL, BAD_INPUT, SOLVER_FAILED = range(4)
INTERRUPTED, TERMINATED = 130, 143  # what shells report for them


def lines(facts: dict[str, Any], indent: str = "") -> list[str]:
    """Nested facts as indented lines."""
    told = []
    for key, value in facts.items():
        if isinstance(value, dict):
            told += [f"{indent}{key}:", *lines(value, indent + "  ")]
        elif isinstance(value, list):
            told += [f"{indent}{key}:", *(f"{indent}  {entry}" for entry in value)]
        else:
            told.append(f"{indent}{key}: {value:.6g}" if isinstance(value, float) else f"{indent}{key}: {value}")
    return told


def out(options: argparse.Namespace) -> Path:
    """Where pages and stored runs go."""
    return options.out if options.out is not None else Path("reports")


def tell(facts: dict[str, Any], text: str, options: argparse.Namespace) -> None:
    """Print ``text``, and write ``facts`` as JSON where that is wanted."""
    print(text)
    if options.json is not None:
        options.json.parent.mkdir(parents=True, exist_ok=True)
        files.write_text(options.json, json.dumps(facts, indent=1, allow_nan=False))
