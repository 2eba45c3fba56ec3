"""Stored measurements, and the tables made from them."""

import json
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any, NamedTuple

KEPT = Path(__file__).parent.parent / "measured"
SURFACE, PROCESSOR = "surface_deviation.rms", "seconds_processor"


class Measurement(NamedTuple):
    """A ``command``, run for each of the ``cases``, if any, as CASE; ``keep`` selects from its JSON what the tables need."""

    command: str
    keep: Callable[[Any], Any]
    cases: tuple[str, ...] = ()


def kept(name: str) -> dict[str, Any]:
    """A stored measurement."""
    return json.loads((KEPT / f"{name}.json").read_text(encoding="utf-8"))


def table(name: str, head: Iterable[str], rows: Iterable[Iterable[object]]) -> str:
    """A table in Markdown, with the origin of its numbers below it."""
    lines = [list(head), ["---"] * len(list(head)), *([str(cell) for cell in row] for row in rows)]
    return "\n".join("| " + " | ".join(line) + " |" for line in lines) + f"\n\n<small>{origin(name)}</small>\n"


def origin(name: str) -> str:
    """The command of a stored measurement, with its date, commit and machine."""
    file = kept(name)
    return f"`{file['command']}`, {file['date']}, commit `{file['commit']}`, {file['machine']}"


def number(value: float | None, digits: int = 3) -> str:
    """A number, rounded for readers."""
    if value is None:
        return "not known"
    return f"{value:.0f}" if abs(value) >= 10**digits else f"{value:.{digits}g}"


def only(found: dict[str, Any], names: Iterable[str]) -> dict[str, Any]:
    """The entries of ``found`` that have one of the ``names``."""
    return {name: found[name] for name in names if name in found}
