"""Curves over frames as SVG to stand inside a page: their text stays text, and no two drawings share an id."""

import io
import re
from collections.abc import Callable
from dataclasses import dataclass
from html import escape
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_svg import FigureCanvasSVG
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator, NullFormatter

from fem_reference.assessment.comparison import Comparison
from fem_reference.assessment.error_bars import Of
from fem_reference.foundations.mesh import Floats
from fem_reference.metrics import Measure, described, find
from fem_reference.report.tables import inversion, runs
from fem_reference.report.words import number, words

REFERENCE = "#222222"
# Okabe and Ito's palette for all kinds of colour vision, without its black and yellow.
PALETTE = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#56b4e9", "#e69f00")
_NOT_A_NUMBER = "not a number"
BAND = "#01010120"  # a black that the drawing names: pure black is left out of SVG
_KNOWN = "error bar"
_FAR = 50.0  # of two candidates' greatest distances, beyond which they share a logarithmic axis
LOOK: Any = {
    "svg.fonttype": "none",
    "svg.hashsalt": "fem_reference",
    "font.family": "sans-serif",
    "font.sans-serif": ["DejaVu Sans", "Verdana", "Arial", "sans-serif"],
    "font.size": 9,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.edgecolor": "#888888",
    "axes.grid": True,
    "grid.color": "#e8e8e8",
    "xtick.color": "#444444",
    "ytick.color": "#444444",
    "legend.frameon": False,
}
# What a page in dark colours draws otherwise: what style.css has by these names there, and what is black here.
_NAMED = {
    "#e8e8e8": "grid",
    "#888888": "axis",
    "#444444": "soft",
    "#dddddd": "line",
    "#bbbbbb": "axis",
    "#555555": "soft",
} | {
    "#1d1d1f": "ink",
    "#010101": "band",
    "#ffffff": "paper",
    "#14713a": "good",
    "#b3261e": "bad",
}
_STATISTICS = (
    ("max", "worst vertex", "-"),
    ("hausdorff", "Hausdorff", "--"),
    ("p95", "95 % below", "-."),
    ("rms", "rms", ":"),
)


@dataclass(frozen=True)
class Curve:
    """A drawing: its ``title``, what it shows, and the ``svg`` text."""

    title: str
    svg: str


def curves(comparison: Comparison) -> list[Curve]:
    """Every drawing for which the comparison has numbers."""
    drawn = [
        _surface(comparison, i, f"Surface of {run.name}: distance to the reference")
        for i, run in enumerate(comparison.candidates)
    ]
    for key, one in described("curve").items():
        changes = {run.name: find(comparison.changes[run.name], *key) for run in runs(comparison)}
        drawn.append(_of_runs(comparison, "-".join(key), one.curve, changes))
    smallest = inversion(comparison.reference)
    drawn.append(_inversion(comparison, smallest, "Smallest det F of the reference (inside out below 0)"))
    return [curve for curve in drawn if curve is not None]


def label_of(inverted: Measure) -> str:
    """What distinguishes an inversion measure from the others, in words: where det F is smallest."""
    return words(inverted.statistic.removeprefix("min_det_F").lstrip("_"))


def colour_of(i: int) -> str:
    """The colour of the i-th run, the reference first.

    >>> colour_of(0), colour_of(1)
    ('#222222', '#0072b2')
    """
    return REFERENCE if i == 0 else PALETTE[(i - 1) % len(PALETTE)]


def _of_runs(comparison: Comparison, name: str, title: str, measures: dict[str, Measure | None]) -> Curve | None:
    found = {run: measure for run, measure in measures.items() if measure is not None}

    def draw(axes: Axes) -> None:
        for i, run in enumerate(runs(comparison)):
            if run.name in found:
                colour = colour_of(i)
                if i == 0:
                    _band(axes, comparison, "change", found[run.name], found[run.name].values)
                _line(axes, run.numbers, found[run.name], run.name, color=colour, linewidth=2.4 if i == 0 else 1.5)

    return _drawing(name, title, next(iter(found.values())).unit, draw) if found else None


def _surface_limits(comparison: Comparison) -> tuple[float, float, bool]:
    """What the drawings of all candidates' surfaces share: the ends of the axis [mm], and whether it is logarithmic, as it is where
    one is so much further away than another that its curve would lie on the frame.
    """
    wanted = {("surface_deviation", statistic) for statistic, _, _ in _STATISTICS}
    each = [
        np.concatenate([one.values for one in measures if (one.metric, one.statistic) in wanted] or [np.zeros(0)])
        for measures in comparison.deviations.values()
    ]
    tops = [float(values[np.isfinite(values)].max()) for values in each if np.isfinite(values).any()]
    top, apart = max(tops, default=0.0), [one for one in tops if one > 0]
    far = bool(apart) and top > _FAR * min(apart)
    return (min(apart) / 1e3 if far else 0.0), (1.3 if far else 1.04) * (top or 1.0), far


def _surface(comparison: Comparison, i: int, title: str) -> Curve | None:
    run = comparison.candidates[i]
    low, high, far = _surface_limits(comparison)
    measures = comparison.deviations[run.name]
    found = [(find(measures, "surface_deviation", statistic), label, style) for statistic, label, style in _STATISTICS]

    def draw(axes: Axes) -> None:
        for measure, label, style in found:
            if measure is not None:
                colour = colour_of(i + 1)
                _band(axes, comparison, "deviation", measure, np.zeros(len(run.numbers)), style)
                _line(axes, run.numbers, measure, label, color=colour, linestyle=style)
        if far:
            axes.set_yscale("log")
            axes.yaxis.set_major_formatter(lambda value, _: number(value))
            axes.yaxis.set_minor_formatter(NullFormatter())
        axes.set_ylim(low, high)

    return _drawing(f"surface-{i}", title, "mm", draw) if any(measure for measure, _, _ in found) else None


def _inversion(comparison: Comparison, measures: tuple[Measure, ...], title: str) -> Curve | None:
    def draw(axes: Axes) -> None:
        for measure, style in zip(measures, ("-", "--", ":", "-.") * len(measures), strict=False):
            _line(
                axes,
                comparison.reference.numbers,
                measure,
                label_of(measure) or "det F",
                color=REFERENCE,
                linestyle=style,
            )
        axes.set_ylim(bottom=min(0.0, axes.get_ylim()[0]))

    return _drawing("inversion", title, "", draw) if measures else None


def _band(
    axes: Axes, comparison: Comparison, of: Of, measure: Measure, middle: Floats, linestyle: str | None = None
) -> None:
    """Error bars of the reference, around ``middle`` (f,), where that is stated; with a ``linestyle`` its upper edge too."""
    bars = comparison.error_bars
    bar = bars and bars.find(of, measure.metric, measure.statistic)
    if not bar:
        return
    numbers, upper = np.asarray(comparison.reference.numbers), middle + bar.values
    labelled = _KNOWN in axes.get_legend_handles_labels()[1]
    axes.fill_between(numbers, middle - bar.values, upper, color=BAND, linewidth=0, label="_" if labelled else _KNOWN)
    if linestyle:
        axes.plot(numbers, upper, color="#888888", linewidth=1.0, linestyle=linestyle)


def _line(axes: Axes, numbers: tuple[int, ...], measure: Measure, label: str, **look: str | float) -> None:
    """A measure over frames; a cross on the frame axis where it is not finite."""
    frames, values = np.asarray(numbers), np.asarray(measure.values, float)
    bad = ~np.isfinite(values)
    axes.plot(frames, np.where(bad, np.nan, values), label=label, **look)  # type: ignore[arg-type]
    if bad.any():
        low = axes.get_xaxis_transform()
        labelled = _NOT_A_NUMBER in axes.get_legend_handles_labels()[1]
        mark = {"color": look["color"], "label": "_" if labelled else _NOT_A_NUMBER}
        axes.plot(frames[bad], np.zeros(bad.sum()), "x", transform=low, clip_on=False, **mark)  # type: ignore[arg-type]


def _drawing(name: str, title: str, unit: str, draw: Callable[[Axes], None]) -> Curve:
    def whole(figure: Figure, axes: Axes) -> None:
        draw(axes)
        axes.margins(x=0.02)
        axes.set_xlabel("frame")
        axes.set_ylabel(unit.replace("mm3", "mm³"))
        axes.xaxis.set_major_locator(MaxNLocator(nbins=8, integer=True, steps=[1, 2, 5, 10]))
        _legend(figure, axes)

    return drawn(name, title, (5.4, 3.1), whole)


def _legend(figure: Figure, axes: Axes) -> None:
    """A legend above, in as many columns as its texts leave room for, the mark of what is not a number last."""
    entries = sorted(zip(*axes.get_legend_handles_labels(), strict=True), key=lambda entry: entry[1] == _NOT_A_NUMBER)
    handles, labels = [entry[0] for entry in entries], [entry[1] for entry in entries]
    lengths = [len(label) + 7 for label in labels]
    columns = len(labels) if sum(lengths) < 75 else max(1, 75 // max(lengths))
    figure.legend(handles, labels, loc="outside upper left", ncols=columns, handlelength=2.2, columnspacing=1.2)


def drawn(name: str, title: str, size: tuple[float, float], draw: Callable[[Figure, Axes], None]) -> Curve:
    """What ``draw`` draws, as SVG of a ``size`` in inches whose ids begin with ``name``."""
    with mpl.rc_context(LOOK):
        figure = Figure(figsize=size, layout="constrained")
        FigureCanvasSVG(figure)
        draw(figure, figure.add_subplot())
        text = io.StringIO()
        figure.savefig(text, format="svg", transparent=True, metadata={"Date": None})
    return Curve(title, inline(text.getvalue(), name, title))


def logarithmic(axes: Axes) -> None:
    """Both axes in powers of ten, their numbers as people read them and not as formulas."""
    axes.set(xscale="log", yscale="log")
    for axis in (axes.xaxis, axes.yaxis):
        axis.set_major_formatter(lambda value, _: number(value))
        axis.set_minor_formatter(NullFormatter())


def inline(svg: str, name: str, title: str) -> str:
    """The ``<svg>`` alone, as wide as its place, with ``name`` before every id, which has letters and digits only, and colours that
    the page may set by their names.
    """
    name = re.sub(r"[^\w.-]", "_", name)
    svg = re.sub(r"<metadata>.*?</metadata>", "", svg[svg.index("<svg") :], flags=re.DOTALL)
    svg = re.sub(r' xmlns(:\w+)?="[^"]*"', "", svg).replace("xlink:href", "href")
    svg = re.sub(r'(id="|href="#|url\(#)', rf"\g<1>{name}-", svg)
    svg = re.sub(r"(?<=: )#[0-9a-f]{6}\b", lambda found: _named(found[0]), svg)
    box = re.search(r'viewBox="[^"]*"', svg)
    assert box is not None  # matplotlib writes one in every drawing
    wide = f' style="--wide: {float(box[0].split()[2]):.0f}px"'
    return f'<svg {box[0]}{wide} role="img" aria-label="{escape(title)}">{svg[svg.index(">") + 1 :]}'


def _named(colour: str) -> str:
    """A colour as a page may change it, which stays what it is where the page says nothing.

    >>> _named("#e8e8e8"), _named("#d55e00")
    ('var(--grid, #e8e8e8)', 'var(--c-d55e00, #d55e00)')
    """
    return f"var(--{_NAMED.get(colour, f'c-{colour[1:]}')}, {colour})"
