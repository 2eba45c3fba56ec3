"""The page ``estimation``: curves, radial basis functions and implicit surfaces of the report's chapter 3 and section 7.1."""

from collections.abc import Iterable
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from fem_reference.assessment.estimation import Estimation
from fem_reference.foundations.mesh import Floats
from fem_reference.geometry.curves import TECHNIQUES
from fem_reference.geometry.gaussian_surface import GaussianSurface
from fem_reference.io.texts import plain
from fem_reference.metrics import described
from fem_reference.report.drawings import Drawing, colour_of, drawn, logarithmic, look_of
from fem_reference.report.pages import Page

# Distances between two Gaussians, in radii. Beyond 2 sqrt(log 2) = 1.665 the surface has two parts.
_APART = (1.2, 1.6, 1.65, 1.7)
# Control points in the plane, as in the report's Figure 3.1.
_POINTS = np.array([[0.0, 0.0], [1.0, 1.6], [2.2, 1.4], [3.0, -0.4], [4.4, 0.6]])


def page(found: Estimation) -> Page:
    """The page with the errors of the estimation techniques."""
    answers = {".".join(key): one for key, one in described().items()}
    drawings = (_figure(), _curves(found) if found.curves else None, _blobs(), _fits(found) if found.fits else None)
    contents = {
        "found": found,
        "techniques": TECHNIQUES,
        "answers": {name: answers[name] for one in found.answers for name in one.changes},
        "fibres": _rows(found.curves, "case", "known"),
        "areas": _rows(found.heights, "case", "attachment", "centres"),
        "choices": dict.fromkeys(one.choice for one in found.heights),
        "drawings": [one for one in drawings if one is not None],
    }
    headlines = (("", "", said(found)),)
    return Page("estimation", "Estimation techniques", headlines, "estimation_page.html", contents, facts(found))


def said(found: Estimation) -> str:
    """Sentences on the best technique for fibres and on the accuracy of Gaussians, if these were computed."""
    sentences = list[str]()
    if found.curves:  # empty if no fibre has enough points
        errors = {name: np.mean([one.rms for one in found.curves if one.technique == name]) for name in TECHNIQUES}
        best = min(errors, key=lambda name: float(errors[name]))
        sentences.append(f"Of the curves through a few points of a fibre, {best} deviates least")
    most = max((one.gaussians for one in found.fits), default=0)
    if fits := [one for one in found.fits if one.gaussians == most]:
        sentences.append(
            f"{most} Gaussians deviate from a muscle's surface by "
            f"{min(one.rms for one in fits):.2g} to {max(one.rms for one in fits):.2g} mm rms, with "
            f"1/{max(one.fewer for one in fits):.0f} to 1/{min(one.fewer for one in fits):.0f} of the parameters"
        )
    return "; ".join(sentences) or "nothing was measured"


def facts(found: Estimation) -> dict[str, Any]:
    """All results of the page, as values that JSON can hold."""
    names = ("curves", "heights", "fits", "decompositions", "rods", "answers", "missing")
    return {name: plain(getattr(found, name)) for name in names}


def _rows[Error](errors: Iterable[Error], *names: str) -> dict[tuple[object, ...], list[Error]]:
    """The errors, grouped by the values of their attributes ``names``."""
    found = dict[tuple[object, ...], list[Error]]()
    for one in errors:
        found.setdefault(tuple(getattr(one, name) for name in names), []).append(one)
    return found


def _figure() -> Drawing:
    """A drawing of the report's Figure 3.1: the curves of all techniques through the same points."""

    def draw(_: Figure, axes: Axes) -> None:
        for i, (name, (make, _smooth)) in enumerate(TECHNIQUES.items()):
            line = make(_POINTS)(np.linspace(0, 1, 400))
            axes.plot(*line.T, linewidth=1.4, **look_of(i + 1), label=name)
        axes.plot(*_POINTS.T, "o", color="#1d1d1f", markersize=4)
        axes.set(xlabel="x", ylabel="y")
        axes.legend(fontsize="x-small")

    return drawn("estimation-curves", "Curves through the same five points (Figure 3.1)", (4.6, 4.0), draw)


def _curves(found: Estimation) -> Drawing:
    """A drawing of the mean error of each technique over all cases against the number of known points."""

    def draw(_: Figure, axes: Axes) -> None:
        counts = sorted({one.known for one in found.curves})
        for i, name in enumerate(TECHNIQUES):
            means = [
                np.mean([one.rms for one in found.curves if (one.technique, one.known) == (name, n)]) for n in counts
            ]
            axes.plot(counts, means, marker="o", markersize=3, **look_of(i + 1), label=name)
        logarithmic(axes)
        axes.set_xticks(counts)
        axes.set(xlabel="number of known points of a fibre", ylabel="rms deviation at the other points, mm")
        axes.legend(fontsize="x-small")

    return drawn("estimation-fibres", "Fibres: error against number of known points", (4.6, 4.0), draw)


def two_blobs(apart: float, size: int = 161) -> tuple[Floats, Floats, Floats]:
    """The level of two Gaussians of radius 1 in a plane: coordinates (n,) along the line through their centres, coordinates (m,)
    across this line, and levels (m, n), which are positive inside.
    """
    along, across = np.linspace(-1.4, 1.4, size), np.linspace(-1, 0.8, size)
    x, y = np.meshgrid(along, across)
    surface = GaussianSurface(np.array([[-apart / 2, 0, 0], [apart / 2, 0, 0]]), np.ones(2))
    level = surface.level(np.stack([x.ravel(), y.ravel(), np.zeros(x.size)], axis=1))[0]
    return along, across, level.reshape(x.shape)


def _blobs() -> Drawing:
    """A drawing of the report's Figure 7.1: two Gaussians that merge."""

    def draw(_: Figure, axes: Axes) -> None:
        for i, apart in enumerate(_APART):
            axes.contour(*two_blobs(apart), levels=[0.0], colors=[colour_of(i + 1)])
            axes.plot([], [], color=colour_of(i + 1), label=f"{apart:g} radii apart")
        # The limits leave room for the legend below the curves.
        axes.set(aspect="equal", xlabel="radii", ylabel="radii", ylim=(-1.5, 0.9))
        axes.legend(fontsize="x-small", loc="lower center", ncols=2)

    return drawn("estimation-blobs", "Two Gaussians, one surface or two (Figure 7.1)", (4.6, 4.0), draw)


def _fits(found: Estimation) -> Drawing:
    """A drawing of the error of implicit surfaces against the number of Gaussians, for each case."""

    def draw(_: Figure, axes: Axes) -> None:
        for i, case in enumerate(dict.fromkeys(one.case for one in found.fits)):
            counts, errors = zip(*((one.gaussians, one.rms) for one in found.fits if one.case == case), strict=True)
            axes.plot(counts, errors, "o-", color=colour_of(i + 1), label=case)
        logarithmic(axes)
        axes.set_xticks(sorted({one.gaussians for one in found.fits}))
        axes.set(xlabel="number of Gaussians", ylabel="rms deviation of the surface, mm")
        axes.legend(fontsize="x-small")

    return drawn("estimation-surfaces", "Muscles: error against number of Gaussians", (4.6, 4.0), draw)
