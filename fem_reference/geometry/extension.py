"""Linear extension of a surface's displacement to points inside, with weights that are the same for every run of a case.

The weights are mean value coordinates for closed triangle meshes: Ju, Schaefer, Warren 2005, doi 10.1145/1073204.1073229.
"""

from dataclasses import dataclass

import numpy as np

from fem_reference.foundations.mesh import Floats, Ints, Surface, diagonal
from fem_reference.foundations.rows import distinct
from fem_reference.geometry.distance import distances

# A point that is closer to the surface than this fraction of the surface's diagonal counts as lying on it.
_ON = 1e-10
# If the sine of the angle between the plane of a triangle and the line of sight is below this, the triangle is seen edge-on, and
# its solid angle counts as 0.
_EDGE_ON = 1e-10


@dataclass(frozen=True, eq=False)
class Extension:
    """Extension of displacement from a surface to ``points`` (m, 3) [mm]. ``rest`` (n, 3) [mm]: the points of the surface at rest;
    ``weights`` (m, n): the weights of the displacements of these points; each row adds up to 1.

    The extension is exact for affine motion of the surface. On the surface it equals linear interpolation in the triangle.
    """

    points: Floats
    rest: Floats
    weights: Floats

    @classmethod
    def to(cls, points: Floats, rest: Surface) -> "Extension":
        """Compute the extension from the closed surface ``rest`` to ``points`` (m, 3), which are inside the surface or near it."""
        points = np.ascontiguousarray(points, np.float64)
        weights = np.zeros((len(points), len(rest.points)))
        nearest = distances(points, rest)
        on = nearest.distance <= _ON * diagonal(rest.points)
        edges = _Edges(rest.triangles)
        for i in np.flatnonzero(~on):
            weights[i] = _mean_value_weights(points[i], rest.points, edges)
        weights[np.flatnonzero(on)[:, None], rest.triangles[nearest.triangle[on]]] = nearest.barycentric[on]
        weights.setflags(write=False)
        return cls(points, rest.points, weights)

    def apply(self, positions: Floats) -> Floats:
        """Positions (m, 3) [mm] of the points when the points of the surface are at ``positions`` (n, 3) [mm]."""
        return np.asarray(self.points + self.weights @ (positions - self.rest))


class _Edges:
    """Edges of m ``triangles`` (m, 3). ``ends`` (2, e): the vertices of the e edges; ``opposite`` (3, m): the index of the edge
    opposite each corner of a triangle; ``sense`` (3, m): 1 or -1, the direction in which the triangle runs along that edge.
    """

    def __init__(self, triangles: Ints) -> None:
        self.corners = np.ascontiguousarray(triangles.T)
        both = self.corners[[[1, 2, 0], [2, 0, 1]]]  # (end, corner, m)
        self.sense = np.where(both[0] < both[1], 1.0, -1.0)
        ends, _, found, _ = distinct(np.sort(both, axis=0).reshape(2, -1).T)
        self.ends, self.opposite = ends.T, found.reshape(self.corners.shape)


def _mean_value_weights(point: Floats, rest: Floats, edges: _Edges) -> Floats:
    """Weights (n,) of the surface points ``rest`` (n, 3) for a ``point`` (3,) off the surface.

    The unit vectors u_i from the point to the corners of a triangle span a spherical triangle. Let c_i be the cross product of the
    other two unit vectors, s_i its length and theta_i the angle between them. The mean vector is m = 1/2 sum theta_i c_i / s_i.
    Corner i, at the distance d_i, has the weight c_i . m / (d_i c_i . u_i), where c_i . u_i is the same for all three corners.
    """
    rays = rest - point
    lengths = np.sqrt(np.einsum("nk,nk->n", rays, rays))
    units = np.ascontiguousarray((rays / lengths[:, None]).T)
    first, second = units.take(edges.ends, axis=1).transpose(1, 0, 2)  # ``take`` is several times as fast as indexing
    products = np.cross(first, second, axis=0)
    sines = np.sqrt(np.einsum("ke,ke->e", products, products))
    angles = np.arctan2(sines, np.einsum("ke,ke->e", first, second))
    turns = angles / (2 * np.maximum(sines, np.finfo(float).tiny)) * products
    own = products.take(edges.opposite, axis=1) * edges.sense  # (xyz, corner, m)
    mean = np.einsum("kim,im->km", turns.take(edges.opposite, axis=1), edges.sense)
    volumes = np.einsum("km,km->m", own[:, 0], units.take(edges.corners[0], axis=1))
    seen = np.abs(volumes) > _EDGE_ON * sines.take(edges.opposite).max(axis=0) ** 2
    weights = np.einsum("kim,km->im", own, mean) / np.where(seen, volumes, np.inf)
    total = np.bincount(edges.corners.ravel(), weights=weights.ravel(), minlength=len(rest)) / lengths
    return np.asarray(total / total.sum())
