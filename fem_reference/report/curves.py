"""Curves over frames and over the angles of joints, for the page of a comparison."""

from collections.abc import Sequence
from dataclasses import replace
from functools import partial

import numpy as np
from matplotlib.axes import Axes
from numpy.typing import NDArray

from fem_reference.assessment.comparison import Comparison
from fem_reference.foundations.mesh import Floats
from fem_reference.metrics import Measure, MeasurementContext, described, find
from fem_reference.metrics.moment_arm import turning
from fem_reference.report.drawings import BAND, NOT_A_NUMBER, REFERENCE, Drawing, looks, over_frames, plain_numbers
from fem_reference.report.tables import inversion
from fem_reference.report.words import words

_KNOWN = "error bar"
_FAR = 50.0  # the ratio of the maximum distances of two candidates beyond which the common axis is logarithmic
_RANGE = "minimum and maximum over the fibres"
_STATISTICS = (
    ("max", "worst vertex", "-"),
    ("hausdorff", "Hausdorff", "--"),
    ("p95", "95th percentile", "-."),
    ("rms", "rms", ":"),
)


def curves(comparison: Comparison) -> list[Drawing]:
    """All drawings for which the comparison has values."""
    found = [_surface(comparison, i) for i in range(len(comparison.candidates))]
    found += [_of_runs(comparison, key, one.curve) for key, one in described("curve").items()]
    context = comparison.context
    for i in range(len(context.joints) if isinstance(context, MeasurementContext) else 0):
        found += [_of_runs(comparison, key, one.curve, i) for key, one in described("angle").items()]
    return [drawing for drawing in [*found, _inversion(comparison)] if drawing is not None]


def label_of(inverted: Measure) -> str:
    """The words that distinguish measures of inversion: the kind of points at which det F is evaluated."""
    return words(inverted.statistic.removeprefix("min_det_F").lstrip("_"))


def _of_runs(comparison: Comparison, key: tuple[str, str], title: str, i: int | None = None) -> Drawing | None:
    """A drawing of the change of a measure from rest for every run, with the error bar of the reference. None if no run has the
    measure.

    The change is drawn over frames or, with a joint ``i``, over the angle of this joint in frames in which only this joint rotates.
    """
    context, numbers = comparison.context, comparison.reference.numbers
    measures = {run.name: find(comparison.changes[run.name], *key) for run in comparison.runs}
    found = {run: measure for run, measure in measures.items() if measure is not None}
    name, over, along, shown = "-".join(key), "frame", np.asarray(numbers, float), np.ones(len(numbers), bool)
    if i is not None:
        assert isinstance(context, MeasurementContext)  # only muscles have joints
        joint, shown = context.joints[i], turning(context.joints, context, numbers) == i
        name, over, along = f"{name}-{i}", f"angle of {joint.name} [°]", np.degrees(joint.angles(numbers))
        title = f"{title}, over the angle"
        found = found if any(np.isfinite(one.values[shown]).any() for one in found.values()) else {}
    draw = partial(_draw_runs, comparison, found, along, shown)
    return over_frames(name, title, next(iter(found.values())).unit, draw, over) if found else None


def _draw_runs(
    comparison: Comparison, found: dict[str, Measure], along: Floats, shown: NDArray[np.bool_], axes: Axes
) -> None:
    """Draw the measures ``found`` of the runs over ``along`` (f,) at the frames ``shown`` (f,), and for the reference
    also the range over its fibres.
    """
    look_by_name = looks(run.name for run in comparison.runs)
    for i, run in enumerate(comparison.runs):
        if run.name not in found:
            continue
        one, look = found[run.name], look_by_name[run.name]
        if i == 0 and one.error_bars is not None:
            _band(axes, along[shown], one.values[shown], one.error_bars[shown])
        kept = replace(one, values=one.values[shown])
        _line(axes, along[shown], kept, run.name, linewidth=2.4 if i == 0 else 1.5, **look)
        for end in ("least", "greatest") if one.statistic == "mean" and i == 0 else ():
            if other := find(comparison.changes[run.name], one.metric, end):
                label = "_" if _RANGE in axes.get_legend_handles_labels()[1] else _RANGE
                axes.plot(along[shown], other.values[shown], ":", color=REFERENCE, linewidth=0.8, label=label)


def surface_limits(comparison: Comparison) -> tuple[float, float, bool]:
    """The lower and upper end [mm] of the common axis of all surface curves, and True if candidates differ so much that the axis is
    logarithmic.
    """
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
    """A drawing of the distances of a candidate's surface from the reference, with the error bars of the reference."""
    run = comparison.candidates[i]
    low, high, far = surface_limits(comparison)
    measures, colour = comparison.deviations[run.name], looks(one.name for one in comparison.runs)[run.name]["color"]
    found = [(find(measures, "surface_deviation", statistic), label, style) for statistic, label, style in _STATISTICS]

    def draw(axes: Axes) -> None:
        for measure, label, style in found:
            if measure is not None:
                if (bar := measure.error_bars) is not None:
                    _band(axes, run.numbers, np.zeros(len(bar)), bar)
                    axes.plot(run.numbers, bar, color="#888888", linewidth=1.0, linestyle=style)
                _line(axes, run.numbers, measure, label, color=colour, linestyle=style)
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
            _line(axes, reference.numbers, measure, label, color=REFERENCE, linestyle=style)
        axes.set_ylim(bottom=min(0.0, axes.get_ylim()[0]))

    title = "Smallest det F of the reference (inside out below 0)"
    return over_frames("inversion", title, "", draw) if measures else None


def _band(axes: Axes, along: Sequence[float] | Floats, middle: Floats, bar: Floats) -> None:
    """Draw the error bars ``bar`` (f,) around the curve ``middle`` (f,) over ``along`` (f,)."""
    labelled = _KNOWN in axes.get_legend_handles_labels()[1]
    axes.fill_between(along, middle - bar, middle + bar, color=BAND, linewidth=0, label="_" if labelled else _KNOWN)


def _line(axes: Axes, numbers: Sequence[float] | Floats, measure: Measure, label: str, **look: str | float) -> None:
    """Draw a measure over frames ``numbers``, with a cross on the axis at each frame whose value is not finite."""
    frames, values = np.asarray(numbers), np.asarray(measure.values, float)
    bad = ~np.isfinite(values)
    axes.plot(frames, np.where(bad, np.nan, values), label=label, **look)  # type: ignore[arg-type]
    if bad.any():
        low = axes.get_xaxis_transform()
        labelled = NOT_A_NUMBER in axes.get_legend_handles_labels()[1]
        mark = {"color": look["color"], "label": "_" if labelled else NOT_A_NUMBER}
        axes.plot(frames[bad], np.zeros(bad.sum()), "x", transform=low, clip_on=False, **mark)  # type: ignore[arg-type]
