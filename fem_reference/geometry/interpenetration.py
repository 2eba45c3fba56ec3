"""Depth to which two closed surfaces penetrate each other, computed from their triangles alone."""

import numpy as np

from fem_reference.foundations.mesh import Floats, Surface, TetMesh, boundary
from fem_reference.geometry.distance import distances, inside
from fem_reference.geometry.intersections import crossings

# Sample points of a triangle that crosses the other surface, in barycentric coordinates: a regular grid that includes the corners.
_GRID = np.array([(i, j, 6 - i - j) for i in range(7) for j in range(7 - i)]) / 6


def penetration(one: Surface, other: Surface) -> tuple[float, Floats]:
    """Return the depth [mm] to which two closed surfaces penetrate each other, 0 if they are apart, and the point (3,) with that
    depth. It is the deepest of all vertices and of 28 sample points on each triangle that crosses the other surface.
    """
    pairs = crossings(one, other)
    depths, places = [np.zeros(1)], [one.points[:1]]
    for surface, body, crossed in zip((one, other), (other, one), pairs.T, strict=True):
        corners = surface.points[surface.triangles[np.unique(crossed)]]
        some = np.concatenate([surface.points, np.einsum("sk,mki->msi", _GRID, corners).reshape(-1, 3)])
        low, high = body.points.min(axis=0), body.points.max(axis=0)
        near = some[((some >= low) & (some <= high)).all(axis=1)]
        within = near[inside(body, near)]
        if len(within):
            depths.append(distances(within, body).distance)
            places.append(within)
    found = np.concatenate(depths)
    worst = int(np.argmax(found))
    return float(found[worst]), np.concatenate(places)[worst]


def skin_of(mesh: TetMesh) -> Surface:
    """Return the boundary triangles of a ``mesh`` as a surface with all points of the mesh."""
    return Surface(mesh.points, boundary(mesh.tets)[0])
