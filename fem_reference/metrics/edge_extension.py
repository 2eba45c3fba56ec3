"""Lengths of the edges of a run's surface, compared with the reference, in per cent of their rest length.

Against rest this is the edge extension of the report (l / L of Figs 6.15 to 6.17) minus one.
"""

import numpy as np

from fem_reference.foundations.mesh import Floats, place_of
from fem_reference.geometry.edges import Edges
from fem_reference.metrics import Measure, MeasurementContext, Statistic, measures, percentile, rms
from fem_reference.runs.store import Run

STATISTICS = {
    "mean": Statistic("%", curve="Extension of edges from rest, mean weighted by area", shown={"curve": 30}),
    "rms": Statistic("%"),
    "p95": Statistic("%"),
    "max": Statistic("%", local=True),
    "mean_of_edges": Statistic("%"),
}
OF, AGAINST = "surface", "reference"


@np.errstate(over="ignore", invalid="ignore", divide="ignore")
def measure(run: Run, reference: Run, _context: MeasurementContext) -> tuple[Measure, ...]:
    """Statistics over the edges of ``(l - l_reference) / L`` [%], L the length at rest: the signed ``mean`` and the ``rms``; for
    the magnitude the 95th percentile (``p95``) and the greatest (``max``).

    An edge is weighted by the area around it at rest, a third of its two triangles. In ``mean_of_edges`` all edges have the same
    weight, as in the report.
    """
    edges = Edges.of(reference.surface)
    lengths, wanted = (np.array([edges.lengths(points) for points in each.positions]) for each in (run, reference))
    longer = 100 * (lengths - wanted) / edges.lengths(reference.surface.points)
    return over_edges("edge_extension", longer, edges, reference, mean_of_edges=longer.mean(axis=1))


def over_edges(name: str, deviations: Floats, edges: Edges, reference: Run, **more: Floats) -> tuple[Measure, ...]:
    """The measures ``name`` from ``deviations`` (f, e) by edge and ``more`` (f,); the worst point: the edge that deviates most."""
    size = np.abs(deviations)
    values = {
        "mean": deviations @ edges.areas / edges.areas.sum(),
        "rms": rms(deviations, edges.areas),
        "p95": np.array([percentile(each, edges.areas, 0.95) for each in size]),
        "max": size.max(axis=1),
    }
    ends = edges.ends[size.argmax(axis=1)]
    middles = reference.positions[np.arange(len(ends))[:, None], ends].mean(axis=1)
    places = zip(np.sort(ends), middles, strict=True)
    return measures(name, values | more, [f"edge {one} to {other} at {place_of(at)}" for (one, other), at in places])
