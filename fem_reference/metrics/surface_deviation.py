"""How far the surface of a run is from the reference's: material (the same vertex) and geometric (the closest point).

A surface that slides along itself deviates materially and not geometrically. All means are weighted by the area
around each vertex at rest.
"""

import numpy as np

from fem_reference.geometry.distance import distances
from fem_reference.mesh import Floats
from fem_reference.metrics import Measure, Yardstick
from fem_reference.runs import Run

UNITS = {"rms": "mm", "p95": "mm", "max": "mm", "rms_percent": "%", "max_percent": "%"}
UNITS |= {"distance_mean": "mm", "distance_rms": "mm", "hausdorff": "mm"}


@np.errstate(over="ignore", invalid="ignore")
def measure(run: Run, reference: Run, yardstick: Yardstick) -> tuple[Measure, ...]:
    """Material and geometric deviation.

    Material, of the distance of the same vertex: ``rms``, ``p95`` (95th percentile) and ``max`` [mm], and
    ``rms_percent`` and ``max_percent`` of the reference's greatest displacement.

    Geometric, of the distances from the vertices of each surface to the closest point of the other, over both
    directions: ``distance_mean``, ``distance_rms`` and ``hausdorff`` [mm]. Only vertices are sampled, so
    ``hausdorff`` is a lower bound of the Hausdorff distance.
    """
    material = np.linalg.norm(run.positions - reference.positions, axis=2)
    geometric = np.array([_both_ways(run, reference, frame) for frame in range(len(reference.positions))])
    twice = np.concatenate([yardstick.areas, yardstick.areas])
    return (*_material(material, reference, yardstick), *_geometric(geometric, reference, twice))


def _material(deviations: Floats, reference: Run, yardstick: Yardstick) -> tuple[Measure, ...]:
    """The material statistics of ``deviations`` (f, n) [mm]."""
    rms, greatest = _rms(deviations, yardstick.areas), deviations.max(axis=1)
    values = {
        "rms": rms,
        "p95": np.array([_percentile(each, yardstick.areas, 0.95) for each in deviations]),
        "max": greatest,
        "rms_percent": _percent(rms, yardstick.travel),
        "max_percent": _percent(greatest, yardstick.travel),
    }
    return _measures(values, _worst(deviations, reference))


def _geometric(deviations: Floats, reference: Run, areas: Floats) -> tuple[Measure, ...]:
    """The geometric statistics of ``deviations`` (f, 2n) [mm], each vertex of the run, then each of the reference."""
    values = {
        "distance_mean": deviations @ areas / areas.sum(),
        "distance_rms": _rms(deviations, areas),
        "hausdorff": deviations.max(axis=1),
    }
    return _measures(values, _worst(deviations, reference))


def _measures(values: dict[str, Floats], where: tuple[str, ...]) -> tuple[Measure, ...]:
    return tuple(Measure("surface_deviation", name, UNITS[name], each, where) for name, each in values.items())


def _both_ways(run: Run, reference: Run, frame: int) -> Floats:
    """Distance (2n,) [mm] of the run's vertices to the reference's surface, then of the reference's to the run's.

    NaN where a position of the frame is not finite.
    """
    here, there = (each.surface.moved_to(each.positions[frame]) for each in (run, reference))
    if not (np.isfinite(here.points).all() and np.isfinite(there.points).all()):
        return np.full(len(here.points) + len(there.points), np.nan)
    return np.concatenate([distances(here.points, there).distance, distances(there.points, here).distance])


def _rms(deviations: Floats, areas: Floats) -> Floats:
    """Root of the area-weighted mean square of each row of (f, n), (f,)."""
    return np.asarray(np.sqrt(deviations**2 @ areas / areas.sum()))


def _percentile(values: Floats, weights: Floats, share: float) -> float:
    """The least of ``values`` (n,) that ``share`` of the weight does not exceed; NaN where one is not finite."""
    if not np.isfinite(values).all():
        return float("nan")
    order = np.argsort(values)
    below = np.cumsum(weights[order])
    return float(values[order[np.searchsorted(below, share * below[-1])]])


def _percent(values: Floats, travel: float) -> Floats:
    """``values`` (f,) [mm] in per cent of ``travel`` [mm]; where nothing travels 0 stays 0, the rest is infinite."""
    if travel == 0:
        return np.where(values == 0, 0.0, values + np.inf)
    return np.asarray(100 * values / travel)


def _worst(deviations: Floats, reference: Run) -> tuple[str, ...]:
    """By frame the vertex with the greatest deviation, and where the reference has it."""
    vertices = np.argmax(deviations, axis=1) % len(reference.surface.points)
    return tuple(
        f"vertex {vertex} at ({x:.1f}, {y:.1f}, {z:.1f}) mm"
        for vertex, (x, y, z) in zip(vertices, reference.positions[np.arange(len(vertices)), vertices], strict=True)
    )
