"""What every run cost."""

from typing import Any

from fem_reference.assessment.comparison import Comparison
from fem_reference.report.sections import Section
from fem_reference.report.tables import runs
from fem_reference.report.words import words


def _facts(comparison: Comparison) -> dict[str, Any]:
    """The kinds of cost."""
    return {"costs": _costs(comparison)}


def _costs(comparison: Comparison) -> list[tuple[str, str, list[float | None]]]:
    """What each kind of cost was for every run: name, unit, values; times first."""
    keys = dict.fromkeys(key for run in runs(comparison) for key in run.outcome.cost)
    times = [key for key in keys if key.startswith("seconds")]
    rows = [("in all" if key == "seconds" else words(key.removeprefix("seconds_")), "s", key) for key in times]
    rows += [(words(key), "", key) for key in keys if key not in times]
    return [(name, unit, [run.outcome.cost.get(key) for run in runs(comparison)]) for name, unit, key in rows]


SECTION = Section(80, _facts, of_reference=False)
