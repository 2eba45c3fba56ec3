"""Costs of every run, and costs of the reference in each frame."""

import math
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from fem_reference.assessment.comparison import Comparison
from fem_reference.assessment.fronts import LOAD, LOADED
from fem_reference.report.drawings import REFERENCE, Drawing, drawn
from fem_reference.report.words import under_load, words
from fem_reference.runs.store import Run

# Scalars of a run that are costs of a frame, with their names on the page.
_BY_FRAME = {
    "seconds_processor": "processor time [s]",
    "newton_iterations": "Newton iterations",
    "cut_backs": "cut-backs",
    "contact_points_near": "points checked for contact",
    "contact_points": "points in contact",
}


def facts(comparison: Comparison) -> dict[str, Any]:
    """The kinds of cost, and the cost of each frame of the reference."""
    reference = comparison.reference
    by_frame = {title: reference.scalars[name] for name, title in _BY_FRAME.items() if name in reference.scalars}
    loads = (run.outcome.cost.get(LOAD, math.nan) for run in comparison.runs)
    found = {"costs": _costs(comparison), "by_frame": by_frame, "frame_costs": _drawn(reference)}
    return found | {"load": under_load(loads, LOADED)}


def _drawn(reference: Run) -> Drawing | None:
    """A bar chart of the processor time of each frame; None if the times are not known."""
    seconds = reference.scalars.get("seconds_processor")
    if seconds is None:
        return None
    width = 0.8 * min(np.diff(reference.numbers), default=1)

    def draw(_: Figure, axes: Axes) -> None:
        axes.bar(reference.numbers, seconds, width, color=REFERENCE)
        axes.set(xlabel="frame", ylabel="s")

    return drawn("frame-costs", "Processor time of the reference for each frame", (5.4, 2.4), draw)


def _costs(comparison: Comparison) -> list[tuple[str, str, list[float | None]]]:
    """Each kind of cost, times first: its name, its unit, and its value for every run."""
    keys = dict.fromkeys(key for run in comparison.runs for key in run.outcome.cost)
    times = [key for key in keys if key.startswith("seconds")]
    rows = [("total" if key == "seconds" else words(key.removeprefix("seconds_")), "s", key) for key in times]
    rows += [(words(key), "", key) for key in keys if key not in times]
    return [(name, unit, [run.outcome.cost.get(key) for run in comparison.runs]) for name, unit, key in rows]
