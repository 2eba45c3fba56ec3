"""Which tetrahedron each point lies in, and where in it: what carries a solution to other points."""

from dataclasses import dataclass

import igl
import numpy as np

from fem_reference.mesh import Floats, Ints, TetMesh, boundary

# A point that round-off leaves between two tets is looked for again this far away, as a share of the mesh's diagonal.
_NUDGE = 1e-9


@dataclass(frozen=True, eq=False)
class Embedding:
    """For each of n points its tet, its coordinates there, and how far outside the mesh it is.

    ``tets`` (n,), ``barycentric`` (n, 4), ``outside`` (n,) [mm], 0 inside. Outside, the tet is the one behind the
    closest boundary triangle and its coordinates extrapolate (some are negative).
    """

    tets: Ints
    barycentric: Floats
    outside: Floats

    def interpolate(self, mesh: TetMesh, values: Floats) -> Floats:
        """``values`` (k,) or (k, d) at the points of ``mesh``, linearly interpolated: (n,) or (n, d)."""
        return np.asarray(np.einsum("ij,ij...->i...", self.barycentric, values[mesh.tets[self.tets]]))


class Locator:
    """Search trees over a mesh, for those who embed many times."""

    def __init__(self, mesh: TetMesh) -> None:
        self.mesh = mesh
        self.faces, self.behind = boundary(mesh.tets)
        self.diagonal = float(np.linalg.norm(np.ptp(mesh.points, axis=0)))
        self._tree, self._skin = igl.AABB(), igl.AABB()
        self._tree.init(mesh.points, mesh.tets)
        self._skin.init(mesh.points, self.faces)

    def embed(self, points: Floats) -> Embedding:
        """The tets that contain ``points`` (n, 3) [mm]."""
        points = np.ascontiguousarray(points, np.float64)
        tets = self._containing(points)
        lost = np.flatnonzero(tets < 0)
        for corner in ((1, 1, 1), (1, -1, -1), (-1, 1, -1), (-1, -1, 1)):
            tets[lost] = self._containing(points[lost] + _NUDGE * self.diagonal * np.array(corner))
            lost = lost[tets[lost] < 0]
        outside = np.zeros(len(points))
        outside[lost], face = self.skin_distance(points[lost])
        tets[lost] = self.behind[face]
        return Embedding(tets, _barycentric(points, self.mesh.points[self.mesh.tets[tets]]), outside)

    def skin_distance(self, points: Floats) -> tuple[Floats, Ints]:
        """Distance (n,) [mm] from ``points`` (n, 3) to the boundary, and the closest boundary triangle (n,)."""
        if len(points) == 0:
            return np.zeros(0), np.zeros(0, np.int64)
        square, face, _ = self._skin.squared_distance(self.mesh.points, self.faces, np.ascontiguousarray(points))
        return np.sqrt(square), face

    def _containing(self, points: Floats) -> Ints:
        if len(points) == 0:
            return np.zeros(0, np.int64)
        return np.array(igl.in_element(self.mesh.points, self.mesh.tets, points, self._tree), np.int64)


def embed(mesh: TetMesh, points: Floats) -> Embedding:
    """Where ``points`` (n, 3) [mm] lie in ``mesh``."""
    return Locator(mesh).embed(points)


def _barycentric(points: Floats, corners: Floats) -> Floats:
    """Barycentric coordinates (n, 4) of points (n, 3) in tets of ``corners`` (n, 4, 3)."""
    edges = np.swapaxes(corners[:, 1:] - corners[:, :1], 1, 2)
    last = np.linalg.solve(edges, (points - corners[:, 0])[:, :, None])[:, :, 0]
    return np.concatenate([1 - last.sum(axis=1, keepdims=True), last], axis=1)
