"""Volume enclosed by the surface of a run, compared with the reference, frame by frame."""

import numpy as np

from fem_reference.foundations.mesh import enclosed_volume
from fem_reference.metrics import Measure, MeasurementContext, Shown, Statistic, measures
from fem_reference.runs.store import Run

_FIRST: tuple[Shown, ...] = ("main", "table", "curve", "solvers", "scenes")  # places at which the volume comes first
# The volume is nearly constant, so its error hardly shows the order of convergence; the order of the worst point is used.
STATISTICS = {
    "deviation": Statistic(
        "%",
        "Volume",
        headline="volume by {}",
        curve="Change of volume from rest",
        shown={**dict.fromkeys(_FIRST, 10), "headline": 30, "rank": 30, "claim": 70},
        local=True,
    ),
    "deviation_volume": Statistic("mm3", local=True),
}
OF, AGAINST = "surface", "reference"


@np.errstate(over="ignore", invalid="ignore")
def measure(run: Run, reference: Run, _context: MeasurementContext) -> tuple[Measure, ...]:
    """``deviation``: V / V_reference - 1 [%]. ``deviation_volume``: V - V_reference [mm3]. V is the enclosed volume."""
    volumes, wanted = (
        np.array([enclosed_volume(positions, each.surface.triangles) for positions in each.positions])
        for each in (run, reference)
    )
    values = {"deviation": 100 * (volumes / wanted - 1), "deviation_volume": volumes - wanted}
    return measures("volume", values)
