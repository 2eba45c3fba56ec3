"""Candidates in the order of their deviations, where error bars tell them apart."""

from typing import Any

from fem_reference.assessment.comparison import Comparison
from fem_reference.report.sections import Section


def _facts(comparison: Comparison) -> dict[str, Any]:
    """The rankings."""
    return {"rankings": comparison.rankings}


SECTION = Section(20, _facts, needs=("rankings",))
