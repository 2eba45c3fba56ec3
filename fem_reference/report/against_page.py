"""The page of two versions of one solver: what got better, what worse, and where."""

import math
from functools import partial
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from fem_reference.assessment.baseline import SAMPLED
from fem_reference.assessment.versions import ORDER, Change, Versions
from fem_reference.foundations.errors import MissingSoftware
from fem_reference.foundations.mesh import Floats
from fem_reference.problems.setup import Setup
from fem_reference.report import gallery
from fem_reference.report.at_frames import label
from fem_reference.report.curves import BAND, PALETTE, Curve, drawn
from fem_reference.report.gallery import Shot
from fem_reference.report.sections.pictures import picture_source, ramp, ticks
from fem_reference.report.tables import finite
from fem_reference.report.templates import template
from fem_reference.report.words import number, words
from fem_reference.runs.cost import seconds_per_frame

MOST_CURVES = 8


def render(versions: Versions, setup: Setup) -> str:
    """The whole page as text."""
    shots, missing = _pictures(versions, setup)
    return template("against_page.html").render(
        versions=versions,
        current=versions.current,
        headline=headline(versions),
        order=ORDER,
        sentences=[sentence(one) for word in ORDER[:3] for one in versions.of(word)[:3]],
        curves=[_curve(one, i) for i, one in enumerate(_shown(versions))],
        moved=_moved(versions),
        place=place(versions),
        shots=shots,
        missing=missing,
        ramp=ramp(),
        ticks=ticks,
        sampled=versions.before is None,
        seconds=seconds_per_frame(versions.current.candidate),
        title_of=title_of,
        infinite=math.inf,
        label=partial(label, versions.current.scene, setup),
    )


def headline(versions: Versions) -> str:
    """How many statistics came out how."""
    return ", ".join(f"{versions.count(word)} {word}" for word in ORDER if versions.count(word))


def word(versions: Versions) -> str:
    """The verdict of the headline: worse where anything is, else mixed, else better."""
    return next((one for one in ORDER[:3] if versions.count(one)), "as it was")


def title_of(name: str) -> str:
    """A statistic in words.

    >>> title_of("surface_deviation.rms")
    'surface deviation, rms'
    """
    return ", ".join(map(words, name.split(".")))


def sentence(one: Change) -> str:
    """What became of a statistic."""
    if math.isinf(one.by):
        return f"{title_of(one.name)} {'has no number any more' if one.by > 0 else 'has a number now'} in frame {one.frame}"
    then, now = number(abs(one.was[one.at])), number(abs(one.now[one.at]))
    bars = "" if math.isnan(one.in_bars) else f", {number(abs(one.in_bars))} times the error bar"
    other = "" if one.other is None else f", and {_by(one, one.other)}"
    return f"{title_of(one.name)} is {_by(one, one.at)}: {then} before, {now} {_unit(one)} now{bars}{other}"


def _by(one: Change, k: int) -> str:
    """By how much a statistic is nearer or further away in the k-th frame."""
    by = float(one.further[k])
    return f"{number(abs(by))} {_unit(one)} {'further' if by > 0 else 'nearer'} in frame {one.numbers[k]}"


def _unit(one: Change) -> str:
    """The unit of a statistic in a sentence."""
    return one.unit.replace("mm3", "mm³").replace("deg", "°")


def place(versions: Versions) -> str:
    """Where it moved most, in words; empty where it did not."""
    if versions.place is None:
        return ""
    i, vertex, distance = versions.place
    x, y, z = versions.current.rest[vertex]
    at = f"vertex {vertex}, at rest at ({number(x)}, {number(y)}, {number(z)}) mm"
    return f"{number(distance)} mm from where it was, in frame {versions.current.candidate.numbers[i]}: {at}"


def facts(versions: Versions) -> dict[str, Any]:
    """All of it as valid JSON: a number that is not finite is None."""
    rows = [
        {
            "statistic": one.name,
            "unit": one.unit,
            "word": one.word,
            "frame": one.frame,
            "was": finite(float(one.was[one.at])),
            "now": finite(float(one.now[one.at])),
            "further": finite(one.by),
            "error_bar": finite(one.bar),
        }
        for one in versions.changes
    ]
    current = versions.current
    named = {"case": current.scene.name, "candidate": current.candidate.name, "against": versions.was}
    return named | {"counts": {one: versions.count(one) for one in ORDER}, "moved": place(versions), "changes": rows}


def text(versions: Versions) -> str:
    """What is printed."""
    said = [f"{one.word}: {sentence(one)}" for kind in ORDER[:3] for one in versions.of(kind)]
    moved = place(versions)
    last = f"{versions.current.candidate.name} on {versions.current.scene.name} against {versions.was}: {headline(versions)}"
    return "\n".join([*said, *([f"moved most: {moved}"] if moved else ["nothing moved"]), last])


def _shown(versions: Versions) -> list[Change]:
    """The statistics that are drawn: those that changed most."""
    return [one for one in versions.changes if one.word != "no number"][:MOST_CURVES]


def _curve(one: Change, i: int) -> Curve:
    title = f"{title_of(one.name).capitalize()}: {one.word}"

    def draw(figure: Figure, axes: Axes) -> None:
        frames = np.array(one.numbers)
        if np.nan_to_num(one.bars).any():
            axes.fill_between(frames, 0, one.bars, color=BAND, linewidth=0, label="error bar")
        axes.plot(frames, np.abs(one.was), "--", color=PALETTE[1], linewidth=1.4, label="before")
        axes.plot(frames, np.abs(one.now), color=PALETTE[0], linewidth=1.8, label="now")
        _finish(figure, axes, one.unit)

    return drawn(f"change-{i}", title, (5.4, 3.0), draw)


def _moved(versions: Versions) -> Curve | None:
    """How far the vertices are from where they were; None where they are there."""
    if versions.place is None:
        return None

    def draw(figure: Figure, axes: Axes) -> None:
        frames = np.array(versions.current.candidate.numbers)
        known = np.where(np.isfinite(versions.moved), versions.moved, np.nan)
        rows = [row[np.isfinite(row)] for row in known]
        for name, style, value in (("furthest", "-", np.max), ("rms", ":", lambda row: np.sqrt((row**2).mean()))):
            axes.plot(frames, [value(row) if len(row) else np.nan for row in rows], style, color=PALETTE[0], label=name)
        _finish(figure, axes, "mm")

    return drawn("moved", "Distance of vertices from where they were", (5.4, 3.0), draw)


def _finish(figure: Figure, axes: Axes, unit: str) -> None:
    axes.set_ylim(bottom=0)
    axes.margins(x=0.02)
    axes.set_xlabel("frame")
    axes.set_ylabel(unit.replace("mm3", "mm³"))
    axes.xaxis.set_major_locator(MaxNLocator(nbins=8, integer=True, steps=[1, 2, 5, 10]))
    figure.legend(loc="outside upper left", ncols=3, handlelength=2.2, columnspacing=1.2)


def _pictures(versions: Versions, setup: Setup) -> tuple[list[tuple[Shot, list[str], float]], str]:
    """The frame in which it moved most: then, now, and what moved, in one scale of colours; or what is missing."""
    current, found = versions.current, versions.place
    if found is None or not current.candidate.has_surface:
        return [], ""
    wanted = _shots(versions, found[0])
    try:
        drawn_ = gallery.draw(setup, current.candidate.surface, wanted)
    except MissingSoftware as error:
        return [], str(error)
    end = gallery.top(wanted)
    return [(shot, [picture_source(one) for one in pair], end) for shot, pair in zip(wanted, drawn_, strict=True)], ""


def _shots(versions: Versions, i: int) -> list[Shot]:
    current = versions.current
    points, frame, truth = current.points[i], current.candidate.numbers[i], current.reference.positions[i]
    moved = _everywhere(versions, i)
    shots = list[Shot]()
    if np.isfinite(points).all() and np.isfinite(moved).all():
        outline = points if versions.before is None else versions.before[i]
        shots.append(Shot("what moved", frame, points, moved, outline))
    if versions.before is not None:
        for name, shown in (("before", versions.before[i]), ("now", points)):
            apart = np.linalg.norm(shown - truth, axis=1)
            if np.isfinite(apart).all():
                shots.append(Shot(name, frame, shown, apart, truth))
    return shots


def _everywhere(versions: Versions, i: int) -> Floats:
    """How far every vertex (n,) [mm] is from where it was; of sampled ones, what the nearest of them is."""
    if versions.before is not None:
        return np.asarray(versions.moved[i])
    rest = versions.current.rest
    apart = np.linalg.norm(rest[:, None] - rest[versions.vertices][None], axis=2)
    assert apart.shape[1] <= SAMPLED
    return np.asarray(versions.moved[i][np.argmin(apart, axis=1)])
