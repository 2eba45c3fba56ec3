"""Stresses in the muscle's volume, of solvers that have them: means and quantiles over the volume at rest of the Cauchy stress.

Along the fibres as they are, by von Mises, and the pressure, above 0 in compression, at four points of each tetrahedron: the
greatest stress, at the rim of an attachment, grows without bound as these get smaller. Of runs without stresses there is none.
"""

from fem_reference.metrics import Measure, MeasurementContext, Statistic, measures
from fem_reference.runs.store import Run

_TITLE = "Stress"
STATISTICS = {
    "along_fibres_mean": Statistic(
        *("kPa", _TITLE, "along fibres, mean"),
        curve="Stress along the fibres, mean over the volume",
        shown={"curve": 32},
        local=True,
        pooled=True,
    ),
    "along_fibres_p95": Statistic("kPa", _TITLE, "along fibres, 95 % below", local=True, pooled=True),
    "von_mises_mean": Statistic("kPa", _TITLE, "von Mises, mean", local=True, pooled=True),
    "von_mises_p95": Statistic(
        *("kPa", _TITLE, "von Mises, 95 % below"),
        curve="Von Mises stress, which 95 % of the volume do not exceed",
        shown={"curve": 33},
        local=True,
        pooled=True,
    ),
    "pressure_mean": Statistic(
        *("kPa", _TITLE, "pressure, mean"),
        curve="Pressure, mean over the volume",
        shown={"curve": 34},
        local=True,
        pooled=True,
    ),
    "pressure_p05": Statistic("kPa", _TITLE, "pressure, 5 % below", local=True, pooled=True),
    "pressure_p95": Statistic("kPa", _TITLE, "pressure, 95 % below", local=True, pooled=True),
}
OF, AGAINST = "surface", "reference"
_KILO = 1000.0  # kPa in a MPa


def measure(run: Run, reference: Run, context: MeasurementContext) -> tuple[Measure, ...]:  # noqa: ARG001
    """The differences [kPa] from the reference; against rest, the stresses themselves."""
    found = {}
    for name in STATISTICS:
        own, other = (one.scalars.get(f"stress_{name}") for one in (run, reference))
        if own is not None and (other is not None or reference.solver == "rest"):
            found[name] = _KILO * (own if other is None else own - other)
    return measures("stress", found)
