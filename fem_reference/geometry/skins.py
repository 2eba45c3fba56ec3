"""Material points on the surface of a body, each with an area, and small pieces of triangles, for contact and springs."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fem_reference.foundations.mesh import Floats, Ints, Surface, TetMesh, corner_areas, diagonal
from fem_reference.geometry.embedding import Locator

# A triangle is thin if the square of its longest edge exceeds this many times its area. The ratio is 4 for half a square.
_THIN = 5.0
# A triangle cut into four: the barycentric coordinates (3, 3) of the corners of each part.
_QUARTERS = np.array(
    [
        [[2, 0, 0], [1, 1, 0], [1, 0, 1]],
        [[1, 1, 0], [0, 2, 0], [0, 1, 1]],
        [[1, 0, 1], [0, 1, 1], [0, 0, 2]],
        [[1, 1, 0], [0, 1, 1], [1, 0, 1]],
    ]
) / 2  # fmt: skip
_RULE = np.array([[4, 1, 1], [1, 4, 1], [1, 1, 4]]) / 6
# The minimum number of points along the diagonal of a surface's bounding box; on hip muscles, points are then 3 mm apart.
_ACROSS = 80


@dataclass(frozen=True, eq=False)
class Skin:
    """Material points on a surface that a mesh only approximates. ``cells`` (n,): the straight cell that carries each point;
    ``points`` (n, 3) [mm]: the rest positions, possibly slightly outside the cells; ``areas`` (n,) [mm2]: the rest areas.
    """

    cells: Ints
    points: Floats
    areas: Floats


def spacing(surface: Surface) -> float:
    """Upper limit [mm] of the mean distance between material points on a ``surface``, independent of its mesh."""
    return diagonal(surface.points) / _ACROSS


def attached_skin(surface: Surface, shares: Floats, mesh: TetMesh, apart: float) -> Skin:
    """Place material points, carried by ``mesh``, on the attached part of a ``surface``, on average at most ``apart`` [mm] apart.
    Their areas are multiplied by the attached share, interpolated linearly from ``shares`` (m, 3) at the corners of m triangles.
    """
    pieces, corners = Pieces.whole(np.flatnonzero(shares.any(axis=1))), surface.points[surface.triangles]
    while len(pieces.parents) and edge_lengths(pieces.of(corners)).mean() > apart:
        pieces = pieces.quartered()
    return embedded(*points(pieces.of(corners), pieces.of(shares[:, :, None])[:, :, 0]), mesh)


def points(corners: Floats, shares: Floats) -> tuple[Floats, Floats]:
    """Return three points (3 k, 3) [mm] in each triangle with ``corners`` (k, 3, 3), by a rule exact for quadratic functions, and
    their areas (3 k,) [mm2], weighted by ``shares`` (k, 3). No point is on a sharp edge, where it would belong to two faces.
    """
    areas = np.repeat(corner_areas(corners) / 3, 3) * (shares @ _RULE.T).ravel()
    return np.einsum("qk,tki->tqi", _RULE, corners).reshape(-1, 3), areas


def embedded(places: Floats, areas: Floats, mesh: TetMesh) -> Skin:
    """Create a skin from the points ``places`` (n, 3) [mm] with ``areas`` (n,) [mm2], carried by ``mesh``."""
    return Skin(Locator(mesh).embed(places).tets, places, areas)


@dataclass(frozen=True, eq=False)
class Pieces:
    """Pieces of triangles. ``parents`` (k,): indices of the triangles; ``corners`` (k, 3, 3): barycentric coordinates in these."""

    parents: Ints
    corners: Floats

    @classmethod
    def whole(cls, triangles: Ints) -> "Pieces":
        """Create uncut pieces from the triangles with the indices ``triangles`` (k,)."""
        return cls(triangles, np.broadcast_to(np.eye(3), (len(triangles), 3, 3)))

    def __getitem__(self, some: NDArray[np.bool_]) -> "Pieces":
        return Pieces(self.parents[some], self.corners[some])

    def __add__(self, others: "Pieces") -> "Pieces":
        parents, corners = ((self.parents, others.parents), (self.corners, others.corners))
        return Pieces(np.concatenate(parents), np.concatenate(corners))

    def of(self, values: Floats) -> Floats:
        """Interpolate ``values`` (m, 3, d) linearly from the corners of the triangles to the corners (k, 3, d) of the pieces."""
        return self.corners @ values[self.parents]

    def quartered(self) -> "Pieces":
        """Cut each piece into four at the midpoints of its edges."""
        return Pieces(np.tile(self.parents, 4), quartered(self.corners))

    def halved(self, lengths: Floats) -> "Pieces":
        """Cut each piece into two at the midpoint of its longest edge; ``lengths`` (k, 3): see :func:`edge_lengths`."""
        order = (lengths.argmax(axis=1)[:, None] + np.arange(3)) % 3
        a, b, c = np.swapaxes(np.take_along_axis(self.corners, order[:, :, None], axis=1), 0, 1)
        halves = [np.stack([a, (a + b) / 2, c], axis=1), np.stack([(a + b) / 2, b, c], axis=1)]
        return Pieces(np.tile(self.parents, 2), np.concatenate(halves))


def quartered(corners: Floats) -> Floats:
    """Cut triangles with ``corners`` (k, 3, 3) into four; returns (4 k, 3, 3): all first parts, then all second parts, ..."""
    return np.asarray(np.einsum("qcj,kji->qkci", _QUARTERS, corners).reshape(-1, 3, 3))


def edge_lengths(corners: Floats) -> Floats:
    """Lengths (k, 3) [mm] of the edges of triangles with ``corners`` (k, 3, 3), from each corner to the next."""
    return np.asarray(np.linalg.norm(corners - np.roll(corners, -1, axis=1), axis=2))


def cut(surface: Surface, triangles: Ints, apart: float) -> Pieces:
    """Cut ``triangles`` (k,) into four, or two if thin, repeatedly, until no piece has a mean edge longer than ``apart`` [mm]."""
    corners, pieces = surface.points[surface.triangles], Pieces.whole(triangles)
    while (large := (lengths := edge_lengths(pieces.of(corners))).mean(axis=1) > apart).any():
        thin = large & (lengths.max(axis=1) ** 2 > _THIN * corner_areas(pieces.of(corners)))
        pieces = pieces[~large] + pieces[thin].halved(lengths[thin]) + pieces[large & ~thin].quartered()
    return pieces
