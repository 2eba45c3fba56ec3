"""Drawings inside a page, as SVG with searchable text and unique ids."""

import io
import re
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from html import escape
from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_svg import FigureCanvasSVG
from matplotlib.colors import to_hex, to_rgb
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, MaxNLocator

from fem_reference.foundations.mesh import Floats
from fem_reference.report.words import number

REFERENCE = "#222222"
# First the palette of Okabe and Ito for all kinds of colour vision, without black and yellow; then the muted colours of Tol that
# differ from this palette; then colours in between. style.css has variants of all colours for dark pages.
PALETTE = (
    *("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#56b4e9", "#e69f00", "#882255"),
    *("#999933", "#332288", "#777777", "#7a4a1e", "#951afe", "#1e5b09", "#d81b8c", "#1fb80d"),
)
# Runs with a fixed colour on all pages, in the order of the palette. Other names take the next colours.
_OURS = (
    *(
        "pbd",
        "arap_pbd",
        "mass_spring",
        "rbf_muscle",
        "viper",
        "straight_lines",
        "via_points",
        "wrapping",
        "hill_lines",
    ),
    *("xpbd", "arap", "pbd_program", "arap_volume_step", "line_of_action"),
)
# The number of lines that are distinguished by colour alone; further lines are dashed.
_BY_COLOUR, _DASHES = 6, ("-", "--", ":", "-.")
NOT_A_NUMBER = "not a number"
BAND = "#01010120"  # nearly black, as matplotlib omits pure black from SVG
LOOK: Any = dict(mpl.rc_params_from_file(Path(__file__).with_suffix(".mplstyle"), use_default_template=False))
# The names in style.css of those colours that change on dark pages.
_NAMED = {
    "#e8e8e8": "grid",
    "#888888": "axis",
    "#444444": "soft",
    "#dddddd": "line",
    "#bbbbbb": "axis",
    "#555555": "soft",
    "#1d1d1f": "ink",
    "#010101": "band",
    "#ffffff": "paper",
    "#14713a": "good",
    "#b3261e": "bad",
}


@dataclass(frozen=True)
class Drawing:
    """A drawing: its ``title``, and its ``markup`` (an ``<svg>`` or an ``<img>``) or the reason why it is ``missing``."""

    title: str
    markup: str = ""
    missing: str = ""


def colour_of(i: int) -> str:
    """The i-th colour: first the colour of the reference (0), then the palette, then darker and darker shades of the palette.

    >>> colour_of(0), colour_of(1), colour_of(16)
    ('#222222', '#0072b2', '#004c77')
    """
    if i == 0:
        return REFERENCE
    darker, k = divmod(i - 1, len(PALETTE))
    red, green, blue = (share * (2 / 3) ** darker for share in to_rgb(PALETTE[k]))
    return to_hex((red, green, blue))


def look_of(i: int) -> dict[str, Any]:
    """The colour and the line style of the i-th line; line 0 is the reference.

    >>> look_of(1), look_of(7)
    ({'color': '#0072b2', 'linestyle': '-'}, {'color': '#882255', 'linestyle': '--'})
    """
    return {"color": colour_of(i), "linestyle": _DASHES[max(i - 1, 0) // _BY_COLOUR % len(_DASHES)]}


def looks(names: Iterable[str]) -> dict[str, dict[str, Any]]:
    """Colour and line style by name of the run or solver. Our solvers look the same on all pages; other solvers have the next free
    colours and line styles.

    >>> looks(["reference", "mine", "pbd"])["pbd"] == looks(["fenicsx", "pbd"])["pbd"] == look_of(1)
    True
    """
    asked = tuple(dict.fromkeys(names))
    known = {"reference" if "reference" in asked else "fenicsx": 0} | {name: i for i, name in enumerate(_OURS, 1)}
    others = (name for name in asked if name not in known)
    known |= {name: i for i, name in enumerate(others, len(known))}
    return {name: look_of(known[name]) for name in asked}


def drawn(name: str, title: str, size: tuple[float, float], draw: Callable[[Figure, Axes], None]) -> Drawing:
    """Make a drawing of ``size`` [inches] by calling ``draw``. The ids in its SVG begin with ``name``."""
    with mpl.rc_context(LOOK):
        figure = Figure(figsize=size, layout="constrained")
        FigureCanvasSVG(figure)
        draw(figure, figure.add_subplot())
        text = io.StringIO()
        figure.savefig(text, format="svg", transparent=True, metadata={"Date": None})
    return Drawing(title, inline(text.getvalue(), name, title))


def over_frames(name: str, title: str, unit: str, draw: Callable[[Axes], None], over: str = "frame") -> Drawing:
    """Make a drawing of curves over frame numbers, or over the quantity that ``over`` names, with a legend above the curves."""

    def whole(figure: Figure, axes: Axes) -> None:
        draw(axes)
        axes.margins(x=0.02)
        axes.set_xlabel(over)
        axes.set_ylabel(unit.replace("mm3", "mm³"))
        axes.xaxis.set_major_locator(MaxNLocator(nbins=8, integer=True, steps=[1, 2, 5, 10]))
        _legend(figure, axes)

    return drawn(name, title, (5.4, 3.1), whole)


def _legend(figure: Figure, axes: Axes) -> None:
    """Add a legend above the axes in as many columns as fit, with the entry for NaN last. For more than three rows the figure is
    made taller.
    """
    entries = sorted(zip(*axes.get_legend_handles_labels(), strict=True), key=lambda entry: entry[1] == NOT_A_NUMBER)
    handles, labels = [entry[0] for entry in entries], [entry[1] for entry in entries]
    lengths = [len(label) + 7 for label in labels]
    columns = len(labels) if sum(lengths) < 75 else max(1, 75 // max(lengths))
    figure.set_figheight(figure.get_figheight() + 0.19 * max(0, -(-len(labels) // columns) - 3))
    figure.legend(handles, labels, loc="outside upper left", ncols=columns, handlelength=2.2, columnspacing=1.2)


def logarithmic(axes: Axes) -> None:
    """Make both axes logarithmic, with plain numbers instead of powers as labels."""
    axes.set(xscale="log", yscale="log")
    plain_numbers(axes.xaxis)
    plain_numbers(axes.yaxis)


def positive(sizes: Floats, errors: Floats) -> tuple[Floats, Floats]:
    """Those ``sizes`` and ``errors`` (n,) whose error can be drawn on a logarithmic axis."""
    kept = np.isfinite(errors) & (errors > 0)
    return sizes[kept], errors[kept]


def plain_numbers(axis: Any) -> None:
    """Label the major ticks of a logarithmic axis with plain numbers. Label minor ticks only if fewer than two major ticks are
    visible, and only 2 and 5 of each decade if more labels would overlap.
    """

    def minor(value: float, _: int | None) -> str:
        low, high = axis.get_view_interval()
        few = sum(low <= one <= high for one in axis.get_majorticklocs()) < 2
        return number(value) if few and (high < 4 * low or f"{value:e}"[0] in "25") else ""

    axis.set_major_formatter(lambda value, _: number(value))
    axis.set_minor_formatter(FuncFormatter(minor))


def inline(svg: str, name: str, title: str) -> str:
    """The ``<svg>`` element alone, as wide as its container. Its ids begin with ``name``, and the page may change named colours."""
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
    """A colour as a CSS variable that a page may set; the default is the colour itself.

    >>> _named("#e8e8e8"), _named("#d55e00")
    ('var(--grid, #e8e8e8)', 'var(--c-d55e00, #d55e00)')
    """
    return f"var(--{_NAMED.get(colour, f'c-{colour[1:]}')}, {colour})"
