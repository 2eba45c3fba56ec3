"""Difference between a field and the reference at the vertices, as a fraction of the maximum magnitude of the reference."""

import numpy as np

from fem_reference.metrics import FieldContext, Measure, Statistic, at_vertices, measures
from fem_reference.runs.store import Run

STATISTICS = {"max": Statistic("1", headline="off by up to {}", shown={"main": 50, "headline": 40})}
OF, AGAINST = "field", "reference"


def measure(run: Run, reference: Run, _context: FieldContext) -> tuple[Measure, ...]:
    """``max``: the maximum difference at a vertex divided by the maximum magnitude of the reference; not divided if this is 0."""
    size = np.abs(reference.vertex_values).max(axis=1)
    apart = np.abs(run.vertex_values - reference.vertex_values)
    values = apart.max(axis=1) / np.where(size > 0, size, 1.0)
    return measures("difference", {"max": values}, at_vertices(run, apart.argmax(axis=1)))
