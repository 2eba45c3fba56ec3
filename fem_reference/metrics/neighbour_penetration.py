"""Depth to which the muscle of a run and the other muscles of the same run penetrate each other, independent of the reference."""

from functools import lru_cache

import numpy as np

from fem_reference.foundations.mesh import place_of
from fem_reference.geometry.interpenetration import penetration
from fem_reference.metrics import Measure, MeasurementContext, Statistic, measures
from fem_reference.runs.store import Run

STATISTICS = {
    "deepest": Statistic(
        "mm",
        "Penetration of muscles",
        "deepest",
        headline="{} deep in another muscle",
        curve="Depth to which the muscle and another muscle penetrate each other",
        shown={"curve": 52, "headline": 60},
    )
}
OF, AGAINST = "surface", "itself"


def measure(run: Run, _reference: Run, _context: MeasurementContext) -> tuple[Measure, ...]:
    """``deepest`` [mm]: the maximum depth to which the surfaces of this muscle and another muscle penetrate each other, as in
    ``geometry.interpenetration.penetration``; 0 if they are apart. NaN in frames in which a surface is not known. A run without
    other muscles has no such measure.
    """
    return _measured(run) if run.others else ()


@lru_cache(maxsize=32)
def _measured(run: Run) -> tuple[Measure, ...]:
    """The measures of a run. They are the same against every reference and are computed once."""
    values, where = np.zeros(len(run.numbers)), [""] * len(run.numbers)
    for name, other in run.others.items():
        for i, number in enumerate(run.numbers):
            one, two = run.positions[i], other.positions[other.numbers.index(number)]
            if not (np.isfinite(one).all() and np.isfinite(two).all()):
                values[i], where[i] = np.nan, f"unknown surface of {name}"
                continue
            depth, place = penetration(run.surface.moved_to(one), other.surface.moved_to(two))
            if depth > values[i]:
                values[i], where[i] = depth, f"{name} at {place_of(place)}"
    return measures("neighbour_penetration", {"deepest": values}, where)
