"""Quantities of runs at every vertex and fibre point, by frame, as colours of a view and for ParaView."""

import numpy as np

from fem_reference.foundations.errors import InputError
from fem_reference.foundations.mesh import Floats, Polylines, Surface
from fem_reference.foundations.motion import apply
from fem_reference.geometry.signed_distance import signed_distances
from fem_reference.metrics import MeasurementContext
from fem_reference.problems.setup import DISTANCE_MARGIN, Bone
from fem_reference.runs.store import Run


@np.errstate(over="ignore", invalid="ignore")
def to_same_vertex(run: Run, reference: Run) -> Floats:
    """Distance (f, n) [mm] of each vertex to the same vertex of the reference; NaN where unknown."""
    return np.asarray(np.linalg.norm(run.positions - reference.positions, axis=2))


def to_surface(run: Run, reference: Run) -> Floats:
    """Distance (f, n) [mm] of each vertex to the nearest point of the reference's surface, negative inside; NaN where unknown."""
    return np.stack(
        [_to_surface(*frame, reference.surface) for frame in zip(run.positions, reference.positions, strict=True)]
    )


def _to_surface(points: Floats, others: Floats, rest: Surface) -> Floats:
    known = np.isfinite(points).all() and np.isfinite(others).all()
    return signed_distances(points, rest.moved_to(others)) if known else np.full(len(points), np.nan)


def to_bones(run: Run, context: MeasurementContext) -> Floats | None:
    """Distance (f, n) [mm] of each vertex to the nearest bone, negative inside, at most ``DISTANCE_MARGIN``; NaN for vertices
    that are exempt from contact or unknown. None where a bone is not closed: it has no inside.
    """
    try:
        frames = [_gaps(points, number, context) for number, points in zip(run.numbers, run.positions, strict=True)]
    except InputError:
        return None
    return np.stack(frames)


def _gaps(points: Floats, number: int, context: MeasurementContext) -> Floats:
    gaps = np.full(len(points), DISTANCE_MARGIN)
    if not np.isfinite(points).all():
        return np.full(len(points), np.nan)
    for bone in context.bones:
        gaps = np.minimum(gaps, to_bone(bone, number, points))
    return np.where(context.exempt.vertices, np.nan, gaps)


def to_bone(bone: Bone, number: int, points: Floats) -> Floats:
    """Distance (n,) [mm] of ``points`` (n, 3) to a ``bone`` at a frame ``number``, negative inside; InputError where the bone is
    not closed.
    """
    return np.asarray(bone.shape.sample(apply(np.linalg.inv(bone.pose(number)), points)).distance)


def fibre_points(run: Run, context: MeasurementContext) -> Floats:
    """Positions of the points of the fibres, (f, m, 3) [mm]: from the run itself, or carried by its surface."""
    own = run.fibre_positions
    if own is not None and own.shape[1:] == context.fibres.points.shape:
        return own
    return np.stack([context.extension.apply(points) for points in run.positions])


def stretch_along(lines: Polylines, positions: Floats) -> Floats:
    """Stretch (f, m) at the points of ``lines`` moved to ``positions`` (f, m, 3) [mm]: the length of the pieces that meet at a
    point over that at rest.
    """
    count = len(lines.points)
    joined = np.ones(count - 1, bool)  # True where a piece joins a point with the next
    joined[lines.offsets[1:-1] - 1] = False
    pieces = np.flatnonzero(joined)
    ends = np.concatenate([pieces, pieces + 1])

    def around(points: Floats) -> Floats:
        lengths = np.linalg.norm(points[pieces + 1] - points[pieces], axis=1)
        return np.bincount(ends, np.concatenate([lengths, lengths]), minlength=count)

    rest = around(lines.points)
    return np.stack([around(points) / rest for points in positions])
