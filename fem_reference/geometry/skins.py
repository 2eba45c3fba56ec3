"""Material points on the surface of a body, each with its area, and small pieces of triangles: for contact and springs."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fem_reference.foundations.mesh import Floats, Ints, Surface, TetMesh, corner_areas, diagonal
from fem_reference.geometry.embedding import Locator

# A triangle is thin if the square of its longest edge is more than this many times its area; half a square has the ratio 4.
_THIN = 5.0
# A triangle cut in four: the barycentric coordinates (3, 3) of the corners of each part.
_QUARTERS = np.array(
    [
        [[2, 0, 0], [1, 1, 0], [1, 0, 1]],
        [[1, 1, 0], [0, 2, 0], [0, 1, 1]],
        [[1, 0, 1], [0, 1, 1], [0, 0, 2]],
        [[1, 1, 0], [0, 1, 1], [1, 0, 1]],
    ]
) / 2  # fmt: skip
_RULE = np.array([[4, 1, 1], [1, 4, 1], [1, 1, 4]]) / 6
# The minimum number of points along the diagonal of a surface: on hip muscles the points are 3 mm apart.
_ACROSS = 80


@dataclass(frozen=True, eq=False)
class Skin:
    """Material points of a surface that the mesh follows only roughly. They have straight ``cells`` (n,) that carry them, rest
    positions ``points`` (n, 3) [mm], possibly slightly outside their cells, and rest ``areas`` (n,) [mm2].
    """

    cells: Ints
    points: Floats
    areas: Floats


def spacing(surface: Surface) -> float:
    """The maximum average distance [mm] of points on a ``surface``, independent of its mesh."""
    return diagonal(surface.points) / _ACROSS


def attached_skin(surface: Surface, shares: Floats, mesh: TetMesh, apart: float) -> Skin:
    """The material points of the attached part of a ``surface``, on average at most ``apart`` [mm] from each other, carried by a
    ``mesh``. Their areas are weighted by the attached ``shares`` (m, 3) of the corners of its m triangles, linear in between.
    """
    pieces, corners = Pieces.whole(np.flatnonzero(shares.any(axis=1))), surface.points[surface.triangles]
    while len(pieces.parents) and edge_lengths(pieces.of(corners)).mean() > apart:
        pieces = pieces.quartered()
    return embedded(*points(pieces.of(corners), pieces.of(shares[:, :, None])[:, :, 0]), mesh)


def points(corners: Floats, shares: Floats) -> tuple[Floats, Floats]:
    """Three points (3 k, 3) [mm] in each triangle of ``corners`` (k, 3, 3) by a rule exact for quadratic functions, and their areas
    (3 k,) [mm2], weighted by ``shares`` (k, 3). No point is on a sharp edge, where it would be in contact on two faces at once.
    """
    areas = np.repeat(corner_areas(corners) / 3, 3) * (shares @ _RULE.T).ravel()
    return np.einsum("qk,tki->tqi", _RULE, corners).reshape(-1, 3), areas


def embedded(places: Floats, areas: Floats, mesh: TetMesh) -> Skin:
    """The skin of ``places`` (n, 3) [mm] and ``areas`` (n,) [mm2], carried by a ``mesh``."""
    return Skin(Locator(mesh).embed(places).tets, places, areas)


@dataclass(frozen=True, eq=False)
class Pieces:
    """Pieces of triangles: the ``parents`` (k,), their triangles, and their ``corners`` (k, 3, 3) in barycentric coordinates."""

    parents: Ints
    corners: Floats

    @classmethod
    def whole(cls, triangles: Ints) -> "Pieces":
        """The uncut triangles with the indices ``triangles`` (k,)."""
        return cls(triangles, np.broadcast_to(np.eye(3), (len(triangles), 3, 3)))

    def __getitem__(self, some: NDArray[np.bool_]) -> "Pieces":
        return Pieces(self.parents[some], self.corners[some])

    def __add__(self, others: "Pieces") -> "Pieces":
        parents, corners = ((self.parents, others.parents), (self.corners, others.corners))
        return Pieces(np.concatenate(parents), np.concatenate(corners))

    def of(self, values: Floats) -> Floats:
        """Values (k, 3, d) at the corners of the pieces, linear in the triangles with ``values`` (m, 3, d) at their corners."""
        return self.corners @ values[self.parents]

    def quartered(self) -> "Pieces":
        """The pieces, each cut in four at the midpoints of its edges."""
        return Pieces(np.tile(self.parents, 4), quartered(self.corners))

    def halved(self, lengths: Floats) -> "Pieces":
        """The pieces, each cut in two at the middle of its longest edge; ``lengths`` (k, 3): of the edge from each corner."""
        order = (lengths.argmax(axis=1)[:, None] + np.arange(3)) % 3
        a, b, c = np.swapaxes(np.take_along_axis(self.corners, order[:, :, None], axis=1), 0, 1)
        halves = [np.stack([a, (a + b) / 2, c], axis=1), np.stack([(a + b) / 2, b, c], axis=1)]
        return Pieces(np.tile(self.parents, 2), np.concatenate(halves))


def quartered(corners: Floats) -> Floats:
    """Triangles with ``corners`` (k, 3, 3), each cut in four at the middles of its edges (4 k, 3, 3): part by part."""
    return np.asarray(np.einsum("qcj,kji->qkci", _QUARTERS, corners).reshape(-1, 3, 3))


def edge_lengths(corners: Floats) -> Floats:
    """Edge lengths (k, 3) [mm] of triangles with ``corners`` (k, 3, 3), of the edge from each corner to the next."""
    return np.asarray(np.linalg.norm(corners - np.roll(corners, -1, axis=1), axis=2))


def cut(surface: Surface, triangles: Ints, apart: float) -> Pieces:
    """The ``triangles`` (k,) of a ``surface``, cut in four, or in two if thin, until their mean edge is at most ``apart`` [mm]."""
    corners, pieces = surface.points[surface.triangles], Pieces.whole(triangles)
    while (large := (lengths := edge_lengths(pieces.of(corners))).mean(axis=1) > apart).any():
        thin = large & (lengths.max(axis=1) ** 2 > _THIN * corner_areas(pieces.of(corners)))
        pieces = pieces[~large] + pieces[thin].halved(lengths[thin]) + pieces[large & ~thin].quartered()
    return pieces
