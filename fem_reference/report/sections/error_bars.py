"""Error bars of the reference, and the variations that they come from."""

from dataclasses import replace
from typing import Any

import numpy as np

from fem_reference.assessment.comparison import Comparison
from fem_reference.assessment.error_bars import ErrorBar
from fem_reference.metrics import Measure
from fem_reference.report.tables import known
from fem_reference.report.words import listed


def facts(comparison: Comparison) -> dict[str, Any]:
    """The variations of the reference for its error bars, tetrahedra first."""
    parts = list(dict.fromkeys(name for bar in known(comparison) for name in bar.parts))
    return {
        "parts": parts,
        "variations": listed(parts[1:]) if parts[1:] else "",
        "modelled": any(bar.model is not None for bar in known(comparison)),
        "model_change": _model_change,
        "widest": widest,
    }


def widest(bar: ErrorBar, measure: Measure | None) -> int:
    """The index of the widest of a ``bar`` among the frames in which the reference's ``measure`` has a value, such as a moment arm
    where there is a force; an unknown bar there counts as the greatest.
    """
    if measure is None or not np.isfinite(measure.values).any():
        return bar.widest
    return replace(bar, values=np.where(np.isfinite(measure.values), bar.values, -1.0)).widest


def _model_change(bar: ErrorBar) -> float | None:
    """The greatest change by another model over the frames that it reached, None if it reached none."""
    reached = np.zeros(0) if bar.model is None else bar.model[np.isfinite(bar.model)]
    return float(reached.max()) if len(reached) else None
