"""Distance between a run's surface and the reference's surface: material (same vertex) and geometric (closest point).

A surface that slides along itself deviates materially but not geometrically. All means are weighted by the area around each vertex
at rest.
"""

import numpy as np

from fem_reference.foundations.mesh import Floats, place_of
from fem_reference.geometry.distance import distances
from fem_reference.metrics import Measure, MeasurementContext, Statistic, percentile, rms
from fem_reference.runs.store import Run

_TITLE = "Surface"
STATISTICS = {
    "rms": Statistic(
        "mm",
        _TITLE,
        "rms",
        headline="surface off by up to {} rms",
        shown={"main": 30, "table": 40, "headline": 10, "solvers": 40, "rank": 10, "claim": 10},
    ),
    "p95": Statistic("mm", _TITLE, "95th percentile", shown={"table": 50, "claim": 20}),
    "max": Statistic("mm", _TITLE, "worst vertex", shown={"main": 40, "table": 60, "claim": 30}, local=True),
    "distance_mean": Statistic("mm"),
    "distance_rms": Statistic("mm"),
    "hausdorff": Statistic("mm", _TITLE, "Hausdorff", shown={"table": 70, "solvers": 60}, local=True),
    "rms_percent": Statistic("%", _TITLE, "rms", share_of="maximum displacement", shown={"solvers": 50, "scenes": 30}),
    "p95_percent": Statistic("%"),
    "max_percent": Statistic("%", local=True),
    "distance_mean_percent": Statistic("%"),
    "distance_rms_percent": Statistic("%"),
    "hausdorff_percent": Statistic("%", local=True),
}
OF, AGAINST = "surface", "reference"


@np.errstate(over="ignore", invalid="ignore")
def measure(run: Run, reference: Run, context: MeasurementContext) -> tuple[Measure, ...]:
    """Material: ``rms``, ``p95`` (area-weighted 95th percentile) and ``max`` of the distances between corresponding vertices [mm].

    Geometric: ``distance_mean``, ``distance_rms`` and ``hausdorff`` (maximum) of the distances [mm] from the vertices of each
    surface to the closest point of the other surface. Only vertices are sampled, so ``hausdorff`` is a lower bound on the Hausdorff
    distance. Each statistic is also given as ``..._percent``, relative to the maximum displacement of the reference.
    """
    material = np.linalg.norm(run.positions - reference.positions, axis=2)
    geometric = np.array([_both_directions(run, reference, frame) for frame in range(len(reference.positions))])
    areas, twice = context.areas, np.concatenate([context.areas, context.areas])
    values = {
        "rms": rms(material, areas),
        "p95": np.array([percentile(each, areas, 0.95) for each in material]),
        "max": material.max(axis=1),
        "distance_mean": geometric @ twice / twice.sum(),
        "distance_rms": rms(geometric, twice),
        "hausdorff": geometric.max(axis=1),
    }
    values |= {f"{name}_percent": _percent(each, context.travel) for name, each in values.items()}
    worst = [_worst(deviations, reference) for deviations in (material, geometric)]
    return tuple(
        Measure(
            "surface_deviation", name, STATISTICS[name].unit, each, worst[name.startswith(("distance", "hausdorff"))]
        )
        for name, each in values.items()
    )


def _both_directions(run: Run, reference: Run, frame: int) -> Floats:
    """The distances (2n,) [mm] from the vertices of the run to the reference's surface, and from the vertices of the reference to
    the run's surface; NaN if a position is not finite.
    """
    here, there = (each.surface.moved_to(each.positions[frame]) for each in (run, reference))
    if np.array_equal(here.points, there.points):
        return np.zeros(len(here.points) + len(there.points))
    if not (np.isfinite(here.points).all() and np.isfinite(there.points).all()):
        return np.full(len(here.points) + len(there.points), np.nan)
    return np.concatenate([distances(here.points, there).distance, distances(there.points, here).distance])


def _percent(values: Floats, travel: float) -> Floats:
    """The ``values`` (f,) [mm] in per cent of ``travel`` [mm]. For a travel of 0, values of 0 give 0 and others infinity."""
    if travel == 0:
        return np.where(values == 0, 0.0, values + np.inf)
    return np.asarray(100 * values / travel)


def _worst(deviations: Floats, reference: Run) -> tuple[str, ...]:
    """The vertex with the largest deviation in each frame and its position in the reference, in words."""
    vertices = np.argmax(deviations, axis=1) % len(reference.surface.points)
    return tuple(
        f"vertex {vertex} at {place_of(at)}"
        for vertex, at in zip(vertices, reference.positions[np.arange(len(vertices)), vertices], strict=True)
    )
