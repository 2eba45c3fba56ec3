"""Coarsening of surfaces: a fine surface is remeshed with fewer, well-shaped triangles."""

import igl
import numpy as np
from numpy.typing import NDArray

from fem_reference.foundations.mesh import Floats, Ints, Surface, enclosed_volume, normals, triangle_areas, unit_normals
from fem_reference.geometry.distance import distances
from fem_reference.geometry.edges import Edges

# The number of rounds, chosen by trials on four hip muscles and a box; more rounds do not improve the result.
_ROUNDS = 6
# A vertex may move along an eigenvector of its normal tensor (see ``_normal_tensors``) if the eigenvalue is below this fraction of
# the sum of all three; it then stays on its plane or sharp edge. Above 0.05, thin rims shrink; below 0.02, slivers remain.
_FREE = 0.03
# The distance of the pole of inversion from the centre of the body, in diagonals of its bounding box. A nearer pole displaces sharp
# edges; with a farther one, flat parts are not curved enough.
_POLE = 6.0
_NEARLY_FLAT = np.cos(np.radians(30))
_TINY = np.finfo(float).tiny


def coarsen(surface: Surface, count: int) -> Surface:
    """Approximate a closed ``surface`` by one of about ``count`` triangles, with the same sharp edges and volume.

    Edges are first collapsed by quadric error (Garland and Heckbert 1997, doi 10.1145/258734.258849). In each of the following
    rounds, edges are flipped towards a Delaunay triangulation, and vertices slide towards the centre of their neighbours and are
    then projected onto ``surface``.
    """
    points, triangles = _collapse(surface, count)
    for _ in range(_ROUNDS):
        triangles = flip_edges(points, triangles)
        points = distances(slide(points, triangles), surface).closest
    points = inflate(points, triangles, enclosed_volume(surface.points, surface.triangles))
    return Surface(points, triangles, surface.place)


def resampled(surface: Surface, power: int) -> Surface:
    """Return ``surface`` with ``4**power`` times as many triangles. If ``power`` is positive, each triangle is cut into four
    ``power`` times; no vertex moves, and the old vertices come first. If it is negative, the surface is coarsened.
    """
    if power < 0:
        return coarsen(surface, max(4, round(len(surface.triangles) * 4**power)))
    points, triangles = np.array(surface.points), np.array(surface.triangles)
    if power:
        points, triangles = igl.upsample(points, triangles, power)
    return Surface(points, triangles, surface.place)


def _collapse(surface: Surface, count: int) -> tuple[Floats, Ints]:
    """Collapse edges by quadric error until about ``count`` triangles remain; returns the points and triangles. The surface is
    first inverted in a sphere, because the quadrics of a flat part would be singular.
    """
    low, high = surface.points.min(axis=0), surface.points.max(axis=0)
    radius = _POLE * float(np.linalg.norm(high - low))
    pole = (low + high) / 2 + radius * np.array([0.48, 0.6, 0.64])
    points, triangles, *_ = igl.qslim(_invert(surface.points, pole, radius), surface.triangles, count)
    return distances(_invert(points, pole, radius), surface).closest, np.ascontiguousarray(triangles)


def _invert(points: Floats, pole: Floats, radius: float) -> Floats:
    """Invert ``points`` (n, 3) in the sphere of ``radius`` about ``pole``; a second inversion restores them."""
    away = points - pole
    return np.asarray(pole + away * radius**2 / np.sum(away**2, axis=1, keepdims=True))


def slide(points: Floats, triangles: Ints) -> Floats:
    """Move ``points`` (n, 3) [mm] to the area-weighted mean of the centroids of the ``triangles`` (m, 3) around them, but only
    along the directions in which they are free (see :func:`free_part`).
    """
    areas = triangle_areas(points, triangles)
    total = _around(areas, triangles, len(points))[:, None]
    pulled = _around(areas[:, None] * points[triangles].mean(axis=1), triangles, len(points))
    step = np.where(total > 0, pulled / np.maximum(total, _TINY) - points, 0.0)
    return np.asarray(points + free_part(points, triangles, np.arange(len(points)), step))


def free_part(points: Floats, triangles: Ints, chosen: Ints, steps: Floats) -> Floats:
    """Reduce the displacements ``steps`` (k, 3) [mm] of some points to the part that keeps these points on the surface: the
    tangential part at a smooth point, the part along the edge at a sharp edge, and 0 at a corner. ``points`` (n, 3) [mm] and
    ``triangles`` (m, 3) define the surface, and ``chosen`` (k,) are the indices of the displaced points.
    """
    shares, directions = np.linalg.eigh(_normal_tensors(points, triangles))
    free = shares < _FREE * shares.sum(axis=1, keepdims=True)
    along = np.einsum("nij,ni->nj", directions[chosen], steps) * free[chosen]
    return np.asarray(np.einsum("nij,nj->ni", directions[chosen], along))


def _normal_tensors(points: Floats, triangles: Ints) -> Floats:
    """Sum (n, 3, 3) of ``u u^T`` over the triangles around each point, with unit normals u, weighted by the angles at the point."""
    across = unit_normals(points[triangles])
    squares = across[:, :, None] * across[:, None, :]
    tensors = np.zeros((len(points), 3, 3))
    for here, left, right in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
        at = points[triangles[:, here]]
        angles = _angle(points[triangles[:, left]] - at, points[triangles[:, right]] - at)
        np.add.at(tensors, triangles[:, here], angles[:, None, None] * squares)
    return tensors


def inflate(points: Floats, triangles: Ints, volume: float) -> Floats:
    """Move the ``points`` (n, 3) [mm] of a closed outward surface equally along their normals, so that they enclose ``volume``."""
    for _ in range(3):
        across = _around(normals(points[triangles]), triangles, len(points))
        across /= np.maximum(np.linalg.norm(across, axis=1, keepdims=True), _TINY)
        missing = volume - enclosed_volume(points, triangles)
        points = points + across * missing / triangle_areas(points, triangles).sum()
    return points


def flip_edges(points: Floats, triangles: Ints, labels: Ints | None = None) -> Ints:
    """Flip edges of a closed surface towards a Delaunay triangulation, in at most 20 passes; returns the new triangles (m, 3).
    Edges between triangles with different ``labels`` (m,) are not flipped, so the labels remain valid.
    """
    for _ in range(20):
        flipped = _flip_once(points, triangles, labels)
        if flipped is triangles:
            break
        triangles = flipped
    return triangles


def _flip_once(points: Floats, triangles: Ints, labels: Ints | None) -> Ints:
    """Flip edges in order of decreasing gain, at most one per triangle; returns ``triangles`` itself if no edge is flipped."""
    edges = Edges.of(Surface(points, triangles))
    gain = _flip_gain(points, edges)
    if labels is not None:
        gain = np.where(labels[edges.beside[:, 0]] == labels[edges.beside[:, 1]], gain, 0.0)
    there = set(map(tuple, np.sort(edges.ends, axis=1).tolist()))
    touched, flipped = np.zeros(len(triangles), bool), triangles.copy()
    order = np.argsort(-gain, kind="stable")
    for i in order[: np.count_nonzero(gain > 0)]:
        pair = edges.beside[i]
        (a, b), (c, d) = edges.ends[i].tolist(), edges.opposite[i].tolist()
        edge = (min(c, d), max(c, d))
        if touched[pair].any() or edge in there:
            continue
        flipped[pair] = (c, a, d), (d, b, c)
        touched[pair] = True
        there.add(edge)
    return flipped if touched.any() else triangles


def _flip_gain(points: Floats, edges: Edges) -> Floats:
    """Sum (e,) [rad] of the two angles opposite each edge, minus pi; 0 if a flip would be useless or would bend the surface."""
    a, b, c, d = (points[corner] for corner in (*edges.ends.T, *edges.opposite.T))
    excess = _angle(a - c, b - c) + _angle(a - d, b - d) - np.pi
    before = _cosine(np.cross(b - a, c - a), np.cross(a - b, d - b))
    after = _cosine(np.cross(a - c, d - c), np.cross(b - d, c - d))
    allowed = (excess > 1e-3) & (before > _NEARLY_FLAT) & (after > _NEARLY_FLAT)
    return np.where(allowed, excess, 0.0)


def _around(values: NDArray[np.float64], triangles: Ints, count: int) -> Floats:
    """Sum (count, ...) of the ``values`` (m, ...) of the triangles around each of ``count`` points."""
    total = np.zeros((count, *values.shape[1:]))
    for corner in triangles.T:
        np.add.at(total, corner, values)
    return total


def _angle(one: Floats, other: Floats) -> Floats:
    return np.asarray(np.arctan2(np.linalg.norm(np.cross(one, other), axis=1), np.einsum("ij,ij->i", one, other)))


def _cosine(one: Floats, other: Floats) -> Floats:
    lengths = np.linalg.norm(one, axis=1) * np.linalg.norm(other, axis=1)
    return np.asarray(np.einsum("ij,ij->i", one, other) / np.maximum(lengths, _TINY))
