"""The page ``error-bars``: error bars of references compared with differences from finer solutions."""

from collections.abc import Sequence
from functools import partial
from typing import Any

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from fem_reference.assessment.claims import CLAIMED, FINER, LEAST, Claim, Claims, Cover
from fem_reference.io.texts import plain
from fem_reference.metrics import described
from fem_reference.report.drawings import Drawing, colour_of, drawn, logarithmic
from fem_reference.report.pages import Page
from fem_reference.report.words import words

UNITS = {metric: one.unit for (metric, _), one in described("claim").items()}


def page(claims: Claims) -> Page:
    """The page of error bars and true differences."""
    whole = Cover.of(claims.claims)
    contents = {
        "claims": claims,
        "finer": FINER,
        "whole": whole,
        "by_case": {case: Cover.of(one for one in claims.claims if one.case == case) for case in claims.sizes},
        "by_statistic": {
            (metric, statistic): Cover.of(
                one for one in claims.claims if (one.metric, one.statistic) == (metric, statistic)
            )
            for metric, statistic in CLAIMED
        },
        "widest": partial(widest, claims),
        "drawings": [drawing(claims.claims, metric, "claims") for metric in UNITS],
    }
    said = f"{100 * whole.share:.0f} % of {whole.count} error bars cover the difference from a finer solution"
    title = "Error bars: claimed against true"
    return Page("error bars", title, (("", "", said),), "claims_page.html", contents, facts(claims))


def widest(claims: Claims, case: str, metric: str, statistic: str) -> Claim:
    """The ``Claim`` with the widest error bar of the deviation of a statistic on a case."""
    found = [one for one in claims.claims if (one.case, one.metric, one.statistic) == (case, metric, statistic)]
    return max((one for one in found if one.of == "deviation"), key=lambda one: one.bar)


def facts(claims: Claims) -> dict[str, Any]:
    """The contents of the page as valid JSON: a number that is not finite is None."""
    whole = Cover.of(claims.claims)
    said = {"claims": whole.count, "covered": whole.share, "median_ratio": whole.median}
    return dict(plain(said | {"sizes_mm": claims.sizes, "missing": claims.missing, "rows": claims.claims}))


def drawing(claims: Sequence[Claim], metric: str, name: str) -> Drawing:
    """A drawing of error bars against true errors, with a colour for each case. ``name`` makes the ids in the drawing unique."""
    title = f"{words(metric).capitalize()}: claimed against true"

    def draw(_: Figure, axes: Axes) -> None:
        shown = [one for one in claims if one.metric == metric and one.error > LEAST and one.bar > 0]
        values = [value for one in shown for value in (one.bar, one.error)]
        ends = [0.5 * min(values, default=0.1), 2 * max(values, default=1.0)]
        for i, case in enumerate(dict.fromkeys(one.case for one in claims)):
            some = [one for one in shown if one.case == case]
            errors, bars = [one.error for one in some], [one.bar for one in some]
            axes.plot(errors, bars, ".", color=colour_of(i + 1), label=case, alpha=0.7)
        axes.plot(ends, ends, color="#555555", linewidth=1)
        axes.plot(ends, [3 * end for end in ends], color="#bbbbbb", linewidth=1, linestyle="--")
        logarithmic(axes)
        axes.set(xlim=ends, ylim=ends, ylabel=f"error bar, {UNITS[metric]}")
        axes.set_xlabel(f"difference from the finer solution, {UNITS[metric]}")
        if claims:
            axes.legend(fontsize="small")

    return drawn(f"{name}-{metric}", title, (4.6, 4.0), draw)
