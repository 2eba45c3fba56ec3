"""Location of points in tetrahedra: the tetrahedron of each point and its barycentric coordinates, for interpolating a solution."""

from dataclasses import dataclass
from functools import cached_property

import igl
import numpy as np

from fem_reference.foundations.mesh import Floats, Ints, Surface, TetMesh, boundary, diagonal, edge_vectors
from fem_reference.geometry.distance import Distances, distances

# A point that is found in no tet because of rounding is displaced by this fraction of the mesh's diagonal and looked up again.
_NUDGE = 1e-9
# A closest point with a barycentric coordinate below this value is considered to be on the opposite edge, or at a corner.
_TIE = 1e-9


@dataclass(frozen=True, eq=False)
class Embedding:
    """Positions of n points in a tetrahedral mesh. ``tets`` (n,): the tet of each point; ``barycentric`` (n, 4): the coordinates in
    that tet; ``outside`` (n,) [mm]: the distance of the point from the mesh, 0 if it is inside.

    A point outside the mesh belongs to the tet behind the closest boundary triangle; some of its coordinates are then negative.
    """

    tets: Ints
    barycentric: Floats
    outside: Floats

    def interpolate(self, mesh: TetMesh, values: Floats) -> Floats:
        """Interpolate ``values`` (k,) or (k, d) at the points of ``mesh`` linearly; returns (n,) or (n, d)."""
        return np.asarray(np.einsum("ij,ij...->i...", self.barycentric, values[mesh.tets[self.tets]]))


class Locator:
    """Search trees of a mesh, for repeated embedding."""

    def __init__(self, mesh: TetMesh) -> None:
        self.mesh = mesh
        self.faces, self.behind = boundary(mesh.tets)
        self.diagonal = diagonal(mesh.points)
        self.skin = Surface(mesh.points, self.faces, "the skin of the tetrahedra")
        self._tree = igl.AABB()
        self._tree.init(mesh.points, mesh.tets)

    def embed(self, points: Floats) -> Embedding:
        """Embed ``points`` (n, 3) [mm]."""
        points = np.ascontiguousarray(points, np.float64)
        tets = self._containing(points)
        lost = np.flatnonzero(tets < 0)
        for corner in ((1, 1, 1), (1, -1, -1), (-1, 1, -1), (-1, -1, 1)):
            tets[lost] = self._containing(points[lost] + _NUDGE * self.diagonal * np.array(corner))
            lost = lost[tets[lost] < 0]
        outside = np.zeros(len(points))
        if len(lost):
            skin = distances(points[lost], self.skin)
            outside[lost] = skin.distance
            tets[lost] = self.behind[self._first_of_ties(skin)]
        return Embedding(tets, barycentric(points, self.mesh.points[self.mesh.tets[tets]]), outside)

    def _first_of_ties(self, skin: Distances) -> Ints:
        """Closest boundary triangles (n,); at an edge or corner the first of those around it, so that rounding has no influence."""
        chosen, inner = np.array(skin.triangle), skin.barycentric
        for i in np.flatnonzero((inner < _TIE).any(axis=1)):
            chosen[i] = self._firsts[frozenset(self.faces[chosen[i]][inner[i] >= _TIE].tolist())]
        return chosen

    @cached_property
    def _firsts(self) -> dict[frozenset[int], int]:
        """The first boundary triangle at each edge and corner of the boundary."""
        firsts: dict[frozenset[int], int] = {}
        for i, (a, b, c) in enumerate(self.faces.tolist()):
            for shared in ((a,), (b,), (c,), (a, b), (b, c), (c, a)):
                firsts.setdefault(frozenset(shared), i)
        return firsts

    def _containing(self, points: Floats) -> Ints:
        if len(points) == 0:
            return np.zeros(0, np.int64)
        return np.array(igl.in_element(self.mesh.points, self.mesh.tets, points, self._tree), np.int64)


def embed(mesh: TetMesh, points: Floats) -> Embedding:
    """Embed ``points`` (n, 3) [mm] in ``mesh``."""
    return Locator(mesh).embed(points)


def barycentric(points: Floats, corners: Floats) -> Floats:
    """Barycentric coordinates (n, 4) of ``points`` (n, 3) in tets with ``corners`` (n, 4, 3)."""
    last = np.linalg.solve(edge_vectors(corners), (points - corners[:, 0])[:, :, None])[:, :, 0]
    return np.concatenate([1 - last.sum(axis=1, keepdims=True), last], axis=1)
