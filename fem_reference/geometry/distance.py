"""Exact unsigned distance from points to a triangle surface, winding numbers of closed surfaces, and sets of points far apart."""

from functools import lru_cache
from typing import NamedTuple

import igl
import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from fem_reference.foundations.mesh import Floats, Ints, Surface, diagonal, normals
from fem_reference.geometry.near_pairs import reached

# The distance from a triangle to the sample point just outside it, as a fraction of the surface's diagonal.
_STEP = 1e-5
# The number of triangles whose depth within another part of a body is computed: those farthest from all triangles that are not
# within another part.
_WITHIN = 16


class Distances(NamedTuple):
    """Distances of n points to a ``surface``: ``distance`` (n,) [mm], closest ``triangle`` (n,), and ``closest`` point (n, 3)."""

    distance: Floats
    triangle: Ints
    closest: Floats
    surface: Surface

    @property
    def barycentric(self) -> Floats:
        """Barycentric coordinates (n, 3) of the closest points in their triangles."""
        return _barycentric(self.closest, self.surface.points[self.surface.triangles[self.triangle]])


def distances(points: Floats, surface: Surface) -> Distances:
    """Find the closest point on ``surface`` for each of ``points`` (n, 3) [mm]; ValueError if a point is not finite."""
    points = np.ascontiguousarray(points, dtype=np.float64).reshape(-1, 3)
    for what, given in (("points", points), ("points of the surface", surface.points)):
        if not np.isfinite(given).all():  # libigl would return indices of triangles that do not exist
            raise ValueError(f"distances: the {what} are not all finite")
    if len(points) == 0:
        return Distances(np.zeros(0), np.zeros(0, np.int64), np.zeros((0, 3)), surface)
    vertices, triangles = surface.points, surface.triangles
    tree = _tree(vertices.tobytes(), triangles.tobytes())
    squares, triangle, closest = tree.squared_distance(vertices, triangles, points)
    lost = ~np.isfinite(squares)  # the results of libigl are arbitrary if the squared distance overflows
    triangle[lost], closest[lost] = 0, vertices[triangles[0, 0]]
    return Distances(np.sqrt(np.maximum(squares, 0)), np.asarray(triangle, np.int64), closest, surface)


# Surfaces are often queried for a few points at a time, and building a search tree takes as long as thousands of queries.
@lru_cache(maxsize=8)
def _tree(points: bytes, triangles: bytes) -> igl.AABB:
    """Search tree of a surface, given as the bytes of its ``points`` (64-bit floats) and ``triangles`` (64-bit integers)."""
    tree = igl.AABB()
    tree.init(*_arrays(points, triangles))
    return tree


@lru_cache(maxsize=8)
def _winding_tree(points: bytes, triangles: bytes) -> igl.FastWindingNumberBVH:
    tree = igl.FastWindingNumberBVH()
    tree.init(*_arrays(points, triangles), 2)
    return tree


def _arrays(points: bytes, triangles: bytes) -> tuple[Floats, Ints]:
    return np.frombuffer(points, np.float64).reshape(-1, 3), np.frombuffer(triangles, np.int64).reshape(-1, 3)


def _barycentric(points: Floats, corners: Floats) -> Floats:
    """Barycentric coordinates (n, 3), not negative and with sum 1, of ``points`` (n, 3) in triangles with ``corners`` (n, 3, 3)."""
    opposite = corners[:, [2, 0, 1]] - corners[:, [1, 2, 0]]
    normal = np.cross(opposite[:, 0], opposite[:, 1])
    to_point = points[:, None] - corners[:, [1, 2, 0]]
    weights = np.maximum(np.einsum("nkd,nd->nk", np.cross(opposite, to_point), normal), 0.0)
    total = weights.sum(axis=1, keepdims=True)
    return np.where(total > 0, weights / np.where(total > 0, total, 1.0), 1 / 3)


def inside(surface: Surface, points: Floats) -> NDArray[np.bool_]:
    """Mask (n,) of the ``points`` (n, 3) inside a closed ``surface``, by their winding numbers."""
    if len(points) == 0:
        return np.zeros(0, bool)
    tree = _winding_tree(surface.points.tobytes(), surface.triangles.tobytes())
    return np.ravel(tree.winding_number(np.ascontiguousarray(points)) > 0.5)


def flattened(surface: Surface, place: Floats) -> float:
    """Error of a flat triangle on a curved surface, multiplied by the radius of curvature [mm2]. The error is the distance from the
    centre of the triangle to a sphere with this radius through its corners. The triangle is the one nearest to ``place`` (3,) [mm].
    """
    corners = surface.points[surface.triangles]
    reach = (1 + 1e-9) * float(np.linalg.norm(corners - place, axis=2).min())
    near = reached(surface, place[None], np.array([reach]))  # a search tree of all triangles would take longer
    corners = corners[near[distances(place[None], Surface(surface.points, surface.triangles[near])).triangle[0]]]
    return float((np.linalg.norm(corners - np.roll(corners, 1, axis=0), axis=1) ** 2).max()) / 6


@np.errstate(over="ignore", invalid="ignore")
def outer_windings(surface: Surface) -> Floats:
    """Winding number (m,) of the surface at a point just outside each triangle. It is 0 on the skin of a valid body, positive
    inside another part of the body, negative if the triangle faces a part that is inside out, and NaN if the normal is undefined.

    "Just outside" means 1e-5 of the surface's diagonal away; thinner folds are not resolved. The winding numbers of Barill et al.
    2018, doi 10.1145/3197517.3201337, differ by a few thousandths from the integers to which they are rounded here.
    """
    points, triangles = surface.points - surface.points.mean(axis=0), surface.triangles
    corners = points[triangles]
    across = normals(corners)
    sizes = np.linalg.norm(across, axis=1)
    step = _STEP * diagonal(points)
    if not (np.isfinite(step) and np.isfinite(sizes).all()):
        return np.full(len(triangles), np.nan)
    outside = corners.sum(axis=1) / 3 + step * across / np.where(sizes > 0, sizes, 1)[:, None]
    return np.where(sizes > 0, np.round(igl.fast_winding_number(points, triangles, outside)), np.nan)


def depth_within(surface: Surface, some: NDArray[np.bool_]) -> float:
    """Lower bound on the maximum depth [mm] of the triangles ``some``, a mask (m,), within another part of the closed ``surface``.
    The depth of a triangle is the distance of its centroid from the nearest triangle that faces the other way and has the centroid
    behind it. The result is 0 without self-intersection.
    """
    corners = surface.points[surface.triangles]
    middles, across, covered = corners.mean(axis=1), normals(corners), outer_windings(surface) > 0.5
    within = np.flatnonzero(covered & some)
    if not len(within):
        return 0.0
    slack, sizes = _STEP * diagonal(surface.points), np.linalg.norm(across, axis=1)
    away = cKDTree(middles[~covered]).query(middles[within])[0] if not covered.all() else np.zeros(len(within))
    found = [0.0]
    for one in within[np.argsort(-away, kind="stable")[:_WITHIN]]:
        walls = (across @ across[one] < 0) & (np.vecdot(middles[one] - middles, across) < slack * sizes)
        facing = Surface(surface.points, surface.triangles[walls])
        found.append(float(distances(middles[[one]], facing).distance[0]) if walls.any() else 0.0)
    return max(found)


def farthest_points(points: Floats, count: int) -> Ints:
    """Indices (count,) of ``points`` (n, d): first the farthest from the mean, then each time the farthest from those chosen."""
    chosen = [int(np.argmax(np.linalg.norm(points - points.mean(axis=0), axis=1)))]
    away = np.full(len(points), np.inf)
    while len(chosen) < min(count, len(points)):
        away = np.minimum(away, np.linalg.norm(points - points[chosen[-1]], axis=1))
        chosen.append(int(np.argmax(away)))
    return np.array(chosen)
