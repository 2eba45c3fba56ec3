"""The same closed surface of fewer triangles, or of more."""

import igl
import numpy as np

from fem_reference.foundations.mesh import Surface
from fem_reference.geometry.coarsening import coarsen


def resampled(surface: Surface, power: int) -> Surface:
    """``surface`` with ``4**power`` times as many triangles: each cut into four where ``power`` is above 0, so often, which moves
    nothing and leaves its vertices the first; else coarsened.
    """
    if power < 0:
        return coarsen(surface, max(4, round(len(surface.triangles) * 4**power)))
    points, triangles = np.array(surface.points), np.array(surface.triangles)
    if power:
        points, triangles = igl.upsample(points, triangles, power)
    return Surface(points, triangles, surface.place)
