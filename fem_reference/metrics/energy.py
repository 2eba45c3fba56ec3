"""Energy stored in a muscle by all its effects, but not in attachment springs or contact; only some solvers compute it.

Apart from springs, contact and dissipation, the change of energy is the work of the bones, and the derivative of the energy with
respect to a joint angle is minus the moment.
"""

from fem_reference.metrics import Measure, MeasurementContext, Statistic, measures
from fem_reference.runs.store import Run

STATISTICS = {
    "stored": Statistic(
        "N mm", "Energy", "stored", curve="Stored energy", shown={"curve": 29, "angle": 29}, local=True, lone=True
    )
}
OF, AGAINST = "surface", "reference"


def measure(run: Run, reference: Run, context: MeasurementContext) -> tuple[Measure, ...]:  # noqa: ARG001
    """``stored`` [N mm]: the energy minus the energy of the reference; relative to rest, the energy itself."""
    own, other = (one.scalars.get("energy") for one in (run, reference))
    if own is None or (other is None and reference.solver != "rest"):
        return ()
    return measures("energy", {"stored": own if other is None else own - other})
