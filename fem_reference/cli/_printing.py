"""Output of commands: on standard output, as JSON, as exit status."""

import argparse
import json
from pathlib import Path
from typing import Any

DONE, VERDICT_FAIL, BAD_INPUT, SOLVER_FAILED = range(4)
# Our own mistake, EX_SOFTWARE of sysexits.h. Python's own status for it is 1, which here is a verdict.
BROKEN = 70
INTERRUPTED, TERMINATED = 130, 143  # what shells report for them


def lines(facts: dict[str, Any], indent: str = "") -> list[str]:
    """Nested facts as indented lines."""
    printed = []
    for key, value in facts.items():
        if isinstance(value, dict):
            printed += [f"{indent}{key}:", *lines(value, indent + "  ")]
        elif isinstance(value, list):
            printed += [f"{indent}{key}:", *(f"{indent}  {entry}" for entry in value)]
        else:
            printed.append(f"{indent}{key}: {value:.6g}" if isinstance(value, float) else f"{indent}{key}: {value}")
    return printed


def out(options: argparse.Namespace) -> Path:
    """The folder of pages and stored runs."""
    return options.out if options.out is not None else Path("reports")


def write_output(facts: dict[str, Any], text: str, options: argparse.Namespace) -> None:
    """Print ``text``, and write ``facts`` as JSON where that is wanted."""
    print(text)
    if options.json is not None:
        write(options.json, json.dumps(facts, indent=1, allow_nan=False))


def write(path: Path | None, text: str) -> None:
    """Write a file that is wanted, below a folder that may be new."""
    if path is not None:
        from fem_reference.io import files

        path.parent.mkdir(parents=True, exist_ok=True)
        files.write_text(path, text)
