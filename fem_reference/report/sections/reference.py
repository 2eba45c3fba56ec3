"""The reference against its own rest state, and warnings about it."""

import math
from typing import Any

import numpy as np

from fem_reference.assessment import second_check
from fem_reference.assessment.comparison import Comparison
from fem_reference.foundations.limits import ENERGY_GAP
from fem_reference.metrics import Measure
from fem_reference.report.tables import inversion
from fem_reference.runs.store import Run


def facts(_: Comparison) -> dict[str, Any]:
    """The functions for its tiles and warnings."""
    found = {"inversion": inversion, "least": least, "greatest": greatest, "gap": gap}
    return found | {"energy_gap_limit": ENERGY_GAP, "second_check": second_check.texts_of}


def greatest(run: Run, scalar: str) -> float:
    """The greatest value of a scalar over the frames that have one, NaN if no frame has."""
    values = run.scalars[scalar]
    return float(np.nanmax(values)) if np.isfinite(values).any() else float("nan")


def gap(run: Run) -> float:
    """The energy gap that is farthest from 0 [%], NaN if there is none."""
    values = run.scalars["energy_gap"]
    return 100 * float(values[np.nanargmax(np.abs(values))]) if np.isfinite(values).any() else math.nan


def least(measure: Measure) -> float:
    """The smallest value of a measure over the frames where it is a number, NaN without such a frame."""
    known = measure.values[np.isfinite(measure.values)]
    return float(known.min()) if len(known) else math.nan
