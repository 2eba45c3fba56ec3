"""Pictures of the pages, drawn from the measurements in ``docs/measured`` when the pages are built.

``fill`` replaces each ``<!-- drawn: NAME -->`` by a picture. A solver has the same colour on all pages.
"""

import re
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from measurements import kept, origin

from fem_reference import report
from fem_reference.assessment.cost_study import CaseStudy
from fem_reference.foundations.records import parse
from fem_reference.report import claims_page, study_page
from fem_reference.report.drawings import BAND, Drawing, drawn, looks, plain_numbers
from fem_reference.report.recommendation_texts import answer_texts

_SURFACE = "surface_deviation.rms"
_VERDICTS = {"ok": "#14713a", "degraded": "#b98a2e", "failed": "#b3261e", "": "#bbbbbb"}


def fill(text: str) -> str:
    """``text`` of a page with its pictures."""
    return re.sub(r"<!-- drawn: (\w+) -->\n", lambda found: _placed(found[1]), text)


def dark_colours() -> dict[str, str]:
    """The colours of drawings in the dark style, by name."""
    style = (Path(report.__file__).parent / "style.css").read_text(encoding="utf-8")
    return dict(re.findall(r"--([\w-]+): (#\w+)", re.findall(r":root \{(.*?)\}", style, re.DOTALL)[1]))


def _placed(name: str) -> str:
    measurement, draw = DRAWN[name]
    found = draw(kept(measurement)["measured"])
    said = re.sub("`(.*?)`", r"<code>\1</code>", f"{found.title.rstrip('.')}. {origin(measurement)}")
    return f'```{{raw}} html\n<div class="drawn">{found.markup}</div>\n<p class="caption-of">{said}</p>\n```\n'


def cost_front(measured: dict[str, Any]) -> Drawing:
    """Error against time of every setting of every solver, and the fronts, with the answers of the verb recommend."""
    case = parse(CaseStudy, measured, "fronts")
    said = answer_texts(study_page.answered(case), case.units[_SURFACE])
    answers = (f"{i}: {text[0].lower()}{text[1:]}" for i, text in enumerate(said, 1))
    title = ". ".join(("Fronts and recommended settings", *answers, study_page.load_of(case.points).capitalize()))
    return replace(study_page.front(case, _SURFACE), title=title)


def bars_and_errors(measured: dict[str, Any]) -> Drawing:
    """Error bars of coarser meshes against their true errors."""
    claims = parse(CaseStudy, measured, "fronts").claims
    return claims_page.drawing(claims, "surface_deviation", "claims")


def solvers_on_muscles(measured: list[dict[str, Any]]) -> Drawing:
    """The error of each solver on each muscle, and the error bars of the references."""
    cases = list(dict.fromkeys(one["case"] for one in measured))

    def draw(figure: Figure, axes: Axes) -> None:
        known = [one for one in measured if one["status"] == "converged" and _SURFACE in one["worst"]]
        shown = looks(one["name"] for one in known if one["name"] != "reference")
        for shift, (name, look) in zip(np.linspace(-0.3, 0.3, len(shown)), shown.items(), strict=True):
            rows = [one for one in known if one["name"] == name]
            places = [cases.index(one["case"]) + shift for one in rows]
            axes.plot(places, [one["worst"][_SURFACE] for one in rows], "o", color=look["color"], label=name)
        bars = [one for one in known if one["name"] == "reference"]
        tops = [one["worst"][_SURFACE] for one in bars]
        axes.set(yscale="log", ylim=(min(tops) / 2, None), ylabel="surface, rms, mm")
        axes.bar([cases.index(one["case"]) for one in bars], tops, color=BAND, label="error bar of the reference")
        axes.set_xticks(range(len(cases)), cases, rotation=12)
        axes.grid(axis="x", visible=False)
        axes.set_axisbelow(True)
        plain_numbers(axes.yaxis)
        figure.legend(loc="outside lower center", ncols=4, fontsize="small")

    return drawn("solvers", "Error of each solver on five muscles", (7.2, 4.4), draw)


def omissions(measured: list[dict[str, Any]]) -> Drawing:
    """The change of the surface if an effect or a feature is omitted."""
    rows = [one for one in measured if one["changes"][0] is not None][::-1]

    def draw(_: Figure, axes: Axes) -> None:
        for name, look in looks(one["of"] for one in reversed(rows)).items():
            own = [(i, one["changes"][0]) for i, one in enumerate(rows) if one["of"] == name]
            axes.barh(*zip(*own, strict=True), color=look["color"], height=0.6, label=name)
        names = [", ".join(one["left_out"]).replace("_", " ") for one in rows]
        axes.set_yticks(range(len(rows)), names)
        axes.set_xlabel("change of the surface, rms, mm")
        _only_along(axes)
        axes.legend(loc="lower right", fontsize="small")

    return drawn("omissions", "Change if an effect or a feature is omitted", (7.2, 3.2), draw)


def matrix(measured: dict[str, Any]) -> Drawing:
    """The verdict of each hard case and solver."""
    cases, solvers = measured["cases"], [one["solver"] for one in measured["counts"]]
    colours = _VERDICTS | {"no solution": "#56b4e9", "inconclusive": "#cc79a7", "not applicable": "#e8e8e8"}

    def draw(figure: Figure, axes: Axes) -> None:
        for verdict in filter(None, colours):
            places = [
                (x, y) for y, row in enumerate(measured["verdicts"]) for x, one in enumerate(row) if one == verdict
            ]
            if places:
                axes.scatter(*zip(*places, strict=True), marker="s", s=60, color=colours[verdict], label=verdict)
        axes.set_xticks(range(len(solvers)), solvers, rotation=90)
        axes.set_yticks(range(len(cases)), cases, fontsize="small")
        axes.xaxis.tick_top()
        axes.invert_yaxis()
        axes.grid(visible=False)
        figure.legend(loc="outside lower center", ncols=6, fontsize="small")

    return drawn("matrix", "Hard cases by solver", (7.2, 1.6 + 0.19 * len(cases)), draw)


def hard_cases(measured: dict[str, Any]) -> Drawing:
    """The number of hard cases with each verdict for each solver; the matrix, if the verdict of each case was measured."""
    if "verdicts" in measured:
        return matrix(measured)
    rows = [one for one in measured["counts"] if sum(one.get(key, 0) for key in _VERDICTS if key)][::-1]

    def draw(figure: Figure, axes: Axes) -> None:
        lefts = [0] * len(rows)
        for verdict, colour in _VERDICTS.items():
            counts = [_count(one, verdict) for one in rows]
            label = verdict or "not applicable, or no solution"
            axes.barh([one["solver"] for one in rows], counts, left=lefts, color=colour, height=0.7, label=label)
            lefts = [left + count for left, count in zip(lefts, counts, strict=True)]
        axes.set_xlabel("hard cases")
        _only_along(axes)
        figure.legend(loc="outside lower center", ncols=4, fontsize="small")

    return drawn("hard", "Hard cases by solver", (7.2, 3.6), draw)


def _only_along(axes: Axes) -> None:
    """Show only the grid lines of the value axis, behind the horizontal bars."""
    axes.grid(axis="y", visible=False)
    axes.set_axisbelow(True)


def _count(row: dict[str, Any], verdict: str) -> int:
    """The number of cases of a solver with a verdict; "" counts all other verdicts."""
    if verdict:
        return row.get(verdict, 0)
    return sum(count for key, count in row.items() if key != "solver" and key not in _VERDICTS)


DRAWN: dict[str, tuple[str, Callable[[Any], Drawing]]] = {
    "cost_front": ("fronts", cost_front),
    "bars_and_errors": ("fronts", bars_and_errors),
    "solvers_on_muscles": ("table_5_1", solvers_on_muscles),
    "omissions": ("effects", omissions),
    "hard_cases": ("stress", hard_cases),
}
