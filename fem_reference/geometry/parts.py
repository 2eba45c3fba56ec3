"""Attached and free parts of a coarse surface, remeshed with well-shaped triangles and rims; areas and volume are preserved."""

from dataclasses import dataclass, replace

import igl
import numpy as np
from scipy.sparse import coo_array

from fem_reference.foundations.mesh import Bools, Floats, Ints, Surface, triangle_areas, unit_normals
from fem_reference.foundations.rows import distinct
from fem_reference.geometry.coarsening import flip_edges, free_part, inflate, slide
from fem_reference.geometry.distance import distances
from fem_reference.geometry.edges import Edges

_ROUNDS = 4  # The number of rounds of collapses, flips and slides.
_SHORT = 0.4  # Edges at a rim that are shorter than this, relative to the triangle size, are collapsed.
_STRAIGHT = np.cos(np.radians(50))  # A rim has a corner where its direction changes by more than 50 degrees.
_SAME_SIDE = 0.5  # The minimum cosine between the normals of a triangle before and after a collapse.
_TINY = np.finfo(float).tiny


@dataclass(frozen=True, eq=False)
class Parts:
    """A surface in parts. ``labels`` (m,): 0 if free, i + 1 in attachment i; ``rim`` (n,): mask of the points where parts meet."""

    points: Floats
    triangles: Ints
    labels: Ints
    rim: Bools

    @property
    def surface(self) -> Surface:
        """The surface that consists of all parts."""
        return Surface(self.points, self.triangles)

    def area(self, label: int) -> float:
        """Area [mm2] of the triangles with this ``label``."""
        return float(triangle_areas(self.points, self.triangles[self.labels == label]).sum())


def between(triangles: Ints, labels: Ints, count: int) -> Bools:
    """Mask (count,) of the points of a surface at which ``triangles`` (m, 3) with different ``labels`` (m,) meet."""
    low, high = np.full(count, np.iinfo(np.int64).max), np.full(count, -1)
    np.minimum.at(low, triangles.ravel(), np.repeat(labels, 3))
    np.maximum.at(high, triangles.ravel(), np.repeat(labels, 3))
    return low < high


def relaxed(parts: Parts, fine: Surface, size: float) -> Parts:
    """Remesh the parts with well-shaped triangles of about ``size`` [mm] on the ``fine`` surface; rim points stay on the rim."""
    for _ in range(_ROUNDS):
        parts = collapsed(parts, _SHORT * size)
        triangles = flip_edges(parts.points, parts.triangles, parts.labels)
        slid = slide(parts.points, triangles)
        slid = np.where(parts.rim[:, None], _along_rims(parts), slid)
        parts = replace(parts, points=distances(slid, fine).closest, triangles=triangles)
    return replace(parts, triangles=flip_edges(parts.points, parts.triangles, parts.labels))


def _rim_edges(parts: Parts) -> Ints:
    """Edges (e, 2) between triangles with different labels."""
    edges = Edges.of(parts.surface)
    left, right = parts.labels[edges.beside].T
    return np.asarray(edges.ends[left != right])


def _along_rims(parts: Parts) -> Floats:
    """Points (n, 3), with points on rims moved along them towards the midpoint of their neighbours; rims keep corners and ends."""
    edges = _rim_edges(parts)
    count = len(parts.points)
    both = np.concatenate([edges, edges[:, ::-1]])
    links = coo_array((np.ones(len(both)), tuple(both.T)), shape=(count, count)).tocsr()
    inner = np.flatnonzero(np.diff(links.indptr) == 2)
    neighbours = links.indices[links.indptr[inner][:, None] + np.arange(2)]
    points = np.array(parts.points)
    before, after = parts.points[neighbours[:, 0]] - points[inner], parts.points[neighbours[:, 1]] - points[inner]
    lengths = np.linalg.norm(before, axis=1) * np.linalg.norm(after, axis=1)
    straight = -np.einsum("ij,ij->i", before, after) > _STRAIGHT * lengths
    direction = after - before
    squares = np.maximum(np.einsum("ij,ij->i", direction, direction), _TINY)
    share = np.einsum("ij,ij->i", before + after, direction) / squares / 2
    points[inner] += np.where(straight, share, 0.0)[:, None] * direction
    return points


def collapsed(parts: Parts, short: float) -> Parts:
    """Collapse edges shorter than ``short`` [mm] that end on a rim, if the surface and the rims then keep their shape."""
    ends = distinct(np.sort(parts.triangles[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)).rows
    lengths = np.linalg.norm(parts.points[ends[:, 0]] - parts.points[ends[:, 1]], axis=1)
    next_on_rim: list[list[int]] = [[] for _ in parts.points]
    for one, other in _rim_edges(parts).tolist():
        next_on_rim[one].append(other)
        next_on_rim[other].append(one)
    faces, starts = igl.vertex_triangle_adjacency(parts.triangles, len(parts.points))
    around = [some.tolist() for some in np.split(faces, starts[1:-1])]  # the triangles around each point
    target, touched = np.arange(len(parts.points)), np.zeros(len(parts.points), bool)
    gone = np.zeros(len(parts.triangles), bool)
    for i in np.argsort(lengths, kind="stable")[: np.count_nonzero(lengths < short)]:
        goes, stays = sorted(ends[i].tolist(), key=lambda point: (parts.rim[point], len(next_on_rim[point]) != 2))
        if not parts.rim[stays] or (parts.rim[goes] and not _straight(parts.points, next_on_rim[goes], goes, stays)):
            continue
        near = np.unique(parts.triangles[around[goes] + around[stays]])
        if touched[near].any() or not _may_collapse(parts, around, goes, stays):
            continue
        target[goes] = stays
        gone[[triangle for triangle in around[goes] if triangle in around[stays]]] = True
        touched[near] = True
    used, triangles = np.unique(target[parts.triangles[~gone]], return_inverse=True)
    return Parts(parts.points[used], triangles.reshape(-1, 3), parts.labels[~gone], parts.rim[used])


def _straight(points: Floats, neighbours: list[int], goes: int, stays: int) -> bool:
    """True if ``goes`` has exactly two ``neighbours`` on a rim, including ``stays``, and the rim is nearly straight at ``goes``."""
    if len(neighbours) != 2 or stays not in neighbours:
        return False
    before, after = points[goes] - points[neighbours[0]], points[neighbours[1]] - points[goes]
    return bool(before @ after > _STRAIGHT * np.linalg.norm(before) * np.linalg.norm(after))


def _may_collapse(parts: Parts, around: list[list[int]], goes: int, stays: int) -> bool:
    """True if ``goes`` can be moved onto ``stays``: the surface stays manifold, sharp edges stay, no triangle flips or flattens."""
    points, triangles = parts.points, parts.triangles
    here, there = set(triangles[around[goes]].ravel().tolist()), set(triangles[around[stays]].ravel().tolist())
    if len(here & there) != 4 or len(here | there) < 6:  # the ends share two neighbours; a tetrahedron is not collapsed
        return False
    old = triangles[around[goes]]
    shift = (points[stays] - points[goes])[None]
    free = free_part(points, old, np.array([goes]), shift)
    if np.linalg.norm(shift - free) > np.linalg.norm(shift) / 3:
        return False
    left = np.array([triangle for triangle in around[goes] if triangle not in around[stays]])
    before = triangles[left]
    after = np.where(before == goes, stays, before)
    one, other = unit_normals(points[before]), unit_normals(points[after])
    cosines = np.einsum("ij,ij->i", one, other)
    least = min(_flatness(points, old).min(), 0.5)
    return bool((cosines > _SAME_SIDE).all() and _flatness(points, after).min() >= least)


def _flatness(points: Floats, triangles: Ints) -> Floats:
    """Shape quality (m,) of triangles, 1 if equilateral, 0 if degenerate: 4 sqrt(3) area divided by the sum of squared sides."""
    squares = np.sum((points[triangles] - points[np.roll(triangles, 1, axis=1)]) ** 2, axis=(1, 2))
    return np.asarray(4 * np.sqrt(3) * triangle_areas(points, triangles) / np.maximum(squares, _TINY))


def widened(parts: Parts, areas: list[float], volume: float, most: float) -> Floats:
    """Points (n, 3) [mm], moved so that the parts have the ``areas`` [mm2], from label 1 on, and the surface encloses ``volume``.

    Before the move, areas and volume are too small, like the area of a polygon inscribed in a circle. In each round the rim of each
    part moves outwards by a uniform distance of at most ``most`` [mm], and then all points move along their normals.
    """
    for _ in range(_ROUNDS):
        points = np.array(parts.points)
        for label, area in enumerate(areas, start=1):
            directions, length = _outwards(parts, label)
            if length > 0:
                points += directions * np.clip((area - parts.area(label)) / length, -most, most)
        parts = replace(parts, points=inflate(points, parts.triangles, volume))
    return parts.points


def _outwards(parts: Parts, label: int) -> tuple[Floats, float]:
    """Return unit vectors (n, 3) out of the part with this ``label``, tangential to it, 0 off its rim; and the rim's length."""
    triangles = parts.triangles[parts.labels == label]
    ends = triangles[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2)
    corners = parts.points[triangles]
    normals = np.repeat(unit_normals(corners), 3, axis=0)
    _, _, which, count = distinct(np.sort(ends, axis=1))
    alone = count[which] == 1
    along = parts.points[ends[alone, 1]] - parts.points[ends[alone, 0]]
    directions = np.zeros_like(parts.points)
    for end in ends[alone].T:
        np.add.at(directions, end, np.cross(along, normals[alone]))
    directions /= np.maximum(np.linalg.norm(directions, axis=1, keepdims=True), _TINY)
    return directions, float(np.linalg.norm(along, axis=1).sum())
