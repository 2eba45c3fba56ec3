"""Stresses in the volume of a muscle, from solvers that compute them: means and quantiles over the volume at rest.

The stresses are the Cauchy stress along the deformed fibres, the von Mises stress, and the pressure, which is positive in
compression, at four points of each tetrahedron. The maximum stress is not measured: at the rim of an attachment it grows without
bound as the mesh is refined. Runs without stresses have no such measures.
"""

from functools import partial

from fem_reference.metrics import Measure, MeasurementContext, Statistic, measures
from fem_reference.runs.store import Run

_of_field = partial(Statistic, "kPa", "Stress", local=True, pooled=True)
STATISTICS = {
    "along_fibres_mean": _of_field(
        "along fibres, mean", curve="Stress along the fibres, mean over the volume", shown={"curve": 32}
    ),
    "along_fibres_p95": _of_field("along fibres, 95th percentile"),
    "von_mises_mean": _of_field("von Mises, mean"),
    "von_mises_p95": _of_field(
        "von Mises, 95th percentile", curve="Von Mises stress, 95th percentile over the volume", shown={"curve": 33}
    ),
    "pressure_mean": _of_field("pressure, mean", curve="Pressure, mean over the volume", shown={"curve": 34}),
    "pressure_p05": _of_field("pressure, 5th percentile"),
    "pressure_p95": _of_field("pressure, 95th percentile"),
}
OF, AGAINST = "surface", "reference"
_KILO = 1000.0  # kPa per MPa


def measure(run: Run, reference: Run, context: MeasurementContext) -> tuple[Measure, ...]:  # noqa: ARG001
    """The differences [kPa] from the reference; relative to rest, the stresses themselves."""
    found = {}
    for name in STATISTICS:
        own, other = (one.scalars.get(f"stress_{name}") for one in (run, reference))
        if own is not None and (other is not None or reference.solver == "rest"):
            found[name] = _KILO * (own if other is None else own - other)
    return measures("stress", found)
