"""Edges of a closed surface: their lengths and dihedral angles."""

from dataclasses import dataclass

import numpy as np

from fem_reference.foundations.mesh import Floats, Ints, Surface, triangle_areas, twins


@dataclass(frozen=True, eq=False)
class Edges:
    """Edges of a closed surface. ``ends`` (e, 2): the first and the second vertex; ``beside`` (e, 2): the triangles to the left and
    to the right of the edge, seen from outside; ``opposite`` (e, 2): the third vertices of these triangles; ``areas`` (e,) [mm2]: a
    third of the total area of both triangles.
    """

    ends: Ints
    beside: Ints
    opposite: Ints
    areas: Floats

    @classmethod
    def of(cls, surface: Surface) -> "Edges":
        """Collect the edges of a closed, consistently oriented surface at rest; their areas add up to the area of the surface."""
        triangles = surface.triangles
        ends = np.stack([triangles, np.roll(triangles, -1, axis=1)], axis=2).reshape(-1, 2)
        sides = twins(triangles)
        third = np.roll(triangles, -2, axis=1).ravel()
        areas = triangle_areas(surface.points, triangles) / 3
        return cls(ends[sides[:, 0]], sides // 3, third[sides], areas[sides // 3].sum(axis=1))

    def lengths(self, points: Floats) -> Floats:
        """Length (e,) [mm] of each edge when the vertices of the surface are at ``points`` (n, 3) [mm]."""
        return np.asarray(np.linalg.norm(points[self.ends[:, 1]] - points[self.ends[:, 0]], axis=1))

    @np.errstate(over="ignore", invalid="ignore")
    def angles(self, points: Floats) -> Floats:
        """Dihedral angle (e,) [rad], in (-pi, pi], from the normal of the left triangle to the normal of the right triangle.

        The angle is 0 if the triangles are coplanar, pi / 2 at the edges of a box, negative at a concave edge, and NaN if a
        triangle has no normal. It equals atan2((n x m) . d, n . m) with the unit normals n, m and the direction d of the edge.
        Eq. 5.23 of report DCSE/TR-2022-03 has an arccos instead, which loses the sign and, for small angles, digits.
        """
        start, end = (points[corner] for corner in self.ends.T)
        along = end - start
        left = _unit(np.cross(along, points[self.opposite[:, 0]] - start))
        right = _unit(np.cross(points[self.opposite[:, 1]] - start, along))
        sine = np.einsum("ij,ij->i", np.cross(left, right), _unit(along))
        return np.asarray(np.arctan2(sine, np.einsum("ij,ij->i", left, right)))


def _unit(vectors: Floats) -> Floats:
    """Scale vectors (e, 3) to length 1; NaN for a vector whose length is zero or not finite."""
    lengths = np.linalg.norm(vectors, axis=1)
    return np.asarray(vectors / np.where(np.isfinite(lengths), lengths, np.nan)[:, None])
