"""What the case expects, and whether it is so."""

from typing import Any

from fem_reference.assessment.comparison import Comparison
from fem_reference.report.sections import Section


def _facts(_: Comparison) -> dict[str, Any]:
    """Nothing but the comparison itself."""
    return {}


SECTION = Section(60, _facts, needs=("verdicts",))
