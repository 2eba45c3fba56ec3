"""The page of the verification catalogue."""

import math
from collections import Counter
from collections.abc import Iterable
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import FixedLocator, LogLocator, NullFormatter, NullLocator

from fem_reference.assessment.catalogue import Result, Verification
from fem_reference.foundations.mesh import Floats
from fem_reference.io.texts import finite, plain
from fem_reference.report.drawings import PALETTE, Drawing, drawn, positive
from fem_reference.report.pages import Page
from fem_reference.report.words import duration, number, words

_OF_ENTRY = ("name", "group", "title", "unit", "kind", "relative", "because", "source", "negative_control")
_HEADS = ("entry", "value", "truth", "unit", "error", "within", "order", "seconds", "verdict")
PASS, FAIL = "#14713a", "#b3261e"
# The range of error / tolerance in the overview; values outside the range are drawn at its edge.
LEAST, GREATEST = 1e-8, 1e3
_ROW = 0.175  # height of a row of the overview [inches]


def page(verification: Verification) -> Page:
    """The page of the results of a verification."""
    results = verification.results
    judged = {name: [one for one in group if one in verification.judged] for name, group in verification.groups.items()}
    contents = {
        "verification": verification,
        "kinds": Counter(one.entry.kind for one in results),
        "share": share,
        "spent": duration(math.fsum(one.seconds for one in results)),
        "overview": overview(shown) if (shown := {name: group for name, group in judged.items() if group}) else None,
        "ladders": [convergence(one) for one in results if drawable(one)],
    }
    said = (("", verification.word, ", ".join(filter(None, (verification.passed, verification.beside)))),)
    title = "Verification: problems whose answers are known"
    return Page("verification", title, said, "verify_page.html", contents, facts(verification))


def text(verification: Verification) -> str:
    """A table with headings and one line for each result, followed by the verdict."""
    rows = [_HEADS, *map(_cells, verification.results)]
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    sides = ["<" if head in ("entry", "unit", "verdict") else ">" for head in _HEADS]
    layout = list(zip(sides, widths, strict=True))
    cells = ([f"{cell:{side}{width}}" for cell, (side, width) in zip(row, layout, strict=True)] for row in rows)
    lines = ["  ".join(row) for row in cells]
    return "\n".join([*(line.rstrip() for line in lines), verification.summary])


def _cells(one: Result) -> tuple[str, ...]:
    numbers = (f"{one.finding.value:.6g}", f"{one.truth:.6g}", one.entry.unit, f"{one.error:.2g}", f"{one.within:.2g}")
    order = "" if one.finding.order is None else f"{one.finding.order:.2f}"
    note = " (negative control)" if one.with_negative_control else ""
    return (one.entry.name, *numbers, order, f"{one.seconds:.1f}", one.word + note)


def facts(verification: Verification) -> dict[str, Any]:
    """The contents of the page as valid JSON: a number that is not finite is None."""
    return {
        "verdict": verification.word,
        "passed": sum(one not in verification.failed for one in verification.judged),
        "of": len(verification.judged),
        "experiments": verification.beside,
        "seconds": verification.seconds,
        "versions": verification.versions,
        "entries": rows(verification.results),
    }


def rows(results: Iterable[Result]) -> list[dict[str, Any]]:
    """A dictionary for each result, with the facts about its entry."""
    return [
        {
            **{name: getattr(one.entry, name) for name in _OF_ENTRY},
            "verdict": one.word,
            "value": finite(one.finding.value),
            **{name: finite(getattr(one, name)) for name in ("truth", "error", "within")},
            **plain({name: getattr(one.finding, name) for name in ("order", "ladder")}),
            "seconds": one.seconds,
            "note": one.finding.note,
            "with_negative_control": one.with_negative_control,
        }
        for one in results
    ]


def share(one: Result) -> float:
    """The error divided by its tolerance; NaN if nothing was measured. With a tolerance of 0, it is infinite for any error."""
    if one.within > 0:
        return one.error / one.within
    return one.error * math.inf if one.error else 0.0


def overview(groups: dict[str, list[Result]]) -> Drawing:
    """A drawing of the error of every result divided by its tolerance, in groups."""
    results = [one for group in groups.values() for one in group]
    shown = [share(one) for one in results if LEAST <= share(one) <= GREATEST]
    low = 10.0 ** math.floor(math.log10(min([0.1, *shown]))) / 3
    high = 10.0 ** math.ceil(math.log10(max([3.0, *shown])))

    def draw(figure: Figure, axes: Axes) -> None:
        row = 0
        side: dict[str, Any] = {"transform": axes.get_yaxis_transform(), "ha": "right", "va": "center"}
        for group, members in groups.items():
            axes.text(-0.01, row, words(group), weight="bold", **side)
            axes.axhline(row - 0.7, color="#dddddd", linewidth=0.8)
            for place, one in enumerate(members, row + 1):
                axes.text(-0.01, place, one.entry.name, color="#1d1d1f" if one.word == "pass" else FAIL, **side)
                _dot(axes, place, one, (low, high))
            row += len(members) + 1
        axes.set_ylim(row - 0.3, -0.7)
        _style_overview(figure, axes, (low, high))

    rows = len(results) + len(groups)
    title = "Error divided by the tolerance"
    return drawn("verify-overview", title, (9.6, 0.9 + _ROW * rows), draw)


def _dot(axes: Axes, row: int, one: Result, limits: tuple[float, float]) -> None:
    """Draw error / tolerance of a result: as a hollow triangle beyond the edge of the range, and as a cross for NaN."""
    low, high = limits
    value = share(one)
    look: dict[str, Any] = {"color": PASS if one.word == "pass" else FAIL, "clip_on": False, "markersize": 5.5}
    if math.isnan(value):
        axes.plot([high], [row], "x", **look)
    elif low < value <= high:
        axes.plot([value], [row], "s" if one.with_negative_control else "o", **look)
    else:
        axes.plot([min(max(value, low), high)], [row], "<" if value <= low else ">", markerfacecolor="white", **look)


def _style_overview(figure: Figure, axes: Axes, limits: tuple[float, float]) -> None:
    axes.axvspan(1.0, limits[1], color=FAIL, alpha=0.05, linewidth=0)
    axes.axvline(1.0, color=FAIL, linewidth=1.4)
    axes.set(xscale="log", xlim=limits)
    axes.xaxis.set_major_locator(LogLocator(numticks=12))
    axes.xaxis.set_minor_formatter(NullFormatter())
    axes.set_yticks([])
    axes.grid(visible=True, axis="x")
    axes.tick_params(top=True, labeltop=True)
    axes.set_xlabel("error / tolerance")
    marks = {
        "passes": ("o", PASS, PASS),
        "fails": ("o", FAIL, FAIL),
        "fails, negative control": ("s", FAIL, FAIL),
        "smaller than shown, or exactly zero": ("<", PASS, "white"),
        "greater than shown": (">", FAIL, "white"),
        "not a number": ("x", FAIL, FAIL),
    }
    handles = [
        Line2D([], [], linestyle="", marker=mark, color=colour, markerfacecolor=inner, label=label, markersize=5.5)
        for label, (mark, colour, inner) in marks.items()
    ]
    figure.legend(
        handles=handles, loc="outside upper left", ncols=6, handlelength=1, columnspacing=1.4, borderaxespad=0
    )


def drawable(one: Result) -> bool:
    """True if the errors of two or more meshes can be drawn on a logarithmic axis."""
    return len(_errors(one)[0]) > 1


def convergence(one: Result) -> Drawing:
    """A drawing of error against mesh size on logarithmic axes. The slope of a dashed line is the integer nearest to the order."""
    sizes, errors = _errors(one)
    order = one.finding.order

    def draw(_: Figure, axes: Axes) -> None:
        known = order is not None and math.isfinite(order)
        axes.loglog(sizes, errors, "o-", color=PALETTE[0], label=f"order {number(order)}" if known else "no order")
        if known and order is not None and round(order) > 0:
            power = round(order)
            guide = errors[-1] * (sizes / sizes[-1]) ** power
            axes.loglog(sizes, guide, "--", color="#888888", linewidth=1, label=f"slope {power}", zorder=1)
        axes.xaxis.set_major_locator(FixedLocator(list(sizes)))
        axes.xaxis.set_minor_locator(NullLocator())
        axes.xaxis.set_major_formatter(lambda size, _: number(size))
        axes.set(xlabel="mesh size [mm]", ylabel=f"error [{one.entry.unit}]")
        axes.legend(handlelength=2)

    return drawn(f"ladder-{one.entry.name}", one.entry.name, (3.7, 2.7), draw)


def _errors(one: Result) -> tuple[Floats, Floats]:
    """Sizes and errors of the meshes whose error is a positive number."""
    sizes, values = np.array(one.finding.ladder, float).reshape(-1, 2).T
    return positive(sizes, np.abs(values - one.truth))
