"""Intersections of triangle surfaces with themselves and with each other."""

import numpy as np
from igl import predicates
from numpy.typing import NDArray

from fem_reference.foundations.mesh import Floats, Ints, Surface, normals
from fem_reference.geometry.boxes import bounds, within
from fem_reference.geometry.near_pairs import near_pairs


def self_intersections(surface: Surface) -> Ints:
    """Sorted indices (k,) of the triangles that intersect another one: an edge of one of the two pierces the other."""
    return np.unique(self_crossings(surface))


def self_crossings(surface: Surface) -> Ints:
    """Pairs (k, 2) of triangles in which an edge of one triangle pierces the other.

    Edges that share a vertex with the other triangle do not count, nor do triangles that touch or that overlap in one plane.
    """
    near = near_pairs(surface, surface)
    some = np.arange(len(surface.triangles)) if near is None else np.unique(near)
    if not len(some):
        return np.zeros((0, 2), np.int64)
    _, found, _ = predicates.find_self_intersections(np.array(surface.points), surface.triangles[some])
    if not len(found):
        return np.zeros((0, 2), np.int64)
    pairs = some[found]
    one, other = surface.triangles[np.concatenate([pairs, pairs[:, ::-1]])].swapaxes(0, 1)
    edges = np.concatenate([one[:, [i, (i + 1) % 3]] for i in range(3)])
    hit = _pierces(surface, edges, np.tile(other, (3, 1))).reshape(6, len(pairs)).any(axis=0)
    return np.asarray(pairs[hit], np.int64)


def crossings(one: Surface, other: Surface) -> Ints:
    """Pairs (k, 2) of triangles of two surfaces that intersect or touch, found with the exact predicates of Shewchuk 1997."""
    found = near_pairs(one, other)
    sides = (within(one, *bounds(other)), within(other, *bounds(one))) if found is None else map(np.unique, found.T)
    near = tuple(sides)
    if not all(map(len, near)):
        return np.zeros((0, 2), np.int64)
    points = [
        surface.points[surface.triangles[some]].reshape(-1, 3) for surface, some in zip((one, other), near, strict=True)
    ]
    corners = [np.arange(len(part)).reshape(-1, 3) for part in points]
    _, pairs, _ = predicates.find_intersections(points[0], corners[0], points[1], corners[1])
    return np.stack([some[pairs[:, i]] for i, some in enumerate(near)], axis=1)


def overlaps(one: Floats, other: Floats) -> Floats:
    """Penetration (k,) [mm] of crossing triangles ``one`` and ``other`` (k, 3, 3): the shortest displacement along the normal of
    either triangle that moves the other one entirely to one side of that triangle's plane; 0 if either triangle has no area.
    """
    return np.asarray(np.nan_to_num([_reach(one, other), _reach(other, one)]).min(axis=0))


def _reach(triangles: Floats, walls: Floats) -> Floats:
    """Depth (k,) of ``triangles`` behind the planes of ``walls``, on the side where it is smaller; NaN if a wall has no area."""
    with np.errstate(invalid="ignore", divide="ignore"):
        across = (found := normals(walls)) / np.linalg.norm(found, axis=1)[:, None]
    heights = np.einsum("kci,ki->kc", triangles - walls[:, :1], across)
    return np.asarray(np.minimum(heights.max(axis=1), -heights.min(axis=1)))


def _pierces(surface: Surface, edges: Ints, triangles: Ints) -> NDArray[np.bool_]:
    """Mask (p,) of the ``edges`` (p, 2) that pierce the triangle in the same row of ``triangles`` (p, 3)."""
    apart = (edges[:, :, None] != triangles[:, None, :]).all(axis=(1, 2))
    begin, end = (surface.points[edges[apart, side]] for side in range(2))
    a, b, c = (surface.points[triangles[apart, corner]] for corner in range(3))
    normal = normals(surface.points[triangles[apart]])
    crosses = np.vecdot(normal, begin - a) * np.vecdot(normal, end - a) < 0
    direction = end - begin
    turns = np.stack([np.vecdot(direction, np.cross(p - begin, q - begin)) for p, q in ((a, b), (b, c), (c, a))])
    inside = (turns >= 0).all(axis=0) | (turns <= 0).all(axis=0)
    result = np.zeros(len(edges), bool)
    result[apart] = crosses & inside
    return result
