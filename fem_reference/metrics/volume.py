"""How much volume a run loses or gains against the reference, frame by frame."""

import numpy as np

from fem_reference.mesh import enclosed_volume
from fem_reference.metrics import Measure, Yardstick
from fem_reference.runs import Run


@np.errstate(over="ignore", invalid="ignore")
def measure(run: Run, reference: Run, _yardstick: Yardstick) -> tuple[Measure, ...]:
    """``deviation`` = V / V_reference - 1 [%] and ``deviation_volume`` = V - V_reference [mm3] of the volume V."""
    volumes, wanted = (
        np.array([enclosed_volume(positions, each.surface.triangles) for positions in each.positions])
        for each in (run, reference)
    )
    nowhere = ("",) * len(volumes)
    return (
        Measure("volume", "deviation", "%", 100 * (volumes / wanted - 1), nowhere),
        Measure("volume", "deviation_volume", "mm3", volumes - wanted, nowhere),
    )
