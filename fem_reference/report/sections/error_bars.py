"""Error bars of the reference, and the variations that they come from."""

from typing import Any

import numpy as np

from fem_reference.assessment.comparison import Comparison
from fem_reference.assessment.error_bars import ErrorBar
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
    }


def _model_change(bar: ErrorBar) -> float | None:
    """The greatest change by another model over the frames that it reached, None if it reached none."""
    reached = np.zeros(0) if bar.model is None else bar.model[np.isfinite(bar.model)]
    return float(reached.max()) if len(reached) else None
