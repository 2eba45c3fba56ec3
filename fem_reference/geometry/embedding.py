"""Point location in tetrahedra: the tetrahedron of each point and its barycentric coordinates, which interpolate a solution."""

from dataclasses import dataclass
from functools import cached_property

import igl
import numpy as np

from fem_reference.foundations.mesh import Floats, Ints, Surface, TetMesh, boundary, diagonal, edge_vectors
from fem_reference.geometry.distance import Distances, distances

# A point that rounding leaves between two tets is searched again at this distance, as a fraction of the mesh's diagonal.
_NUDGE = 1e-9
# A closest point with a barycentric coordinate below this counts as on the opposite edge, or at a corner.
_TIE = 1e-9


@dataclass(frozen=True, eq=False)
class Embedding:
    """The tet of each of n points, its barycentric coordinates there, and its distance outside the mesh.

    ``tets`` (n,), ``barycentric`` (n, 4), ``outside`` (n,) [mm], 0 inside. For a point outside, the tet is behind the closest
    boundary triangle, and the coordinates extrapolate (some are negative).
    """

    tets: Ints
    barycentric: Floats
    outside: Floats

    def interpolate(self, mesh: TetMesh, values: Floats) -> Floats:
        """``values`` (k,) or (k, d) at the points of ``mesh``, linearly interpolated: (n,) or (n, d)."""
        return np.asarray(np.einsum("ij,ij...->i...", self.barycentric, values[mesh.tets[self.tets]]))


class Locator:
    """Search trees over a mesh, for repeated embedding."""

    def __init__(self, mesh: TetMesh) -> None:
        self.mesh = mesh
        self.faces, self.behind = boundary(mesh.tets)
        self.diagonal = diagonal(mesh.points)
        self.skin = Surface(mesh.points, self.faces, "the skin of the tetrahedra")
        self._tree = igl.AABB()
        self._tree.init(mesh.points, mesh.tets)

    def embed(self, points: Floats) -> Embedding:
        """The embedding of ``points`` (n, 3) [mm]."""
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
        """The closest boundary triangles (n,); at an edge or corner the first of them, so that rounding does not decide."""
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
    """The embedding of ``points`` (n, 3) [mm] in ``mesh``."""
    return Locator(mesh).embed(points)


def barycentric(points: Floats, corners: Floats) -> Floats:
    """Barycentric coordinates (n, 4) of points (n, 3) in tets of ``corners`` (n, 4, 3)."""
    last = np.linalg.solve(edge_vectors(corners), (points - corners[:, 0])[:, :, None])[:, :, 0]
    return np.concatenate([1 - last.sum(axis=1, keepdims=True), last], axis=1)
