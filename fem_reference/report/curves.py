"""Curves over frames, and over the angles of joints, for the page of a comparison."""

from typing import NamedTuple

import numpy as np
from matplotlib.axes import Axes
from numpy.typing import ArrayLike, NDArray

from fem_reference.assessment.comparison import Comparison
from fem_reference.assessment.error_bars import Of
from fem_reference.foundations.mesh import Floats
from fem_reference.metrics import Measure, MeasurementContext, described, find
from fem_reference.metrics.moment_arm import turning
from fem_reference.report.drawings import BAND, NOT_A_NUMBER, REFERENCE, Drawing, colour_of, over_frames, plain_numbers
from fem_reference.report.tables import inversion
from fem_reference.report.words import words

_KNOWN = "error bar"
_FAR = 50.0  # of two candidates' greatest distances, beyond which they share a logarithmic axis
_STATISTICS = (
    ("max", "worst vertex", "-"),
    ("hausdorff", "Hausdorff", "--"),
    ("p95", "95 % below", "-."),
    ("rms", "rms", ":"),
)


def curves(comparison: Comparison) -> list[Drawing]:
    """Every drawing for which the comparison has numbers."""
    found = [_surface(comparison, i) for i in range(len(comparison.candidates))]
    frames = _Along(
        "frame", np.array(comparison.reference.numbers, float), np.ones(len(comparison.reference.numbers), bool)
    )
    for key, one in described("curve").items():
        places = [frames, *(_angles(comparison) if one.of_joint else [])]
        found += [_of_runs(comparison, *key, one.curve, along) for along in places]
    return [drawing for drawing in [*found, _inversion(comparison)] if drawing is not None]


class _Along(NamedTuple):
    """What a curve goes along: a ``name``, and by frame a ``place`` (f,) and the mask (f,) of those that count."""

    name: str
    places: Floats
    kept: NDArray[np.bool_]


def _angles(comparison: Comparison) -> list[_Along]:
    """The angle [deg] of each joint, at the frames about which it turns alone."""
    context, numbers = comparison.context, comparison.reference.numbers
    if not isinstance(context, MeasurementContext) or len(numbers) < 2:
        return []
    which = turning(context.joints, context, numbers)
    return [
        _Along(f"angle of {joint.name} [deg]", np.degrees(joint.angles(numbers)), which == i)
        for i, joint in enumerate(context.joints)
        if (which == i).any()
    ]


def label_of(inverted: Measure) -> str:
    """The place of the smallest det F in words, which distinguishes an inversion measure from the others."""
    return words(inverted.statistic.removeprefix("min_det_F").lstrip("_"))


def _of_runs(comparison: Comparison, metric: str, statistic: str, title: str, along: _Along) -> Drawing | None:
    """A measure of every run from rest ``along`` something, with the error bar of the reference; None where no run has it."""
    measures = {run.name: find(comparison.changes[run.name], metric, statistic) for run in comparison.runs}
    found = {run: measure for run, measure in measures.items() if measure is not None}

    def draw(axes: Axes) -> None:
        for i, run in enumerate(comparison.runs):
            if run.name in found:
                colour = colour_of(i)
                if i == 0:
                    _band(axes, comparison, "change", found[run.name], found[run.name].values, along=along)
                values, wide = found[run.name].values[along.kept], 2.4 if i == 0 else 1.5
                _line(axes, along.places[along.kept], values, run.name, color=colour, linewidth=wide)

    if not found:
        return None
    over = "" if along.name == "frame" else f", over the {along.name.removesuffix(' [deg]')}"
    unit = next(iter(found.values())).unit
    return over_frames(f"{metric}-{statistic}{over}", title + over, unit, draw, along=along.name)


def surface_limits(comparison: Comparison) -> tuple[float, float, bool]:
    """The ends of the axis [mm] that the surfaces of all candidates share, and whether it is logarithmic: if they differ much."""
    wanted = [("surface_deviation", statistic) for statistic, _, _ in _STATISTICS]
    tops = []
    for measures in comparison.deviations.values():
        values = np.hstack([one.values for one in measures if (one.metric, one.statistic) in wanted] or [np.zeros(0)])
        if np.isfinite(values).any():
            tops.append(float(values[np.isfinite(values)].max()))
    top, apart = max(tops, default=0.0), [one for one in tops if one > 0]
    far = bool(apart) and top > _FAR * min(apart)
    return (min(apart) / 1e3 if far else 0.0), (1.3 if far else 1.04) * (top or 1.0), far


def _surface(comparison: Comparison, i: int) -> Drawing | None:
    """The distances of a candidate's surface, above the error bars of the reference."""
    run = comparison.candidates[i]
    low, high, far = surface_limits(comparison)
    measures = comparison.deviations[run.name]
    found = [(find(measures, "surface_deviation", statistic), label, style) for statistic, label, style in _STATISTICS]

    def draw(axes: Axes) -> None:
        for measure, label, style in found:
            if measure is not None:
                _band(axes, comparison, "deviation", measure, np.zeros(len(run.numbers)), style)
                _line(axes, run.numbers, measure.values, label, color=colour_of(i + 1), linestyle=style)
        if far:
            axes.set_yscale("log")
            plain_numbers(axes.yaxis)
        axes.set_ylim(low, high)

    title = f"Surface of {run.name}: distance to the reference"
    return over_frames(f"surface-{i}", title, "mm", draw) if any(measure for measure, _, _ in found) else None


def _inversion(comparison: Comparison) -> Drawing | None:
    reference, measures = comparison.reference, inversion(comparison.reference)

    def draw(axes: Axes) -> None:
        for measure, style in zip(measures, ("-", "--", ":", "-.") * len(measures), strict=False):
            label = label_of(measure) or "det F"
            _line(axes, reference.numbers, measure.values, label, color=REFERENCE, linestyle=style)
        axes.set_ylim(bottom=min(0.0, axes.get_ylim()[0]))

    title = "Smallest det F of the reference (inside out below 0)"
    return over_frames("inversion", title, "", draw) if measures else None


def _band(
    axes: Axes,
    comparison: Comparison,
    of: Of,
    measure: Measure,
    middle: Floats,
    linestyle: str | None = None,
    along: _Along | None = None,
) -> None:
    """Error bars of the reference, around ``middle`` (f,), where that is stated; with a ``linestyle`` its upper edge too."""
    bars = comparison.error_bars
    bar = bars and bars.find(of, measure.metric, measure.statistic)
    if not bar:
        return
    numbers, lower, upper = np.asarray(comparison.reference.numbers), middle - bar.values, middle + bar.values
    if along is not None:
        numbers, lower, upper = (values[along.kept] for values in (along.places, lower, upper))
    labelled = _KNOWN in axes.get_legend_handles_labels()[1]
    axes.fill_between(numbers, lower, upper, color=BAND, linewidth=0, label="_" if labelled else _KNOWN)
    if linestyle:
        axes.plot(numbers, upper, color="#888888", linewidth=1.0, linestyle=linestyle)


def _line(axes: Axes, numbers: ArrayLike, found: Floats, label: str, **look: str | float) -> None:
    """A measure over frames or angles; a cross on their axis where it is not finite."""
    frames, values = np.asarray(numbers), np.asarray(found, float)
    bad = ~np.isfinite(values)
    axes.plot(frames, np.where(bad, np.nan, values), label=label, **look)  # type: ignore[arg-type]
    if bad.any():
        low = axes.get_xaxis_transform()
        labelled = NOT_A_NUMBER in axes.get_legend_handles_labels()[1]
        mark = {"color": look["color"], "label": "_" if labelled else NOT_A_NUMBER}
        axes.plot(frames[bad], np.zeros(bad.sum()), "x", transform=low, clip_on=False, **mark)  # type: ignore[arg-type]
