"""Exact unsigned distance from points to a triangle surface."""

from functools import lru_cache
from typing import NamedTuple

import igl
import numpy as np

from fem_reference.foundations.mesh import Floats, Ints, Surface


class Distances(NamedTuple):
    """For each of n points: ``distance`` (n,) [mm] to the surface and the ``triangle`` (n,) that is closest.

    ``closest`` (n, 3) [mm] is the closest point of that triangle, ``barycentric`` (n, 3) its coordinates there.
    """

    distance: Floats
    triangle: Ints
    closest: Floats
    barycentric: Floats


def distances(points: Floats, surface: Surface) -> Distances:
    """The closest point of ``surface`` for each of ``points`` (n, 3) [mm]; ValueError where one is not finite."""
    points = np.ascontiguousarray(points, dtype=np.float64).reshape(-1, 3)
    for what, given in (("points", points), ("points of the surface", surface.points)):
        if not np.isfinite(given).all():  # libigl would give triangles that do not exist
            raise ValueError(f"distances: {what} that are not finite")
    if len(points) == 0:
        return Distances(np.zeros(0), np.zeros(0, np.int64), np.zeros((0, 3)), np.zeros((0, 3)))
    vertices, triangles = (
        np.ascontiguousarray(array, kind)
        for array, kind in ((surface.points, np.float64), (surface.triangles, np.int64))
    )
    tree = _tree(vertices.tobytes(), triangles.tobytes())
    squares, triangle, closest = tree.squared_distance(vertices, triangles, points)
    lost = ~np.isfinite(squares)  # libigl's results are arbitrary where squares overflow
    triangle[lost], closest[lost] = 0, vertices[triangles[0, 0]]
    corners = surface.points[surface.triangles[triangle]]
    return Distances(
        np.sqrt(np.maximum(squares, 0)), np.asarray(triangle, np.int64), closest, _barycentric(closest, corners)
    )


# A surface is often queried for few points at a time, and building its tree takes as long as thousands of them.
@lru_cache(maxsize=8)
def _tree(points: bytes, triangles: bytes) -> igl.AABB:
    """The boxes around parts of the surface with the arrays ``points``, 64 bit floats, and ``triangles``, 64 bit integers."""
    tree = igl.AABB()
    tree.init(
        *(np.frombuffer(array, kind).reshape(-1, 3) for array, kind in ((points, np.float64), (triangles, np.int64)))
    )
    return tree


def _barycentric(points: Floats, corners: Floats) -> Floats:
    """Weights (n, 3), at least 0 and of sum 1, of ``corners`` (n, 3, 3) at ``points`` (n, 3) in their triangles."""
    opposite = corners[:, [2, 0, 1]] - corners[:, [1, 2, 0]]
    normal = np.cross(opposite[:, 0], opposite[:, 1])
    to_point = points[:, None] - corners[:, [1, 2, 0]]
    weights = np.maximum(np.einsum("nkd,nd->nk", np.cross(opposite, to_point), normal), 0.0)
    total = weights.sum(axis=1, keepdims=True)
    return np.where(total > 0, weights / np.where(total > 0, total, 1.0), 1 / 3)
