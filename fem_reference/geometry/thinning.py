"""Fewer triangles for pictures of a surface of any kind: holes, edges of three triangles and loose ends stay."""

import numpy as np

from fem_reference.foundations.mesh import Floats, Ints, Surface, normals, triangle_areas

# Directions in which planes leave a vertex free have less than this share of the greatest eigenvalue of their quadric.
_FREE = 1e-2
_COARSER = 1.08


def thin(surface: Surface, count: int) -> Surface:
    """At most ``count`` triangles in place of ``surface``, itself where it has no more.

    The vertices in a cell of a grid become one, at the point nearest to the planes of the triangles around them (Lindstrom 2000,
    doi 10.1145/344779.344912). Parts thinner than a cell may close up: the result is for pictures, not for computation.
    """
    if len(surface.triangles) <= count:
        return surface
    area = float(triangle_areas(surface.points, surface.triangles).sum())
    side = np.sqrt(area / count)
    cells, triangles = _clusters(surface, side)
    while len(triangles) > count:
        side *= _COARSER
        cells, triangles = _clusters(surface, side)
    return Surface(_representatives(surface, cells, side), triangles, surface.place)


def _clusters(surface: Surface, side: float) -> tuple[Ints, Ints]:
    """The number (n,) of the cell of each vertex, and the triangles between three different cells, each once."""
    corner = surface.points.min(axis=0) - side / 2
    places = np.floor((surface.points - corner) / side).astype(np.int64)
    _, cells = np.unique(places, axis=0, return_inverse=True)
    triangles = cells[surface.triangles]
    a, b, c = triangles.T
    triangles = triangles[(a != b) & (b != c) & (c != a)]
    turned = np.take_along_axis(triangles, (np.argmin(triangles, axis=1)[:, None] + np.arange(3)) % 3, axis=1)
    return cells, np.unique(turned, axis=0)


def _representatives(surface: Surface, cells: Ints, side: float) -> Floats:
    """One point for each cell: from the mean of its vertices to where the planes meet, at most one cell away."""
    count = int(cells.max()) + 1
    sizes = np.bincount(cells, minlength=count)
    means = np.stack([np.bincount(cells, values, count) / sizes for values in surface.points.T], axis=1)
    corners = surface.points[surface.triangles]
    across = normals(corners)
    squares, pulls = np.zeros((count, 3, 3)), np.zeros((count, 3))
    for corner in cells[surface.triangles].T:
        off = np.einsum("ij,ij->i", across, corners[:, 0] - means[corner])
        np.add.at(squares, corner, across[:, :, None] * across[:, None, :])
        np.add.at(pulls, corner, across * off[:, None])
    steps = np.einsum("nij,nj->ni", np.linalg.pinv(squares, rcond=_FREE, hermitian=True), pulls)
    lengths = np.linalg.norm(steps, axis=1, keepdims=True)
    return np.asarray(means + steps * np.minimum(1, side / np.maximum(lengths, side)))
