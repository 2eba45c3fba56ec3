"""Material points on the surface of a tetrahedral body, each with its area: for contact pressure and springs."""

from dataclasses import dataclass

import numpy as np

from fem_reference.foundations.mesh import Floats, Ints, Surface, TetMesh, corner_areas, diagonal
from fem_reference.geometry.embedding import Locator
from fem_reference.geometry.pieces import Pieces, edge_lengths

_RULE = np.array([[4, 1, 1], [1, 4, 1], [1, 1, 4]]) / 6
# The least number of points along the diagonal of a surface: on muscles of the hip, 3 mm apart.
_ACROSS = 80


@dataclass(frozen=True, eq=False)
class Skin:
    """Material points of a surface that the cells follow only roughly: the straight ``cells`` (n,) that carry them, their rest
    positions ``points`` (n, 3) [mm], perhaps somewhat outside their cell, and their rest ``areas`` (n,) [mm2].
    """

    cells: Ints
    points: Floats
    areas: Floats


def spacing(surface: Surface) -> float:
    """The greatest average distance [mm] of points on a ``surface``, independent of its mesh."""
    return diagonal(surface.points) / _ACROSS


def attached_skin(surface: Surface, shares: Floats, mesh: TetMesh, apart: float) -> Skin:
    """The material points of the attached part of a ``surface`` of m triangles, on average at most ``apart`` [mm] from each
    other, carried by the tetrahedra of a ``mesh``. Their areas are weighted by the attached ``shares`` (m, 3) of corners, linear
    in between.
    """
    pieces, corners = Pieces.whole(np.flatnonzero(shares.any(axis=1))), surface.points[surface.triangles]
    while len(pieces.parents) and edge_lengths(pieces.of(corners)).mean() > apart:
        pieces = pieces.quartered()
    return embedded(*points(pieces.of(corners), pieces.of(shares[:, :, None])[:, :, 0]), mesh)


def points(corners: Floats, shares: Floats) -> tuple[Floats, Floats]:
    """Three points (3 k, 3) [mm] inside each triangle of ``corners`` (k, 3, 3), a rule that is exact for squares and has no
    points on sharp edges, which would be in contact on two faces at once; and their areas (3 k,) [mm2], weighted by ``shares``
    (k, 3).
    """
    areas = np.repeat(corner_areas(corners) / 3, 3) * (shares @ _RULE.T).ravel()
    return np.einsum("qk,tki->tqi", _RULE, corners).reshape(-1, 3), areas


def embedded(places: Floats, areas: Floats, mesh: TetMesh) -> Skin:
    """The skin of ``places`` (n, 3) [mm] and ``areas`` (n,) [mm2], carried by a ``mesh``."""
    return Skin(Locator(mesh).embed(places).tets, places, areas)
