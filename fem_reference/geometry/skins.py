"""The skin of a body of tetrahedra as its surface has it: material points beside the tets, each with its area."""

from dataclasses import dataclass

import igl
import numpy as np
from numpy.typing import NDArray

from fem_reference.geometry.embedding import Locator
from fem_reference.mesh import Floats, Ints, Surface, TetMesh, triangle_areas

_RULE = np.array([[4, 1, 1], [1, 4, 1], [1, 1, 4]]) / 6


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
    three points inside each, a rule that is exact for squares and has none on sharp edges, where two faces would be pushed at
    once; triangles are cut in four until their edges are no longer than ``spacing`` [mm] on average.
    """
    points, triangles = surface.points, surface.triangles[free[surface.triangles].all(axis=1)]
    while len(triangles) and _edge_length(points, triangles) > spacing:
        points, triangles = igl.upsample(points, triangles)
    inside = np.einsum("qk,tki->tqi", _RULE, points[triangles]).reshape(-1, 3)
    areas = np.repeat(triangle_areas(points, triangles) / 3, 3)
    return Skin(Locator(mesh).embed(inside).tets, inside, areas)


def _edge_length(points: Floats, triangles: Ints) -> float:
    """The mean over all triangles [mm]."""
    corners = points[triangles]
    return float(np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).mean())
