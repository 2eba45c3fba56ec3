"""Measures over the frames: curves, and every number."""

from typing import Any

from fem_reference.assessment.comparison import Comparison
from fem_reference.report.curves import curves
from fem_reference.report.sections import Section


def _facts(comparison: Comparison) -> dict[str, Any]:
    """The curves."""
    return {"curves": curves(comparison)}


SECTION = Section(50, _facts)
