"""Lengths of the edges of the surface in a run, compared with the reference, in per cent of the rest length of each edge.

If the surface is compared with the rest state instead, the values are l / L - 1 in per cent, where l is the length of an edge and L
its length at rest. The report DCSE/TR-2022-03 calls l / L the edge extension (Figs 6.15 to 6.17).
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
    """Statistics of the deviation ``(l - l_reference) / L`` [%] over all edges, where L is the length of an edge at rest.

    ``mean``: the signed mean. ``rms``: the root mean square. ``p95`` and ``max``: the 95th percentile and the maximum of the
    magnitude. The weight of an edge is its area at rest, a third of the area of the two adjacent triangles; ``max`` has no weights.
    ``mean_of_edges``: the signed mean with the same weight for every edge, as in the report (Figs 6.15 to 6.17).
    """
    edges = Edges.of(reference.surface)
    lengths, wanted = (np.array([edges.lengths(points) for points in each.positions]) for each in (run, reference))
    longer = 100 * (lengths - wanted) / edges.lengths(reference.surface.points)
    return over_edges("edge_extension", longer, edges, reference, mean_of_edges=longer.mean(axis=1))


def over_edges(name: str, deviations: Floats, edges: Edges, reference: Run, **more: Floats) -> tuple[Measure, ...]:
    """The measures of the metric ``name``, computed from the deviation of each edge. The worst place in a frame is the edge that
    deviates most.

    ``deviations`` (f, e): deviation of each of the e edges in each of the f frames. ``more``: values (f,) of further statistics.
    """
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
