"""Fractions of a run's surface that are inside out or lie within another part of the body, compared with the reference.

These fractions need only the surface, so every run has them. For a solver with an interior, the smallest det F is a stricter test.
"""

from functools import lru_cache

import numpy as np

from fem_reference.foundations.mesh import Floats, place_of, triangle_areas
from fem_reference.geometry.distance import outer_windings
from fem_reference.metrics import Measure, MeasurementContext, Statistic, measures
from fem_reference.runs.store import Run

STATISTICS = {"inside_out": Statistic("%"), "overlapping": Statistic("%")}
OF, AGAINST = "surface", "reference"


def measure(run: Run, reference: Run, _context: MeasurementContext) -> tuple[Measure, ...]:
    """Fractions of the surface, by its area at rest, minus the fractions in the reference [%].

    ``inside_out``: triangles whose outer side faces a part of the body that is turned inside out. ``overlapping``: triangles inside
    another part of the body. NaN in frames in which a triangle has collapsed, because it has no outer side then.
    """
    windings, wanted = _windings(run), _windings(reference)
    areas = triangle_areas(reference.surface.points, reference.surface.triangles)
    inside_out = _share(-windings, areas) - _share(-wanted, areas)
    overlapping = _share(windings, areas) - _share(wanted, areas)
    return (
        *measures("inversion", {"inside_out": inside_out}, _first(-windings, run)),
        *measures("inversion", {"overlapping": overlapping}, _first(windings, run)),
    )


@lru_cache(maxsize=4)  # a run is measured against many others, and this takes most of the time
def _windings(run: Run) -> Floats:
    """The outer windings (f, m) of the triangles in each frame; they are computed only once for frames that share an array."""
    still = run.positions.strides[0] == 0
    once = np.array([outer_windings(run.surface.moved_to(points)) for points in run.positions[: 1 if still else None]])
    found = np.broadcast_to(once, (len(run.positions), once.shape[1]))
    found.flags.writeable = False
    return found


def _share(windings: Floats, areas: Floats) -> Floats:
    """The fraction (f,) [%] of the ``areas`` (m,) with positive ``windings`` (f, m) in each frame; NaN if a winding is NaN."""
    share = 100 * (windings > 0) @ areas / areas.sum()
    return np.where(np.isnan(windings).any(axis=1), np.nan, share)


def _first(windings: Floats, run: Run) -> tuple[str, ...]:
    """The triangle with the largest of ``windings`` (f, m) in each frame and its position, in words; empty if none is positive."""
    found = np.argmax(windings, axis=1)
    middles = run.positions[np.arange(len(found))[:, None], run.surface.triangles[found]].mean(axis=1)
    return tuple(
        "" if line[triangle] <= 0 else f"triangle {triangle} at {place_of(at)}"
        for line, triangle, at in zip(windings, found, middles, strict=True)
    )
