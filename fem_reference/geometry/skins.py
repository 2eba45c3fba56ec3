"""The skin of a body of tetrahedra as its surface has it: material points beside the tets, each with its area."""

from dataclasses import dataclass

import igl
import numpy as np
from numpy.typing import NDArray

from fem_reference.geometry.embedding import Locator
from fem_reference.mesh import Floats, Ints, Surface, TetMesh, triangle_areas


@dataclass(frozen=True, eq=False)
class Skin:
    """Material points that obstructions push on, for a surface that the cells follow only roughly: the straight ``cells`` (n,)
    they move with, ``points`` (n, 3) [mm] where they are at rest, somewhat outside their cell perhaps, and the rest ``areas``
    (n,) [mm2] that each stands for.
    """

    cells: Ints
    points: Floats
    areas: Floats


def skin_of(surface: Surface, free: NDArray[np.bool_], mesh: TetMesh, spacing: float) -> Skin:
    """The skin of the triangles of a ``surface`` whose vertices are all ``free`` (n,), as what the tets of ``mesh`` carry along:
    the middles of edges, a rule that is exact for squares; triangles with edges longer than ``spacing`` [mm] are cut in four.
    """
    points, triangles = surface.points, surface.triangles[free[surface.triangles].all(axis=1)]
    while len(triangles) and _edges(points, triangles)[1].mean() > spacing:
        points, triangles = igl.upsample(points, triangles)
    ends, _ = _edges(points, triangles)
    ends, which = np.unique(np.sort(ends, axis=1), axis=0, return_inverse=True)
    thirds = np.repeat(triangle_areas(points, triangles) / 3, 3)
    middles = points[ends].mean(axis=1)
    return Skin(Locator(mesh).embed(middles).tets, middles, np.bincount(which.ravel(), thirds, len(ends)))


def _edges(points: Floats, triangles: Ints) -> tuple[Ints, Floats]:
    """The ends (3 t, 2) of the edges of each of t triangles, and their lengths (3 t,) [mm]."""
    ends = triangles[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2)
    return ends, np.linalg.norm(points[ends[:, 1]] - points[ends[:, 0]], axis=1)
