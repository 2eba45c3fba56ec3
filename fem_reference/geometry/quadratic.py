"""Tetrahedra with quadratic displacements: exact integrals of positions and of vector areas."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import skfem
from skfem.quadrature import get_quadrature

from fem_reference.foundations.mesh import TET_FACES, Floats, Ints, TetMesh, corner_areas, tet_volumes

# The pairs of corners of a tet at whose midpoints its last six nodes lie.
EDGES = np.array([[0, 1], [0, 2], [1, 2], [0, 3], [1, 3], [2, 3]])
_MIDDLE = np.zeros((4, 4), np.int64)
_MIDDLE[EDGES[:, 0], EDGES[:, 1]] = _MIDDLE[EDGES[:, 1], EDGES[:, 0]] = np.arange(4, 10)
# The weights of the ten nodes in the mean of a quadratic function over a straight tet, and of the six nodes over a triangle.
_BULK = np.repeat([-1 / 20, 1 / 5], [4, 6])
_FLAT = np.repeat([0, 1 / 3], 3)


@dataclass(frozen=True, eq=False)
class Displaced:
    """A ``mesh``, straight at rest, with the displacements ``by`` (k, 10, 3) [mm] and the ``velocity`` (k, 10, 3) [mm/s] of the
    nodes of its tets, None if unknown. The nodes of a tet are its corners and then the midpoints of its ``EDGES``. The class
    implements :class:`fem_reference.foundations.loads.Shape`.
    """

    mesh: TetMesh
    by: Floats | None = None
    velocity: Floats | None = None

    @cached_property
    def nodes(self) -> Floats:
        """Current positions (k, 10, 3) [mm] of the nodes; NaN if they are unknown."""
        corners = self.mesh.points[self.mesh.tets]
        middles = corners[:, EDGES].mean(axis=2)
        return np.asarray(np.concatenate([corners, middles], axis=1) + (np.nan if self.by is None else self.by))

    def measure(self, on: str | None = None) -> tuple[float, Floats]:
        """Return the rest volume [mm3], or the rest area [mm2] of a region ``on``, and the integral (3,) of the current positions
        over that volume or area.
        """
        if on is None:
            sizes = tet_volumes(self.mesh.points, self.mesh.tets)
            means = np.einsum("q,kqi->ki", _BULK, self.nodes)
        else:
            tets, local = self._facets(on)
            sizes = corner_areas(self.mesh.points[np.take_along_axis(self.mesh.tets[tets], local[:, :3], axis=1)])
            means = np.einsum("q,mqi->mi", _FLAT, self.nodes[tets[:, None], local])
        return float(sizes.sum()), np.asarray(sizes @ means)

    def facing(self, on: str) -> tuple[Floats, Floats] | None:
        """Current vector area (3,) [mm2] of a region, outward, and its moment (3,) [mm3] about the origin; None if unknown."""
        if self.by is None:
            return None
        tets, local = self._facets(on)
        values, slopes, weights = _rule(skfem.ElementTriP2())
        nodes = self.nodes[tets[:, None], local]
        places, (one, other) = values @ nodes, (slope @ nodes for slope in slopes)
        areas = weights[:, None] * np.cross(one, other)
        return areas.sum(axis=(0, 1)), np.cross(places, areas).sum(axis=(0, 1))

    def motion(self) -> tuple[Floats, Floats] | None:
        """Return integrals over the rest volume of the velocity (3,) [mm4/s] and of its moment (3,) [mm5/s]; None if unknown."""
        if self.by is None or self.velocity is None:
            return None
        sizes = tet_volumes(self.mesh.points, self.mesh.tets)
        values, _, weights = _rule(skfem.ElementTetP2())
        products = 6 * (weights * values.T) @ values  # mean of each product of two basis functions over a tet
        moments = np.cross(products @ self.nodes, self.velocity).sum(axis=1)
        return sizes @ np.einsum("q,kqi->ki", _BULK, self.velocity), sizes @ moments

    def _facets(self, on: str) -> tuple[Ints, Ints]:
        """Return the tet (m,) of each facet of a region, and the facet's local nodes (m, 6): outward corners, then midpoints."""
        size = len(self.mesh.points)
        found, wanted = (
            (ends[:, 0] * size + ends[:, 1]) * size + ends[:, 2]
            for ends in (np.sort(self.mesh.tets[:, TET_FACES].reshape(-1, 3)), np.sort(self.mesh.facets[on]))
        )
        tets, sides = np.divmod(np.flatnonzero(np.isin(found, wanted)), 4)
        corners = TET_FACES[sides]
        return tets, np.hstack([corners, _MIDDLE[corners, np.roll(corners, -1, axis=1)]])


def _rule(element: skfem.ElementTriP2 | skfem.ElementTetP2) -> tuple[Floats, Floats, Floats]:
    """Basis functions (q, n) and their gradients (d, q, n) at the points of a rule exact to degree 4, and its weights (q,)."""
    points, weights = get_quadrature(element, 4)
    nodes = range(6) if element.dim == 2 else (0, 1, 2, 3, 4, 6, 5, 7, 8, 9)  # scikit-fem orders edge 12 before edge 02
    values, slopes = zip(*(element.lbasis(points, i) for i in nodes), strict=True)
    return np.stack(values, axis=-1), np.stack(slopes, axis=-1), weights


def quadratic(nodal: Floats) -> Floats:
    """Values (k, 10, c) at the ten nodes of tets. ``nodal``: these values or, if linear, the values (k, 4, c) at the corners."""
    return nodal if nodal.shape[1] == 10 else np.concatenate([nodal, nodal[:, EDGES].mean(axis=2)], axis=1)
