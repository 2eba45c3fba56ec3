"""Self-intersections of a triangle surface."""

import numpy as np
from numpy.typing import NDArray

from fem_reference.foundations.mesh import Floats, Ints, Surface


def self_intersections(surface: Surface) -> Ints:
    """The triangles (k,), sorted, that an edge of another triangle pierces or whose edge pierces another.

    An edge that has a vertex in common with the other triangle does not count; nor do triangles that touch or overlap
    in one plane.
    """
    first, second = _near_pairs(surface.points[surface.triangles])
    hit = np.zeros(len(first), bool)
    for edges, faces in ((first, second), (second, first)):
        for corners in ([0, 1], [1, 2], [2, 0]):
            hit |= _pierces(surface, surface.triangles[edges][:, corners], surface.triangles[faces])
    return np.unique(np.concatenate([first[hit], second[hit]]))


def _near_pairs(corners: Floats) -> tuple[Ints, Ints]:
    """Pairs (p,), (p,) of triangles whose bounding boxes overlap, from ``corners`` (m, 3, 3); a pair may come twice."""
    low, high = corners.min(axis=1), corners.max(axis=1)
    triangle, cell = _cells(low, high)
    order = np.argsort(cell, kind="stable")
    triangle, cell = triangle[order], cell[order]
    pairs = []
    for shift in range(1, len(cell)):
        same = np.flatnonzero(cell[shift:] == cell[:-shift])
        if len(same) == 0:
            break
        one, other = triangle[same], triangle[same + shift]
        overlap = ((low[one] <= high[other]) & (low[other] <= high[one])).all(axis=1)
        pairs.append((one[overlap], other[overlap]))
    if not pairs:
        return np.zeros(0, np.int64), np.zeros(0, np.int64)
    first, second = (np.concatenate(side) for side in zip(*pairs, strict=True))
    return first, second


def _cells(low: Floats, high: Floats) -> tuple[Ints, Ints]:
    """Each box from ``low`` to ``high`` (m, 3) with each cell of a uniform grid it reaches: box (p,), cell (p,)."""
    extent = (high - low).max(axis=1)
    # Twice the mean box keeps few boxes in a cell; no box may reach more than some 50 cells along an axis.
    width = max(2 * extent.mean(), extent.max() / 50, np.finfo(float).tiny)
    begin, end = (np.floor((side - low.min(axis=0)) / width).astype(np.int64) for side in (low, high))
    span = end - begin + 1
    count = span.prod(axis=1)
    box = np.repeat(np.arange(len(low)), count)
    nth = np.arange(len(box)) - np.repeat(np.cumsum(count) - count, count)
    along_x, nth = nth % span[box, 0], nth // span[box, 0]
    along_y, along_z = nth % span[box, 1], nth // span[box, 1]
    x, y, z = (begin[box] + np.stack([along_x, along_y, along_z], axis=1)).T
    rows, columns = end.max(axis=0)[1:] + 1
    return box, (x * rows + y) * columns + z


def _pierces(surface: Surface, edges: Ints, triangles: Ints) -> NDArray[np.bool_]:
    """Whether each of ``edges`` (p, 2) passes through the triangle beside it in ``triangles`` (p, 3), (p,)."""
    apart = (edges[:, :, None] != triangles[:, None, :]).all(axis=(1, 2))
    begin, end = (surface.points[edges[apart, side]] for side in range(2))
    a, b, c = (surface.points[triangles[apart, corner]] for corner in range(3))
    normal = np.cross(b - a, c - a)
    crosses = _dot(normal, begin - a) * _dot(normal, end - a) < 0
    direction = end - begin
    turns = np.stack([_dot(direction, np.cross(p - begin, q - begin)) for p, q in ((a, b), (b, c), (c, a))])
    inside = (turns >= 0).all(axis=0) | (turns <= 0).all(axis=0)
    result = np.zeros(len(edges), bool)
    result[apart] = crosses & inside
    return result


def _dot(left: Floats, right: Floats) -> Floats:
    return np.asarray(np.einsum("ij,ij->i", left, right))
