"""Maximum of a field over the vertices."""

from fem_reference.metrics import FieldContext, Measure, Statistic, at_vertices, measures
from fem_reference.runs.store import Run

STATISTICS = {"value": Statistic("1")}
OF, AGAINST = "field", "itself"


def measure(run: Run, _reference: Run, _context: FieldContext) -> tuple[Measure, ...]:
    """``value``: the maximum over the vertices; NaN if any value is NaN."""
    values = run.vertex_values
    where = at_vertices(run, values.argmax(axis=1))
    return measures("maximum", {"value": values.max(axis=1)}, where)
