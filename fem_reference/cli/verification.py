"""The verb ``verify``; it returns its output."""

import time

from fem_reference import __version__
from fem_reference.assessment.catalogue import Result
from fem_reference.cli.scalar import Printed
from fem_reference.report.verify_page import Verification, facts
from fem_reference.runs.key import versions
from fem_reference.verification import runner

_HEADS = ("entry", "value", "truth", "unit", "error", "within", "order", "seconds", "verdict")


def verify(names: list[str], with_negative_control: list[str]) -> Verification:
    """The results of the entries meant by ``names`` and ``with_negative_control`` (all where both are empty)."""
    from fem_reference.verification.lab import lab  # loads the solvers

    catalogue = runner.entries()
    wrong = frozenset(runner.choose(catalogue, with_negative_control, "--negative-control"))
    meant = {*runner.choose(catalogue, names, "NAME"), *wrong}
    wanted = [entry for name, entry in catalogue.items() if name in meant or not meant]
    begin = time.perf_counter()
    results = runner.run(wanted, lab, wrong)
    made_with = {"fem_reference": __version__, **versions()}
    return Verification(results, time.perf_counter() - begin, made_with)


def printed(verification: Verification) -> Printed:
    """The output of a verification."""
    text = [*_lines(verification.results), verification.summary]
    return Printed(facts(verification), "\n".join(text), verification.word)


def _lines(results: tuple[Result, ...]) -> list[str]:
    """One line for each result, in columns below their heads."""
    rows = [_HEADS, *map(_cells, results)]
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    left = [head in ("entry", "unit", "verdict") for head in _HEADS]
    return [
        "  ".join(
            f"{cell:{'<' if first else '>'}{width}}" for cell, first, width in zip(row, left, widths, strict=True)
        ).rstrip()
        for row in rows
    ]


def _cells(one: Result) -> tuple[str, ...]:
    order = "" if one.finding.order is None else f"{one.finding.order:.2f}"
    numbers = (f"{one.finding.value:.6g}", f"{one.truth:.6g}", one.entry.unit, f"{one.error:.2g}", f"{one.within:.2g}")
    return (
        one.entry.name,
        *numbers,
        order,
        f"{one.seconds:.1f}",
        one.word + (" (negative control)" if one.with_negative_control else ""),
    )
