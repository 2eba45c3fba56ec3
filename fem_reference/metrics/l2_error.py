"""L2 norm of the error of a field over its domain, for cases with a known exact solution."""

from functools import partial

import numpy as np

from fem_reference.geometry.field_mesh import l2_distance
from fem_reference.metrics import FieldContext, Measure, Statistic, measures
from fem_reference.problems.scalar import at
from fem_reference.runs.store import Run

STATISTICS = {"norm": Statistic("1", headline="L2 error {}", shown={"main": 60, "headline": 50})}
OF, AGAINST = "field", "exact"


def measure(run: Run, _reference: Run, context: FieldContext) -> tuple[Measure, ...]:
    """``norm``: the root of the integral of the squared error; no measure if no exact solution is known."""
    if context.exact is None or run.mesh is None:
        return ()
    exact = partial(at, context.exact)
    norms = np.array([l2_distance(run.mesh, values, exact) for values in run.values])
    return measures("l2_error", {"norm": norms})
