"""One fixed linear extension of a surface's displacement to points inside it, the same for every run of a scene.

Mean value coordinates for closed triangle meshes: Ju, Schaefer, Warren 2005, doi 10.1145/1073204.1073229.
"""

from dataclasses import dataclass

import numpy as np

from fem_reference.foundations.mesh import Floats, Surface
from fem_reference.geometry.distance import distances

# Closer to the surface than this share of its diagonal a point counts as on it.
_ON = 1e-10
# A triangle whose plane passes the point at a sine below this counts as seen edge on: it covers no solid angle.
_EDGE_ON = 1e-10


@dataclass(frozen=True, eq=False)
class Extension:
    """``points`` (m, 3) [mm] that follow a surface at ``rest`` (n, 3) [mm] by ``weights`` (m, n), whose rows sum to 1.

    Exact for affine motion of the surface; on the surface it is linear interpolation in the triangle.
    """

    points: Floats
    rest: Floats
    weights: Floats

    @classmethod
    def to(cls, points: Floats, rest: Surface) -> "Extension":
        """The extension from the closed surface ``rest`` to ``points`` (m, 3) inside it or near it."""
        points = np.ascontiguousarray(points, np.float64)
        weights = np.zeros((len(points), len(rest.points)))
        nearest = distances(points, rest)
        on = nearest.distance <= _ON * np.linalg.norm(np.ptp(rest.points, axis=0))
        for i in np.flatnonzero(~on):
            weights[i] = _mean_value_weights(points[i], rest)
        weights[np.flatnonzero(on)[:, None], rest.triangles[nearest.triangle[on]]] = nearest.barycentric[on]
        weights.setflags(write=False)
        return cls(points, rest.points, weights)

    def apply(self, positions: Floats) -> Floats:
        """Where the points are (m, 3) [mm] when the surface's points are at ``positions`` (n, 3) [mm]."""
        return np.asarray(self.points + self.weights @ (positions - self.rest))


def _mean_value_weights(point: Floats, rest: Surface) -> Floats:
    """The weights (n,) of a point off the surface.

    The unit vectors u_i to the corners of a triangle span a spherical triangle. With n_i the unit normal of the plane
    through the point and the edge opposite corner i, and theta_i the angle that edge is seen under, its mean vector
    is m = 1/2 sum theta_i n_i, and corner i at the distance d_i gets the weight n_i . m / (d_i n_i . u_i).
    """
    rays = rest.points - point
    lengths = np.sqrt(np.einsum("ij,ij->i", rays, rays))
    corners = np.ascontiguousarray((rays / lengths[:, None])[rest.triangles].transpose(1, 2, 0))  # (corner, xyz, m)
    normals, sines, cosines = _planes(corners)
    mean = np.einsum("ik,ijk->jk", np.arctan2(sines, cosines), normals) / 2
    heights = np.einsum("ijk,ijk->ik", normals, corners)
    seen = (np.abs(heights) > _EDGE_ON * sines.max(axis=0)).all(axis=0)
    weights = np.einsum("ijk,jk->ik", normals, mean) / np.where(seen, heights, np.inf) / lengths[rest.triangles.T]
    total = np.bincount(rest.triangles.T.ravel(), weights=weights.ravel(), minlength=len(rest.points))
    return np.asarray(total / total.sum())


def _planes(corners: Floats) -> tuple[Floats, Floats, Floats]:
    """The plane that the other two unit vectors span, for each corner of m triangles, ``corners`` (3, xyz, m).

    Its unit normal (3, xyz, m), and sine and cosine (3, m) of the angle between the two.
    """
    ahead, behind = corners[[1, 2, 0]], corners[[2, 0, 1]]
    normals = np.cross(ahead, behind, axis=1)
    sines = np.sqrt(np.einsum("ijk,ijk->ik", normals, normals))
    normals /= np.maximum(sines, np.finfo(float).tiny)[:, None, :]
    return normals, sines, np.einsum("ijk,ijk->ik", ahead, behind)
