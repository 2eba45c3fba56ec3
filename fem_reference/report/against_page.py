"""The page of two versions of a solver: which statistics improved or became worse, and where."""

import math
from functools import partial
from typing import Any

import numpy as np
from matplotlib.axes import Axes

from fem_reference.assessment.baseline import SAMPLED
from fem_reference.assessment.versions import ORDER, Change, Versions
from fem_reference.foundations.mesh import Floats
from fem_reference.io.texts import plain
from fem_reference.problems.setup import Setup
from fem_reference.report import gallery
from fem_reference.report.at_frames import label
from fem_reference.report.drawings import BAND, PALETTE, Drawing, over_frames
from fem_reference.report.gallery import Shot
from fem_reference.report.pages import Page
from fem_reference.report.words import number, title_of
from fem_reference.runs.store import seconds_per_frame

MOST_CURVES = 8


def page(versions: Versions, setup: Setup) -> Page:
    """The page of two versions of a solver on a case with this ``setup``."""
    current = versions.current
    # Pictures of the frame with the maximum change (before, now and the change, on one scale), or the reason why there are none.
    run, found = current.candidate, versions.place
    known = [one for one in versions.changes if one.word != "no number"]  # the greatest changes first
    shown = gallery.figures(setup, run.surface, _shots(versions, found[0])) if found and run.has_surface else ([], "")
    contents = {
        "versions": versions,
        "current": current,
        "headline": headline(versions),
        "order": ORDER,
        "sentences": [sentence(one) for word in ORDER[:3] for one in versions.of(word)[:3]],
        "curves": [_curve(one, i) for i, one in enumerate(known[:MOST_CURVES])],
        "moved": _moved(versions),
        "place": place(versions),
        "figures": shown[0],
        "missing": shown[1],
        "sampled": versions.before is None,
        "seconds": seconds_per_frame(current.candidate),
        "label": partial(label, current.scene, setup),
    }
    title = f"{current.candidate.name} against its earlier version: {current.scene.title}"
    said = (("", word(versions), headline(versions)),)
    return Page("two versions", title, said, "against_page.html", contents, facts(versions))


def headline(versions: Versions) -> str:
    """The number of statistics with each verdict."""
    return ", ".join(f"{versions.count(word)} {word}" for word in ORDER if versions.count(word))


def word(versions: Versions) -> str:
    """The verdict of the headline: the first of worse, mixed and better that a statistic has, otherwise "as it was"."""
    return next((one for one in ORDER[:3] if versions.count(one)), "as it was")


def sentence(one: Change) -> str:
    """The change of a statistic in words."""
    if math.isinf(one.by):
        return f"{title_of(one.name)} {'no longer has a number' if one.by > 0 else 'has a number now'} in frame {one.frame}"
    then, now = number(abs(one.was[one.at])), number(abs(one.now[one.at]))
    bars = "" if math.isnan(one.in_bars) else f", {number(abs(one.in_bars))} times the error bar"
    other = "" if one.other is None else f", and {_by(one, one.other)}"
    return f"{title_of(one.name)} is {_by(one, one.at)}: {then} before, {now} {_unit(one)} now{bars}{other}"


def _by(one: Change, k: int) -> str:
    """The change of a statistic in the k-th frame in words: its size, and whether it is nearer to the reference or further away."""
    by = float(one.further[k])
    return f"{number(abs(by))} {_unit(one)} {'further' if by > 0 else 'nearer'} in frame {one.numbers[k]}"


def _unit(one: Change) -> str:
    """The unit of a statistic in a sentence."""
    return one.unit.replace("mm3", "mm³").replace("deg", "°")


def place(versions: Versions) -> str:
    """The vertex that moved most, in words; empty if no vertex moved."""
    if versions.place is None:
        return ""
    i, vertex, distance = versions.place
    x, y, z = versions.current.rest[vertex]
    at = f"vertex {vertex}, at rest at ({number(x)}, {number(y)}, {number(z)}) mm"
    return f"{number(distance)} mm from its earlier position, in frame {versions.current.candidate.numbers[i]}: {at}"


def facts(versions: Versions) -> dict[str, Any]:
    """The contents of the page as valid JSON: a number that is not finite is None."""
    rows = [
        {"statistic": one.name, "unit": one.unit, "word": one.word, "frame": one.frame}
        | {"was": one.was[one.at], "now": one.now[one.at], "further": one.by, "error_bar": one.bar}
        for one in versions.changes
    ]
    current = versions.current
    named = {"case": current.scene.name, "candidate": current.candidate.name, "against": versions.was}
    counts = {one: versions.count(one) for one in ORDER}
    return dict(plain(named | {"counts": counts, "moved": place(versions), "changes": rows}))


def text(versions: Versions) -> str:
    """The changes as lines of text."""
    said = [f"{one.word}: {sentence(one)}" for kind in ORDER[:3] for one in versions.of(kind)]
    moved = place(versions)
    last = f"{versions.current.candidate.name} on {versions.current.scene.name} against {versions.was}: {headline(versions)}"
    return "\n".join([*said, *([f"moved most: {moved}"] if moved else ["nothing moved"]), last])


def _curve(one: Change, i: int) -> Drawing:
    def draw(axes: Axes) -> None:
        frames = np.array(one.numbers)
        if np.nan_to_num(one.bars).any():
            axes.fill_between(frames, 0, one.bars, color=BAND, linewidth=0, label="error bar")
        axes.plot(frames, np.abs(one.was), "--", color=PALETTE[1], linewidth=1.4, label="before")
        axes.plot(frames, np.abs(one.now), color=PALETTE[0], linewidth=1.8, label="now")
        axes.set_ylim(bottom=0)

    return over_frames(f"change-{i}", f"{title_of(one.name).capitalize()}: {one.word}", one.unit, draw)


def _moved(versions: Versions) -> Drawing | None:
    """A drawing of the distance of vertices from their earlier positions; None if no vertex moved."""
    if versions.place is None:
        return None

    def draw(axes: Axes) -> None:
        frames = np.array(versions.current.candidate.numbers)
        rows = [row[np.isfinite(row)] for row in versions.moved]
        for name, style, value in (("furthest", "-", np.max), ("rms", ":", lambda row: np.sqrt((row**2).mean()))):
            axes.plot(frames, [value(row) if len(row) else np.nan for row in rows], style, color=PALETTE[0], label=name)
        axes.set_ylim(bottom=0)

    return over_frames("moved", "Distance of vertices from their earlier positions", "mm", draw)


def _shots(versions: Versions, i: int) -> list[Shot]:
    """Shots of the i-th frame: the change, the state before and the state now. Shots with coordinates that are not finite are left
    out.
    """
    current = versions.current
    points, frame, truth = current.points[i], current.candidate.numbers[i], current.reference.positions[i]
    before = versions.before
    wanted = [("what moved", points, _everywhere(versions, i), points if before is None else before[i])]
    if before is not None:
        runs = (("before", before[i]), ("now", points))
        wanted += [(name, shown, np.linalg.norm(shown - truth, axis=1), truth) for name, shown in runs]
    return [
        Shot(name, frame, shown, apart, outline)
        for name, shown, apart, outline in wanted
        if np.isfinite(shown).all() and np.isfinite(apart).all()
    ]


def _everywhere(versions: Versions, i: int) -> Floats:
    """The distance (n,) [mm] of each vertex from its earlier position; a vertex whose distance is unknown has the value of the
    nearest vertex with a known distance.
    """
    if versions.before is not None:
        return np.asarray(versions.moved[i])
    rest = versions.current.rest
    apart = np.linalg.norm(rest[:, None] - rest[versions.vertices][None], axis=2)
    assert apart.shape[1] <= SAMPLED
    return np.asarray(versions.moved[i][np.argmin(apart, axis=1)])
