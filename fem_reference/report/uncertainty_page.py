"""The page of unknown parameters: bands of results over the motion, sensitivities, and candidates compared with the bands."""

import math
from functools import partial

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from fem_reference.assessment.uncertainty import Band, Placed, Uncertainty, facts
from fem_reference.report.drawings import REFERENCE, Drawing, drawn, looks, over_frames
from fem_reference.report.pages import Page
from fem_reference.report.words import listed, number

# Room above and below a band for the lines of candidates, relative to the height of the band.
_BEYOND = 1.5
_SHADE, _FIRST, _TOTAL = "#888888", "#0072b2", "#56b4e9"


def page(found: Uncertainty) -> Page:
    """The page of the unknown parameters of a case."""
    there = [band for band in found.bands if not band.refused]
    contents = {
        "found": found,
        "sentences": sentences(found),
        "bands": [(band, drawing(found, band), shares(found, band)) for band in there],
        "refused": [band for band in found.bands if band.refused],
        "beside": {name: beside(found, name) for name in dict.fromkeys(one.candidate for one in found.placed)},
        "there": there,
        "verdict": verdict,
        "titles": {one.key: one.title for one in found.parameters},
        "ratio_of": ratio_of,
    }
    title, said = f"Unknown parameters: {found.title}", sentences(found)[:1]
    return Page(
        "uncertainty", title, tuple(("", "", one) for one in said), "uncertainty_page.html", contents, facts(found)
    )


def sentences(found: Uncertainty) -> list[str]:
    """The result in sentences: the band of the surface, the error bar of the reference, the main source of variation, and verdicts
    on candidates.
    """
    if found.refused:
        return [f"No band: {found.refused}."]
    said = [_sentence(found, band) for band in found.bands[:1] if not band.refused]
    places = {
        one.candidate: one.word for one in found.placed if found.bands and one.quantity == found.bands[0].quantity
    }
    for word, text in (
        ("inside", "Candidates whose surface error is smaller than the effect of the unknown parameters: {}."),
        ("undecided", "Candidates too near to the band's edge for a decision, given the reference's error bar: {}."),
        ("outside", "Candidates whose surface error is larger than the effect of the unknown parameters: {}."),
        ("no answer", "Candidates without an answer in some frame: {}."),
    ):
        named = [name for name, one in places.items() if one == word]
        said += [text.format(listed(named))] if named else []
    if not said:
        said = [f"No band: {found.bands[0].refused}."] if found.bands else ["The case has no quantity with a band."]
    return said


def _sentence(found: Uncertainty, band: Band) -> str:
    bar = band.greatest_bar
    known = "" if math.isnan(bar) else f"; the error bar of the reference is ± {number(bar)} {band.unit}"
    most = max(band.total, key=lambda key: band.total[key], default="")
    name = {one.key: one.title for one in found.parameters}.get(most, "")
    why = f" The main source of variation is {name} ({100 * band.total[most]:.0f} % of the variance)." if name else ""
    return (
        "In each frame, for 95 % of the parameter sets drawn from their ranges, the rms distance of the surface from that of this "
        f"case is at most {number(band.width)} {band.unit}{known}.{why}"
    )


def ratio_of(band: Band) -> float | None:
    """The ratio of the width of a band to the error bar of the reference; None if either is unknown."""
    bar = band.greatest_bar
    return band.width / bar if bar > 0 and not math.isnan(band.width) else None


def beside(found: Uncertainty, candidate: str) -> dict[str, Placed]:
    """The comparisons of a candidate with the bands, by quantity."""
    return {one.quantity: one for one in found.placed if one.candidate == candidate}


def verdict(one: Placed | None, unit: str) -> tuple[str, str]:
    """The verdict on a candidate compared with a band, and the reason."""
    if one is None or not one.word:
        return "\N{EN DASH}", ""
    frames = [place for place in one.places if place]
    share = f"{frames.count('inside')} of {len(frames)} frames inside"
    lost = f", {count} without an answer" if (count := frames.count("no answer")) else ""
    far = f", up to {number(one.worst)} {unit} beyond" if one.worst > 0 else ""
    return one.word, f"{share}{lost}{far}"


def drawing(found: Uncertainty, band: Band) -> Drawing:
    """A drawing of a band over the frames, with the error bar of the reference and the candidates. The result of the case is
    subtracted from every curve, because a band would otherwise often be too narrow to see.
    """
    title = band.title if band.distance else f"{band.title}: difference from the result of the case"
    return over_frames(f"band-{band.quantity}", title, band.unit, partial(_draw, found, band))


def _draw(found: Uncertainty, band: Band, axes: Axes) -> None:
    frames, bar = np.asarray(band.numbers, float), np.zeros(len(band.numbers)) if band.bar is None else band.bar
    low, high = (np.zeros(len(frames)) if band.distance else band.low - band.nominal), band.high - band.nominal
    label = "95th percentile" if band.distance else "5 to 95 %"
    axes.fill_between(frames, low, high, color=_SHADE, alpha=0.25, linewidth=0, label=label)
    axes.plot(frames, band.median - band.nominal, color=_SHADE, linewidth=1.2, label="median")
    if band.bar is not None:
        below = 0 if band.distance else -bar
        axes.fill_between(
            frames, below, bar, facecolor="none", edgecolor=_SHADE, hatch="/////", linewidth=0.8, label="error bar"
        )
    if not band.distance:
        axes.axhline(0, color=REFERENCE, linewidth=1.5, label="the case")
    look = looks(one.candidate for one in found.placed)
    for one in (one for one in found.placed if one.quantity == band.quantity):
        axes.plot(frames, one.values - band.nominal, linewidth=1.0, label=one.candidate, **look[one.candidate])
    bottom, top = min(np.nanmin(low), 0 if band.distance else np.nanmin(-bar)), max(np.nanmax(high), np.nanmax(bar))
    room = _BEYOND * (top - bottom) or 1.0
    axes.set_ylim(-0.03 * room if band.distance else bottom - room / 2, top + room / (1 if band.distance else 2))


def shares(found: Uncertainty, band: Band) -> Drawing:
    """A bar chart of the sensitivities of a quantity to each parameter, or the reason why there are none."""
    title = f"Shares of the variance: {band.title[0].lower()}{band.title[1:]}"
    if not band.first:
        return Drawing(title, missing=band.unreliable or "the quantity does not vary")
    keys = sorted(band.total, key=lambda key: band.total[key])
    titles = {one.key: one.title for one in found.parameters}

    def draw(_: Figure, axes: Axes) -> None:
        places = np.arange(len(keys))
        axes.barh(places, [100 * band.total[key] for key in keys], 0.7, color=_TOTAL, label="with interactions")
        axes.barh(places, [100 * band.first[key] for key in keys], 0.4, color=_FIRST, label="alone")
        axes.set_yticks(places, [titles[key] for key in keys])
        axes.set(xlabel="% of the variance over all frames", xlim=(0, 105))
        axes.grid(visible=False, axis="y")
        axes.set_axisbelow(True)
        axes.figure.legend(loc="outside upper left", ncols=2)

    return drawn(f"shares-{band.quantity}", title, (5.4, 1.1 + 0.34 * len(keys)), draw)


def text(found: Uncertainty) -> str:
    """The bands of a case as lines of text."""
    lost = len(found.failures)
    lines = [f"{found.case}: {found.runs} runs, {lost} without a result; {len(found.parameters)} parameters"]
    for one in found.failures:
        at = ", ".join(f"{key} = {value:g}" for key, value in one.values.items())
        lines.append(f"  no result: {one.status}: {one.message} ({at})")
    for band in found.bands:
        if band.refused:
            lines.append(f"  {band.title}: no band: {band.refused}")
            continue
        bar = "" if math.isnan(band.greatest_bar) else f", error bar {number(band.greatest_bar)} {band.unit}"
        lines.append(f"  {band.title}: band up to {number(band.width)} {band.unit} wide{bar}")
        titles = {one.key: one.title for one in found.parameters}
        lines += [f"    {titles[key]}: {100 * share:.0f} %" for key, share in band.total.items()]
        lines += [f"    no sensitivities: {band.unreliable}"] if band.unreliable else []
    return "\n".join([*lines, *(f"  {sentence}" for sentence in sentences(found))])
