"""How far each candidate is from the reference, at its worst frame."""

from itertools import groupby
from typing import Any

from fem_reference.assessment.comparison import Comparison
from fem_reference.report.sections import Section
from fem_reference.report.tables import DEVIATIONS


def _facts(_: Comparison) -> dict[str, Any]:
    """The columns in groups."""
    return {"groups": [(group, len(list(kept))) for group, kept in groupby(DEVIATIONS, key=lambda column: column[2])]}


SECTION = Section(10, _facts, needs=("candidates",))
