"""Dihedral angles at the edges of a run's surface, compared with the reference.

Relative to rest, the mean magnitude is the dihedral angle change of the report DCSE/TR-2022-03 (eq. 5.23, Figs 6.18 to 6.20).
"""

import numpy as np

from fem_reference.foundations.mesh import Floats
from fem_reference.geometry.edges import Edges
from fem_reference.metrics import Measure, MeasurementContext, Statistic
from fem_reference.metrics.edge_extension import over_edges
from fem_reference.runs.store import Run

_CURVE = "Bending at the edges from rest, mean magnitude weighted by area"
STATISTICS = {
    "mean": Statistic("deg"),
    "mean_magnitude": Statistic("deg", curve=_CURVE, shown={"curve": 40}),
    "rms": Statistic("deg"),
    "p95": Statistic("deg"),
    "max": Statistic("deg", local=True),
    "mean_magnitude_of_edges": Statistic("deg"),
}
OF, AGAINST = "surface", "reference"


def measure(run: Run, reference: Run, _context: MeasurementContext) -> tuple[Measure, ...]:
    """Statistics, over the edges, of the angle minus the angle in the reference [deg], in (-180, 180].

    ``mean``: the signed mean, positive if edges are more convex. ``rms``: the root mean square. ``mean_magnitude``, ``p95`` and
    ``max``: the mean, the 95th percentile and the maximum of the magnitude. An edge is weighted by the area around it at rest,
    which is a third of the area of its two triangles. In ``mean_magnitude_of_edges`` all edges have the same weight, as in the
    report. NaN in frames in which a triangle has collapsed, because there is no angle then.
    """
    edges = Edges.of(reference.surface)
    angles, wanted = (np.array([edges.angles(points) for points in each.positions]) for each in (run, reference))
    turned = np.degrees(wrapped(angles - wanted))
    size = np.abs(turned)
    mean = size @ edges.areas / edges.areas.sum()
    more = {"mean_magnitude": mean, "mean_magnitude_of_edges": size.mean(axis=1)}
    return over_edges("dihedral_angle", turned, edges, reference, **more)


def wrapped(angles: Floats) -> Floats:
    """Differences of two angles, in (-2 pi, 2 pi), mapped to (-pi, pi]. Values that are already in this range do not change at all.

    >>> np.degrees(wrapped(np.radians([20.0, 340.0, -340.0]))).round(9).tolist()
    [20.0, -20.0, 20.0]
    """
    turns = np.where(angles > np.pi, 1, np.where(angles <= -np.pi, -1, 0))
    return np.asarray(angles - 2 * np.pi * turns)
