"""The page of a study: error against cost, the best solver at equal cost or error, and the cost of halving the error."""

import json
from collections.abc import Iterable, Sequence
from dataclasses import replace
from typing import Any

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from fem_reference.assessment import cost_study, fronts
from fem_reference.assessment.answers import Answer, answers
from fem_reference.assessment.claims import Cover
from fem_reference.assessment.cost_study import CaseStudy, Study
from fem_reference.assessment.fronts import COSTS, LOADED, Match, Point, Price, levels, match, solvers
from fem_reference.assessment.recommendation import known_settings, transfers
from fem_reference.metrics import described
from fem_reference.report.claims_page import UNITS as CLAIMED_UNITS
from fem_reference.report.claims_page import drawing as claims_drawing
from fem_reference.report.drawings import BAND, Drawing, drawn, logarithmic, looks
from fem_reference.report.pages import Page, by_name
from fem_reference.report.recommendation_texts import answer_texts, asked_for
from fem_reference.report.words import duration, listed, number, under_load
from fem_reference.report.words import title_of as in_words

REFERENCE = "fenicsx"
TIME = "seconds_per_frame"
# The statistic in the tables. The errors of solvers are compared at equal values of each of the costs ``MATCHED``.
MAIN = next(map(".".join, described("rank")))
MATCHED = (TIME, "peak_memory_mb", "unknowns")


def page(study: Study) -> Page:
    """The page of the cost of accuracy."""
    moved = transfers(study.cases, MAIN) if len(study.cases) > 1 else ()
    cases = [cost_study.facts(case, study.origin) for case in study.cases]
    contents = {
        "study": study,
        "main": MAIN,
        "costs": COSTS,
        "data": json.dumps(_data(study)).replace("<", "\\u003c"),
        "cover": lambda case: Cover.of(case.claims),
        "claims": lambda case: [claims_drawing(case.claims, metric, case.case) for metric in CLAIMED_UNITS],
        "transfers": moved,
        "losses": sorted(one.loss for one in moved),
        **by_name(
            shown,
            solvers,
            front,
            sentences,
            matched,
            left_out,
            title_of,
            as_measured,
            load_of,
            answered,
            answer_texts,
            asked_for,
        ),
    }
    one = cases[0] if len(cases) == 1 else None
    said = tuple(
        ("" if one else case.case, "", text)
        for case in study.cases
        for text in answer_texts(answered(case), case.units[MAIN])
    )
    title = "The cost of accuracy" + (f": {study.cases[0].title}" if one else "")
    return Page("study", title, said, "study_page.html", contents, one or cases)


def shown(case: CaseStudy) -> list[str]:
    """The statistics with a front: those with errors at two or more points. Moment arms, for example, require joints."""
    known = [name for point in case.points for name in point.errors]
    return [name for name in map(".".join, described("rank")) if known.count(name) > 1]


def title_of(name: str) -> str:
    """A statistic or a cost in words.

    >>> title_of("surface_deviation.rms"), title_of("seconds_per_frame")
    ('surface deviation, rms', 'time of a frame')
    """
    return COSTS[name][0] if name in COSTS else in_words(name)


def sentences(case: CaseStudy, error: str = MAIN) -> list[str]:
    """The price of accuracy on a case, in sentences."""
    unit, points = case.units[error], case.counted
    prices = {solver: found for solver in solvers(points) if (found := fronts.price(points, solver, error, TIME))}
    said = [_sentence(one, unit, case.bars.get(error, 0.0)) for one in prices.values()]
    others = {solver: one.best for solver, one in prices.items() if solver != REFERENCE}
    if REFERENCE in prices and others:
        nearest = min(others, key=lambda solver: others[solver])
        if prices[REFERENCE].best < others[nearest]:
            said.append(f"Only the reference gets below {number(others[nearest])} {unit}, the best of {nearest}.")
    return said


def _sentence(one: Price, unit: str, bar: float) -> str:
    best, label, time = f"{number(one.best)} {unit}", one.nearest.label, duration(one.nearest.costs[TIME])
    if one.best <= bar and not one.is_measured:
        return f"The error of {one.solver} is within the bar of the truth, {best}, at {time} a frame or more ({label})."
    reach = f"{one.count} settings, from {number(one.worst)} {unit} to {best} with {label}, {time} a frame"
    if one.factor > 1:
        verb = "costs" if one.is_measured else "would cost"
        return f"Halving the error of {one.solver} {verb} {number(one.factor)} times the time ({reach})."
    if one.count > 1:
        return f"More time hardly improves {one.solver} ({reach})."
    return f"One setting of {one.solver} is the fastest and the most accurate: {best} with {label}, {time} a frame."


def matched(case: CaseStudy, error: str = MAIN) -> list[tuple[str, str, list[Match]]]:
    """Tables at equal time, memory, unknowns and error. Each has the quantity that is equal, the quantity that is compared, and
    rows.
    """
    asked = [(case.counted, cost, cost, error) for cost in MATCHED]
    # An error of "at most" a value includes the bar of the truth, as in the verb ``recommend``.
    asked.append((case.certain, TIME, error, TIME))
    return [
        (
            same,
            compared,
            [match(points, error, cost, same=same, at=at) for at in levels(points, error, cost, same=same)],
        )
        for points, cost, same, compared in asked
    ]


def answered(case: CaseStudy) -> tuple[Answer, ...]:
    """The answers to the usual requests, from the settings that the verb ``recommend`` considers; empty without settings."""
    known = known_settings(case.features, case.case, [case], MAIN).settings
    return answers(known) if known else ()


def load_of(points: Iterable[Point]) -> str:
    """A warning if times of ``points`` were measured on a machine that was busy with other work; otherwise empty."""
    return under_load((point.load for point in points if point.status == "converged"), LOADED)


def as_measured(case: CaseStudy, point: Point, error: str) -> float | None:
    """The measured error of a point of a table, without the bar of the truth; None for the truth itself."""
    return None if point.is_truth else point.errors[error] - case.bars.get(error, 0.0)


def left_out(case: CaseStudy) -> list[Point]:
    """The points that did not reach all frames or were refused, and are therefore on no front."""
    return [point for point in case.points if point.status != "converged"]


def front(case: CaseStudy, error: str) -> Drawing:
    """A drawing of error against time for a statistic."""
    title = title_of(error).capitalize()

    def draw(figure: Figure, axes: Axes) -> None:
        if error == MAIN:
            _draw_answers(axes, answered(case))
        for solver, look in looks(solvers(case.points)).items():
            pairs = [pair for pair in shown_points(case) if pair[0].solver == solver]
            _draw(axes, pairs, error, solver, look["color"])
        logarithmic(axes)
        if (bar := case.bars.get(error, 0.0)) > 0:
            axes.set_ylim(bottom=min(axes.get_ylim()[0], bar / 2))
            axes.axhspan(axes.get_ylim()[0], bar, color=BAND, linewidth=0, label="error bar of the truth")
        axes.set(xlabel="time of a frame, s", ylabel=f"{title_of(error)}, {case.units[error]}")
        if axes.get_legend_handles_labels()[0]:
            figure.legend(loc="outside lower center", ncols=3, fontsize="small")

    return drawn(f"front-{case.case}-{error.replace('.', '-')}", title, (4.9, 4.2), draw)


def _draw_answers(axes: Axes, found: Iterable[Answer]) -> None:
    """Draw the limits of requests as lines, and the best setting for each request as a numbered diamond."""
    numbers = dict[tuple[float, float], list[str]]()
    for i, one in enumerate(found):
        for limit, line in ((one.limits.get("error"), axes.axhline), (one.limits.get("time"), axes.axvline)):
            if limit is not None:
                line(limit, color="#888888", linestyle=":", linewidth=1)
        if one.best is not None:
            numbers.setdefault((one.best.time, one.best.counted), []).append(str(i + 1))
    for i, (place, these) in enumerate(numbers.items()):
        axes.plot(*place, "D", color="#1d1d1f", markersize=7, fillstyle="none")
        axes.annotate(", ".join(these), place, (5, 5 - 9 * (i % 2)), textcoords="offset points", color="#1d1d1f")


def shown_points(case: CaseStudy) -> list[tuple[Point, Point]]:
    """Pairs of a point with its measured error, which may be below the error bar of the truth, and the same point with the error
    that counts.
    """
    return [
        (replace(point, errors=point.errors or counted.errors), counted)
        for point, counted in zip(case.points, case.counted, strict=True)
    ]


def _draw(axes: Axes, points: Sequence[tuple[Point, Point]], error: str, solver: str, colour: str) -> None:
    """Draw the points of a solver as dots, default settings as rings and, as a line, the front of the errors that count."""
    pairs = [(point, pair) for point, _ in points if (pair := point.at(error, TIME))]
    if not pairs:
        return
    best = fronts.pareto((counted for _, counted in points), error, TIME)
    _plot(axes, [pair for _, pair in pairs], ".", color=colour, markersize=5, label=solver)
    _plot(axes, [pair for point in best if (pair := point.at(error, TIME))], "-", color=colour, linewidth=1.2)
    rings = [pair for point, pair in pairs if point.is_default]
    _plot(axes, rings, "o", color=colour, markersize=9, fillstyle="none")


def _plot(axes: Axes, pairs: list[tuple[float, float]], *style: str, **look: Any) -> None:
    """Draw pairs of an error and a cost, with the cost on the horizontal axis."""
    axes.plot([cost for _, cost in pairs], [error for error, _ in pairs], *style, **look)


def _data(study: Study) -> dict[str, Any]:
    """The data for the drawing whose axes the reader selects."""

    def facts(one: Point) -> dict[str, Any]:
        named = {name: getattr(one, name) for name in ("solver", "label", "errors", "costs")}
        return named | {"default": one.is_default}

    cases = [
        {"case": case.case, "units": case.units, "bars": case.bars}
        | {"points": [facts(one) for one, _ in shown_points(case) if one.status == "converged"]}
        for case in study.cases
    ]
    colours = {solver: look["color"] for solver, look in looks(solvers(study.points)).items()}
    return {"costs": COSTS, "reference": REFERENCE, "colours": colours, "cases": cases}


def text(study: Study) -> str:
    """A study as lines of text."""
    lines = list[str]()
    for case in study.cases:
        there = sum(point.status == "converged" for point in case.points)
        lines.append(f"{case.case}: {there} points of {listed(list(solvers(case.points)))}; the truth is {case.truth}")
        lines += [f"  {sentence}" for sentence in answer_texts(answered(case), case.units[MAIN])]
        for error in shown(case):
            known = f", error bar ± {number(case.bars[error])} {case.units[error]}" if error in case.bars else ""
            lines.append(f"  {title_of(error)}{known}:")
            lines += [f"    {sentence}" for sentence in sentences(case, error)]
        lines += [f"  {warning}" for warning in [load_of(case.points)] if warning]
        lines += [f"  left out: {one.solver}, {one.label}: {one.status}: {one.message}" for one in left_out(case)]
    lines += [f"left out: {case}: {why}" for case, why in study.missing.items()]
    return "\n".join(lines)
