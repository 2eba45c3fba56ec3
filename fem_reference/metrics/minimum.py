"""The least value of a field at a vertex."""

from fem_reference.metrics import FieldContext, Measure, at_vertices
from fem_reference.runs.store import Run

UNITS = {"value": "1"}
OF, AGAINST = "field", "itself"


def measure(run: Run, _reference: Run, _context: FieldContext) -> tuple[Measure, ...]:
    """``value``, the least over the vertices; NaN where one is not a number."""
    values = run.vertex_values
    where = at_vertices(run, values.argmin(axis=1))
    return (Measure("minimum", "value", "1", values.min(axis=1), where),)
