"""The fibres of a scene: lines whose lengths are measured, and a direction at every point; independent of the mesh."""

import logging
from collections.abc import Callable

import numpy as np

from fem_reference.foundations.mesh import Floats, Polylines, Surface, TetMesh, enclosed_volume
from fem_reference.geometry.distance import distances
from fem_reference.geometry.fibres import Directions, NearestLine, fibre_field, trace
from fem_reference.geometry.signed_distance import signed_distances
from fem_reference.io import files
from fem_reference.scenes.muscle import MuscleCase

log = logging.getLogger(__name__)

# Fibres are traced in a separate mesh of about this many tets.
TETS = 8000


def of(case: MuscleCase, surface: Surface, fill: Callable[[float], TetMesh]) -> tuple[Polylines, Directions]:
    """The fibres of a case, and their direction at any point. They are given as polylines, with the direction of the nearest, or
    traced in tetrahedra of a size [mm] with which ``fill`` fills the closed ``surface`` of the muscle.
    """
    if (lines := _given(case)) is not None:
        return inside(surface, lines), NearestLine(lines)
    traced = case.fibres.traced
    assert traced is not None  # a Fibres record has one of the two
    volume = enclosed_volume(surface.points, surface.triangles)
    mesh = fill(float(np.cbrt(6 * np.sqrt(2) * volume / TETS)))
    field = fibre_field(mesh, traced.start, traced.end)
    return trace(field, traced.count), field


def lean(case: MuscleCase, axis: Floats) -> float:
    """The lean of given fibres against the unit vector ``axis`` (3,): the root mean square of ``sin 2 a``, with a their angle to
    it. It is the shear by their tension. 0 for fibres that are traced from one attachment to the other.
    """
    if (lines := _given(case)) is None:
        return 0.0
    pieces = np.delete(np.diff(lines.points, axis=0), lines.offsets[1:-1] - 1, axis=0)
    lengths, along = np.linalg.norm(pieces, axis=1), np.abs(pieces @ axis)
    cosine = along / np.maximum(lengths, np.finfo(float).tiny)
    return float(np.sqrt((4 * cosine**2 * np.maximum(1 - cosine**2, 0)) @ lengths / lengths.sum()))


def _given(case: MuscleCase) -> Polylines | None:
    given = case.fibres.polylines
    if given is None:
        return None
    return files.read_polylines(case.file(given.file, "fibres.polylines.file"), given.unit)


def inside(surface: Surface, fibres: Polylines) -> Polylines:
    """The fibres with each point outside the ``surface`` moved to its nearest point, as there is no solution outside."""
    away = signed_distances(fibres.points, surface)
    points = np.array(fibres.points)
    points[away > 0] = distances(points[away > 0], surface).closest
    if away.max() > 0:
        log.info(
            "fibres: %d of %d points moved into the muscle, by up to %.1f mm", (away > 0).sum(), len(points), away.max()
        )
    return Polylines(points, fibres.offsets)
