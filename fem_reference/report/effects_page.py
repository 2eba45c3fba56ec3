"""The page of omissions: the change of results and the cost due to each effect of a scene or each feature of a candidate."""

import math
from typing import Any

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from fem_reference.assessment import omissions
from fem_reference.assessment.omissions import Ablation, CaseOmissions, Omission
from fem_reference.metrics import described
from fem_reference.report.drawings import BAND, Drawing, drawn, looks, plain_numbers
from fem_reference.report.pages import Page, by_name
from fem_reference.report.study_page import title_of
from fem_reference.report.words import duration, listed, number, words

MAIN = "surface_deviation.rms"
# The heading of each column of the table, by name.
HEADS = {
    ".".join(key): f"{one.title} ({one.part})".removesuffix(" ()").lower() for key, one in described("main").items()
}
# The axis begins at the smallest change that counts, divided by this factor; smaller changes are drawn there, with their values.
_DEPTH = 10.0


def page(found: CaseOmissions) -> Page:
    """The page of the omissions of a case."""
    contents = {
        "found": found,
        "measures": [name for name in omissions.MEASURES if name in found.units],
        "heads": HEADS,
        "phases": phases(found),
        "counts": {name: title_of(name) for name in omissions.COUNTS},
        "predicted": any(one.predicted for ablation in found.ablations for one in ablation.omissions),
        "judged": lambda one: omissions.verdict(one.changes, found.bars),
        "prediction": lambda one: [f"{title_of(name)}: {number(value)}" for name, value in one.predicted.items()],
        "instead": lambda one: [f"{words(key)} = {value}" for key, value in one.instead.items()],
        "drawing": drawing(found),
        **by_name(sentences, label, percent),
    }
    title, said = f"What each effect changes: {found.title}", sentences(found, found.ablations[0])[0]
    return Page("effects", title, (("", "", said),), "effects_page.html", contents, omissions.facts(found))


def label(ablation: Ablation, omission: Omission) -> str:
    """The effects or features that are left out, in words; "all of them" if these are all that can be left out."""
    if not omission.left_out:
        return "nothing"
    every = {name for one in ablation.omissions for name in one.left_out}
    if len(every) > 1 and set(omission.left_out) == every:
        return "all of them"
    return listed([words(name) for name in omission.left_out])


def percent(share: float) -> str:
    """A fraction as a percentage.

    >>> percent(0.254)
    '25 %'
    """
    return "\N{EN DASH}" if math.isnan(share) else f"{100 * share:.0f} %"


def phases(found: CaseOmissions) -> list[str]:
    """The phases in which at least one run of the case spent time."""
    runs = [one for ablation in found.ablations for one in (ablation.whole, *ablation.omissions)]
    return [name for name in omissions.PHASES if any(one.phase(name) > 0 for one in runs)]


def sentences(found: CaseOmissions, ablation: Ablation) -> list[str]:
    """Sentences on the changes due to the omission of effects or features of a run."""
    whole = ablation.whole
    if whole.status != "converged":
        return [f"Nothing was left out, because the complete run did not converge ({whole.status}): {whole.message}"]
    if not ablation.omissions:
        return ["There is nothing that could be left out."]
    said = [_sentence(found, ablation, one) for one in ablation.omissions]
    if ablation.kept:
        material = listed([words(name) for name in ablation.kept])
        said.append(f"The material itself is never left out: {material}.")
    return said


def _sentence(found: CaseOmissions, ablation: Ablation, one: Omission) -> str:
    name = label(ablation, one)
    if not one.changes:
        return f"Without {name}: {one.status}. {one.message}"
    word = omissions.verdict(one.changes, found.bars)
    said = {"hardly": "It hardly matters", "not known": "Whether it matters is unknown"}.get(word, f"It {word}")
    saved = 1 - ablation.relative(one.seconds)
    time = "" if math.isnan(saved) else f" and {'saves' if saved >= 0 else 'costs'} {percent(abs(saved))} of the time"
    return f"Leaving out {name} changes {_most(found, one)}{time}. {said}."


def _most(found: CaseOmissions, one: Omission) -> str:
    """The change that is largest relative to the error bar of its statistic, in words."""
    in_bars = omissions.in_bars(one.changes, found.bars).items()
    ratios = {name: ratio for name, ratio in in_bars if not math.isnan(ratio)}
    name = max(ratios, key=lambda name: ratios[name]) if ratios else next(iter(one.changes))
    known = f" (error bar ± {number(found.bars[name])} {found.units[name]})" if name in found.bars else ""
    return f"the {HEADS.get(name, title_of(name))} by {number(one.changes[name])} {found.units[name]}{known}"


def drawing(found: CaseOmissions) -> Drawing | None:
    """A drawing of the change due to each omission against the time saved; None if there is nothing to draw."""
    points = {
        ablation.name: [
            (label(ablation, one), 100 * (1 - share), one.changes[MAIN])
            for one in ablation.omissions
            if MAIN in one.changes and not math.isnan(share := ablation.relative(one.seconds))
        ]
        for ablation in found.ablations
    }
    changes = [change for rows in points.values() for _, _, change in rows]
    if not changes:
        return None
    bar = found.bars.get(MAIN, 0.0)
    low = min((value for value in (*changes, bar) if value > 0), default=1.0)
    floor = max(low, 1e-3 * (bar or max(changes) or 1.0)) / _DEPTH

    def draw(figure: Figure, axes: Axes) -> None:
        for name, look in looks(points).items():
            _draw(axes, points[name], floor, look["color"], name)
        axes.set_yscale("log")
        axes.set_ylim(floor / 2, 3 * max(*changes, bar, floor))
        plain_numbers(axes.yaxis)
        axes.margins(x=0.2)
        axes.axvline(0, color="#888888", linewidth=0.8)
        if bar > 0:
            axes.axhspan(floor / 2, bar, color=BAND, linewidth=0, label="error bar of the reference")
        axes.set(xlabel="time saved, % of the complete run", ylabel="change of the surface (rms), mm")
        figure.legend(loc="outside lower center", ncols=4, fontsize="small")

    return drawn(f"omissions-{found.case}", "Change due to each omission against time saved", (7.2, 4.2), draw)


def _draw(axes: Axes, rows: list[tuple[str, float, float]], floor: float, colour: str, name: str) -> None:
    """Draw the points of a run. A change below ``floor`` [mm] is drawn at ``floor``, and its value is written next to the point."""
    if rows:
        heights = [max(change, floor) for _, _, change in rows]
        axes.plot([saved for _, saved, _ in rows], heights, "o", color=colour, markersize=5, label=name)
    for i, (omitted, saved, change) in enumerate(rows):
        below = "" if change >= floor else f" ({number(change)} mm)"
        place: Any = {"xytext": (5, -10 if i % 2 else 4), "textcoords": "offset points"}
        axes.annotate(f"{omitted}{below}", (saved, max(change, floor)), fontsize="small", color=colour, **place)


def text(found: CaseOmissions) -> str:
    """The omissions of a case as lines of text."""
    known = [f"{HEADS[name]} {number(bar)} {found.units[name]}" for name, bar in found.bars.items()]
    lines = [f"{found.case}: {'error bars: ' + ', '.join(known) if known else 'no error bars: ' + found.unknown}"]
    for ablation in found.ablations:
        whole = ablation.whole
        counts = [f"{number(whole.costs[name])} {title_of(name)}" for name in omissions.COUNTS if name in whole.costs]
        time = duration(None if math.isnan(whole.seconds) else whole.seconds)
        lines.append(f"  {', '.join([f'{ablation.name}: {whole.status}', f'{time} of processor time', *counts])}")
        lines += [f"    {sentence}" for sentence in sentences(found, ablation)]
    return "\n".join(lines)
