"""Error bars of the reference, and the variations that they come from."""

from typing import Any

import numpy as np

from fem_reference.assessment.comparison import Comparison
from fem_reference.assessment.error_bars import ErrorBar
from fem_reference.report.tables import known
from fem_reference.report.words import listed

# The same springs at points of the surface and over facets of the tetrahedra, on gluteus_medius and gluteus_maximus at 1 rad.
SPREAD = (
    "Attachments are springs, and 5 to 9 % of a force or moment depend on how the same springs are spread over them "
    "(5.3 and 8.8 % on two muscles of the hip): the error bars of forces and moments leave that out"
)


def facts(comparison: Comparison) -> dict[str, Any]:
    """The variations of the reference for its error bars, tetrahedra first."""
    parts = list(dict.fromkeys(name for bar in known(comparison) for name in bar.parts))
    return {
        "parts": parts,
        "variations": listed(parts[1:]) if parts[1:] else "",
        "modelled": any(bar.model is not None for bar in known(comparison)),
        "model_change": _model_change,
        "spread": spread(comparison),
    }


def spread(comparison: Comparison) -> str:
    """The sentence on what error bars of forces leave out; empty where none are known or no attachment is by springs."""
    forces = any(bar.metric == "joint_moment" for bar in known(comparison))
    return SPREAD if forces and any(one.stiffness is not None for one in comparison.setup.attached) else ""


def _model_change(bar: ErrorBar) -> float | None:
    """The greatest change by another model over the frames that it reached, None if it reached none."""
    reached = np.zeros(0) if bar.model is None else bar.model[np.isfinite(bar.model)]
    return float(reached.max()) if len(reached) else None
