"""Volume of a run against that of the reference, frame by frame."""

import numpy as np

from fem_reference.foundations.mesh import enclosed_volume
from fem_reference.metrics import Measure, MeasurementContext
from fem_reference.runs.store import Run

UNITS = {"deviation": "%", "deviation_volume": "mm3"}
OF, AGAINST = "surface", "reference"


@np.errstate(over="ignore", invalid="ignore")
def measure(run: Run, reference: Run, _context: MeasurementContext) -> tuple[Measure, ...]:
    """``deviation`` = V / V_reference - 1 [%] and ``deviation_volume`` = V - V_reference [mm3] of the volume V."""
    volumes, wanted = (
        np.array([enclosed_volume(positions, each.surface.triangles) for positions in each.positions])
        for each in (run, reference)
    )
    values = {"deviation": 100 * (volumes / wanted - 1), "deviation_volume": volumes - wanted}
    return tuple(Measure("volume", name, UNITS[name], each, ("",) * len(volumes)) for name, each in values.items())
