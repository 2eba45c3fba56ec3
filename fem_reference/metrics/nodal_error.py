"""Error of a field at the vertices, for cases with a known exact solution."""

import numpy as np

from fem_reference.metrics import FieldContext, Measure, Statistic, at_vertices, measures
from fem_reference.problems.scalar import at
from fem_reference.runs.store import Run

STATISTICS = {"max": Statistic("1")}
OF, AGAINST = "field", "exact"


def measure(run: Run, _reference: Run, context: FieldContext) -> tuple[Measure, ...]:
    """``max``: the maximum magnitude of the error over the vertices; no measure if no exact solution is known."""
    if context.exact is None:
        return ()
    errors = np.abs(run.vertex_values - at(context.exact, run.points))
    where = at_vertices(run, errors.argmax(axis=1))
    return measures("nodal_error", {"max": errors.max(axis=1)}, where)
