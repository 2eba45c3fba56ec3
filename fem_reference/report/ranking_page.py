"""The page ``table-5-1``: speed and accuracy of solvers in numbers, where the report has plus and minus signs."""

import math
from typing import Any

from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator

from fem_reference.assessment import ranking
from fem_reference.assessment.fronts import LOAD, LOADED
from fem_reference.assessment.solver_table import SolverResult, Table, report_speeds
from fem_reference.io.texts import finite
from fem_reference.metrics import described
from fem_reference.report.drawings import Drawing, drawn, logarithmic, looks
from fem_reference.report.pages import Page
from fem_reference.report.words import under_load

# The columns of the tables of scenes: metric, statistic, heading, unit.
COLUMNS = tuple((*key, one.label, one.full_unit) for key, one in described("solvers").items())
# The columns of the first table, which covers all scenes.
OVER_ALL = tuple((*key, one.label, one.full_unit) for key, one in described("scenes").items())
_MARKS = "osD^vPX*<>"


def page(table: Table) -> Page:
    """The page of all kinds of solvers."""
    contents = {
        "table": table,
        "columns": COLUMNS,
        "over_all": OVER_ALL,
        "report_speeds": report_speeds(),
        "load": _load(table),
        "drawing": _drawing(table),
    }
    said = f"{len(table.results)} results on {len(table.scenarios)} scenes"
    return Page("ranking", "Table 5.1 in numbers", (("", "", said),), "ranking_page.html", contents, facts(table))


def _load(table: Table) -> str:
    """A warning if solvers were timed on a machine that was busy with other work; otherwise empty."""
    timed = (one.outcome.cost for one in table.results if one.seconds_per_frame)
    return under_load((cost.get(LOAD, math.nan) for cost in timed), LOADED)


def facts(table: Table) -> dict[str, Any]:
    """The contents of the page as valid JSON: a number that is not finite is None."""
    scenarios = [
        {"case": one.case, "triangles": one.triangles, "travel_mm": one.travel}
        | {"reference": one.reference.status, "message": one.reference.message}
        for one in table.scenarios
    ]
    return {
        "scenarios": scenarios,
        "missing": table.missing,
        "report": [one.model_dump(mode="json", exclude={"of_case"}) for one in table.kinds],
        "results": [_row(one) for one in table.results],
        "rankings": {one.case: ranking.facts(table.rankings(one.case)) for one in table.scenarios},
        "versions": table.versions,
        "machines": list(table.machines),
    }


def text(table: Table) -> str:
    """The results as lines of text, one for each scene and solver."""
    lines = []
    for one in table.results:
        found = (one.worst("surface_deviation", "rms"), one.worst("volume", "deviation"))
        text = [
            f"{name} {value[0]:.3g} {unit}"
            for name, unit, value in zip(("surface rms", "volume"), ("mm", "%"), found, strict=True)
            if value is not None
        ]
        if one.seconds_per_frame:
            text.insert(0, f"{1 / one.seconds_per_frame:.3g} frames/s")
        known = " (its error bar)" if one.of_reference and one.measures else ""
        lines.append(f"{one.case}: {one.kind}, {one.name}: {one.outcome.status}, {', '.join(text)}{known}")
    lines += [warning] if (warning := _load(table)) else []
    return "\n".join([*lines, *(f"{case}: left out, {reason}" for case, reason in table.missing.items())])


def _row(one: SolverResult) -> dict[str, Any]:
    worst = {}
    for metric, statistic, _, unit in COLUMNS:
        found = one.worst(metric, statistic)
        worst[f"{metric}.{statistic}"] = found and {"value": finite(found[0]), "frame": found[1], "unit": unit}
    named = {name: getattr(one, name) for name in ("kind", "name", "solver", "case", "seconds_per_frame")}
    ended = {"status": one.outcome.status, "message": one.outcome.message}
    spent = {"seconds_processor": one.outcome.cost.get("seconds_processor")}
    return {**named, "needs": dict(one.needs), **ended, **spent, "worst": worst}


def _drawing(table: Table) -> Drawing:
    """A drawing of the surface deviation of every solver on every scene against its time per frame number. Colours distinguish
    solvers, and marks distinguish scenes.
    """
    shown = [(one, place) for one in table.results if (place := _place(one)) is not None]
    # The reference is drawn first.
    colours = looks(_label_of(one) for one, _ in sorted(shown, key=lambda pair: not pair[0].of_reference))
    marks = {scenario.case: _MARKS[i % len(_MARKS)] for i, scenario in enumerate(table.scenarios)}

    def draw(figure: Figure, axes: Axes) -> None:
        for one, (x, y) in shown:
            look: dict[str, Any] = {"markerfacecolor": "white"} if one.of_reference else {}
            axes.plot(
                [x], [y], marks[one.case], color=colours[_label_of(one)]["color"], markersize=7, alpha=0.85, **look
            )
        logarithmic(axes)
        for axis in (axes.xaxis, axes.yaxis):
            axis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
        axes.set(xlabel="time for a frame number, ms", ylabel="% of the maximum displacement")
        handles = [axes.plot([], [], "o", color=one["color"], label=name)[0] for name, one in colours.items()]
        handles += [axes.plot([], [], mark, color="#777777", label=case)[0] for case, mark in marks.items()]
        figure.legend(handles=handles, loc="outside right upper")

    title = "Surface deviation (rms, worst frame) against the time for a frame number"
    return drawn("ranking", title, (9.6, 4.6), draw)


def _label_of(one: SolverResult) -> str:
    """The name of a solver. A solver that is not ours has its kind added, as its name may be that of one of our solvers."""
    ours = one.of_reference or one.solver != "recorded"
    return one.name if ours else f"{one.name} ({one.kind.lower()})"


def _place(one: SolverResult) -> tuple[float, float] | None:
    worst = one.worst("surface_deviation", "rms_percent")
    if worst is None or one.seconds_per_frame is None or not (math.isfinite(worst[0]) and worst[0] > 0):
        return None
    return 1000 * one.seconds_per_frame, worst[0]
