"""Minimum of a field over the vertices."""

from fem_reference.metrics import FieldContext, Measure, Statistic, at_vertices, measures
from fem_reference.runs.store import Run

STATISTICS = {"value": Statistic("1")}
OF, AGAINST = "field", "itself"


def measure(run: Run, _reference: Run, _context: FieldContext) -> tuple[Measure, ...]:
    """``value``: the minimum over the vertices; NaN if any value is NaN."""
    values = run.vertex_values
    where = at_vertices(run, values.argmin(axis=1))
    return measures("minimum", {"value": values.min(axis=1)}, where)
