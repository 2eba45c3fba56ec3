"""The page of the verification catalogue."""

import math
from collections import Counter
from collections.abc import Iterable
from typing import Any

from fem_reference.assessment.catalogue import Result, Verification
from fem_reference.io.texts import finite
from fem_reference.report import verify_figures
from fem_reference.report.pages import Page
from fem_reference.report.words import duration

_OF_ENTRY = ("name", "group", "title", "unit", "kind", "relative", "because", "source", "negative_control")
_HEADS = ("entry", "value", "truth", "unit", "error", "within", "order", "seconds", "verdict")


def page(verification: Verification) -> Page:
    """The page of the results of entries."""
    results = verification.results
    passed = f"{len(results) - len(verification.failed)} of {len(results)} pass"
    contents = {
        "verification": verification,
        "kinds": Counter(one.entry.kind for one in results),
        "share": verify_figures.share,
        "spent": duration(math.fsum(one.seconds for one in results)),
        "overview": verify_figures.overview(verification.groups),
        "ladders": [verify_figures.convergence(one) for one in results if verify_figures.drawable(one)],
    }
    said = (("", verification.word, passed),)
    title = "Verification: problems whose answers are known"
    return Page("verification", title, said, "verify_page.html", contents, facts(verification))


def text(verification: Verification) -> str:
    """One line for each result, in columns below their heads, and the verdict."""
    rows = [_HEADS, *map(_cells, verification.results)]
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    sides = ["<" if head in ("entry", "unit", "verdict") else ">" for head in _HEADS]
    layout = list(zip(sides, widths, strict=True))
    lines = [
        "  ".join(f"{cell:{side}{width}}" for cell, (side, width) in zip(row, layout, strict=True)) for row in rows
    ]
    return "\n".join([*(line.rstrip() for line in lines), verification.summary])


def _cells(one: Result) -> tuple[str, ...]:
    numbers = (f"{one.finding.value:.6g}", f"{one.truth:.6g}", one.entry.unit, f"{one.error:.2g}", f"{one.within:.2g}")
    order = "" if one.finding.order is None else f"{one.finding.order:.2f}"
    note = " (negative control)" if one.with_negative_control else ""
    return (one.entry.name, *numbers, order, f"{one.seconds:.1f}", one.word + note)


def facts(verification: Verification) -> dict[str, Any]:
    """All of it as valid JSON: a number that is not finite is None."""
    return {
        "verdict": verification.word,
        "passed": len(verification.results) - len(verification.failed),
        "of": len(verification.results),
        "seconds": verification.seconds,
        "versions": verification.versions,
        "entries": rows(verification.results),
    }


def rows(results: Iterable[Result]) -> list[dict[str, Any]]:
    """Each result with its entry as names, numbers and sentences."""
    return [
        {
            **{name: getattr(one.entry, name) for name in _OF_ENTRY},
            "verdict": one.word,
            "value": finite(one.finding.value),
            **{name: finite(getattr(one, name)) for name in ("truth", "error", "within")},
            "order": None if one.finding.order is None else finite(one.finding.order),
            "ladder": [[finite(size), finite(value)] for size, value in one.finding.ladder],
            "seconds": one.seconds,
            "note": one.finding.note,
            "with_negative_control": one.with_negative_control,
        }
        for one in results
    ]
