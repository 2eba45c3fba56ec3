"""Quantities at every vertex and fibre point of a run in each frame, for the colours of a view and for ParaView."""

import numpy as np

from fem_reference.foundations.errors import InputError
from fem_reference.foundations.mesh import Floats, Polylines
from fem_reference.geometry.signed_distance import signed_distances
from fem_reference.metrics import MeasurementContext
from fem_reference.problems.setup import DISTANCE_MARGIN
from fem_reference.runs.store import Run


@np.errstate(over="ignore", invalid="ignore")
def to_same_vertex(run: Run, reference: Run) -> Floats:
    """The distance (f, n) [mm] of each vertex from the same vertex of the reference; NaN if unknown."""
    return np.asarray(np.linalg.norm(run.positions - reference.positions, axis=2))


def to_surface(run: Run, reference: Run) -> Floats:
    """The distance (f, n) [mm] of each vertex from the surface of the reference, negative inside; NaN if unknown."""
    found = np.full(run.positions.shape[:2], np.nan)
    for i, (points, others) in enumerate(zip(run.positions, reference.positions, strict=True)):
        if np.isfinite(points).all() and np.isfinite(others).all():
            found[i] = signed_distances(points, reference.surface.moved_to(others))
    return found


def to_bones(run: Run, context: MeasurementContext) -> Floats | None:
    """The distance (f, n) [mm] of each vertex from the nearest bone, negative inside and at most ``DISTANCE_MARGIN``.

    NaN for vertices that are exempt from contact, and in frames in which a vertex is unknown. None if a bone is not closed and so
    has no inside.
    """
    gaps = np.full(run.positions.shape[:2], DISTANCE_MARGIN)
    try:
        for i, (number, points) in enumerate(zip(run.numbers, run.positions, strict=True)):
            for bone in context.bones if np.isfinite(points).all() else ():
                gaps[i] = np.minimum(gaps[i], bone.distances(number, points))
    except InputError:
        return None
    lost = ~np.isfinite(run.positions).all(axis=(1, 2))
    return np.where(lost[:, None] | context.exempt.vertices, np.nan, gaps)


def stretch_along(lines: Polylines, positions: Floats) -> Floats:
    """The stretch (f, m) of the two pieces adjacent to each point of ``lines``, taken together, with the points at ``positions``
    (f, m, 3) [mm].
    """
    count = len(lines.points)
    joined = np.ones(count - 1, bool)  # True where a piece joins a point to the next point
    joined[lines.offsets[1:-1] - 1] = False
    pieces = np.flatnonzero(joined)
    ends = np.concatenate([pieces, pieces + 1])

    def around(points: Floats) -> Floats:
        lengths = np.linalg.norm(points[pieces + 1] - points[pieces], axis=1)
        return np.bincount(ends, np.concatenate([lengths, lengths]), minlength=count)

    rest = around(lines.points)
    return np.stack([around(points) / rest for points in positions])
