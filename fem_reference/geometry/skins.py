"""Material points on the surface of a body of tetrahedra, each with its area: where contact presses and springs pull."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fem_reference.foundations.mesh import Floats, Ints, Surface, TetMesh
from fem_reference.geometry.embedding import Locator

_RULE = np.array([[4, 1, 1], [1, 4, 1], [1, 1, 4]]) / 6
# Points on a surface are so many to its diagonal, or more: on muscles of the hip, 3 mm apart.
_ACROSS = 80


@dataclass(frozen=True, eq=False)
class Skin:
    """Material points of a surface that the cells follow only roughly: the straight ``cells`` (n,) they move with, ``points``
    (n, 3) [mm] where they are at rest, somewhat outside their cell perhaps, and the rest ``areas`` (n,) [mm2] that each stands for.
    """

    cells: Ints
    points: Floats
    areas: Floats


def spacing(surface: Surface) -> float:
    """How far apart [mm] points on a ``surface`` are at most, on average: the same whatever it is filled with."""
    return float(np.linalg.norm(np.ptp(surface.points, axis=0))) / _ACROSS


def free_skin(surface: Surface, free: NDArray[np.bool_], mesh: TetMesh, apart: float) -> Skin:
    """The material points of the free part of a surface.

    Parameters
    ----------
    surface
        Of n vertices.
    free
        Vertices (n,) that are free: a triangle belongs to the skin where all three of its vertices do.
    mesh
        The tetrahedra that carry the points.
    apart
        The distance of points [mm], on average and at most.

    """
    triangles = surface.triangles[free[surface.triangles].all(axis=1)]
    return _skin(surface.points[triangles], np.ones(triangles.shape), mesh, apart)


def attached_skin(surface: Surface, shares: Floats, mesh: TetMesh, apart: float) -> Skin:
    """The material points of the attached part of a surface.

    Parameters
    ----------
    surface
        Of m triangles.
    shares
        Attached shares (m, 3) of their corners, linear between them: the areas of the points are those attached.
    mesh, apart
        As of :func:`free_skin`.

    """
    some = shares.any(axis=1)
    return _skin(surface.points[surface.triangles[some]], shares[some], mesh, apart)


def _skin(corners: Floats, shares: Floats, mesh: TetMesh, apart: float) -> Skin:
    """Three points inside each triangle of ``corners`` (t, 3, 3), a rule that is exact for squares and has none on sharp edges,
    where two faces would be in contact at once; they are cut in four until their edges are no longer than ``apart`` [mm] on
    average.
    """
    while len(corners) and _edge_length(corners) > apart:
        corners, shares = _quartered(corners), _quartered(shares[:, :, None])[:, :, 0]
    inside = np.einsum("qk,tki->tqi", _RULE, corners).reshape(-1, 3)
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    areas = np.repeat(np.linalg.norm(normals, axis=1) / 6, 3) * (shares @ _RULE.T).ravel()
    return Skin(Locator(mesh).embed(inside).tets, inside, areas)


def _quartered(corners: Floats) -> Floats:
    """Triangles of values at their corners (t, 3, d), each cut in four at the middles of its edges, (4 t, 3, d)."""
    a, b, c = np.swapaxes(corners, 0, 1)
    ab, bc, ca = (a + b) / 2, (b + c) / 2, (c + a) / 2
    return np.concatenate([np.stack(part, axis=1) for part in ((a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca))])


def _edge_length(corners: Floats) -> float:
    """The mean over all triangles [mm]."""
    return float(np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).mean())
