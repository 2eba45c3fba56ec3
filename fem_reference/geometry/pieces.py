"""Triangles of a surface cut into small pieces: sample places of about equal density, independent of the triangles' size."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fem_reference.foundations.mesh import Floats, Ints, Surface, corner_areas

# A triangle is thin if the square of its longest edge is more than so many times its area: for half a square the ratio is 4.
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


@dataclass(frozen=True, eq=False)
class Pieces:
    """Pieces of triangles: the ``parents`` (k,), their triangles, and their ``corners`` (k, 3, 3) in barycentric coordinates."""

    parents: Ints
    corners: Floats

    @classmethod
    def whole(cls, triangles: Ints) -> "Pieces":
        """Uncut, those with the numbers ``triangles`` (k,)."""
        return cls(triangles, np.broadcast_to(np.eye(3), (len(triangles), 3, 3)))

    def __getitem__(self, some: NDArray[np.bool_]) -> "Pieces":
        return Pieces(self.parents[some], self.corners[some])

    def __add__(self, others: "Pieces") -> "Pieces":
        parents, corners = ((self.parents, others.parents), (self.corners, others.corners))
        return Pieces(np.concatenate(parents), np.concatenate(corners))

    def of(self, values: Floats) -> Floats:
        """Values (k, 3, d) at the corners of the pieces of a field linear in triangles, with ``values`` (m, 3, d) at theirs."""
        return self.corners @ values[self.parents]

    def quartered(self) -> "Pieces":
        """Each cut in four at the middles of its edges."""
        return Pieces(np.tile(self.parents, 4), quartered(self.corners))

    def halved(self, lengths: Floats) -> "Pieces":
        """Each cut in two at the middle of its longest edge of ``lengths`` (k, 3), the first of which leaves corner 0."""
        order = (lengths.argmax(axis=1)[:, None] + np.arange(3)) % 3
        a, b, c = np.swapaxes(np.take_along_axis(self.corners, order[:, :, None], axis=1), 0, 1)
        halves = [np.stack([a, (a + b) / 2, c], axis=1), np.stack([(a + b) / 2, b, c], axis=1)]
        return Pieces(np.tile(self.parents, 2), np.concatenate(halves))


def quartered(corners: Floats) -> Floats:
    """Triangles with ``corners`` (k, 3, 3), each cut in four at the middles of its edges (4 k, 3, 3): part by part."""
    return np.asarray(np.einsum("qcj,kji->qkci", _QUARTERS, corners).reshape(-1, 3, 3))


def edge_lengths(corners: Floats) -> Floats:
    """Edge lengths (k, 3) [mm] of triangles with ``corners`` (k, 3, 3): of the edge that leaves each corner."""
    return np.asarray(np.linalg.norm(corners - np.roll(corners, -1, axis=1), axis=2))


def cut(surface: Surface, triangles: Ints, apart: float) -> Pieces:
    """The ``triangles`` (k,) of a ``surface``, cut in four, or in two if thin, until their mean edge is at most ``apart`` [mm]."""
    corners, pieces = surface.points[surface.triangles], Pieces.whole(triangles)
    while (large := (lengths := edge_lengths(pieces.of(corners))).mean(axis=1) > apart).any():
        thin = large & (lengths.max(axis=1) ** 2 > _THIN * corner_areas(pieces.of(corners)))
        pieces = pieces[~large] + pieces[thin].halved(lengths[thin]) + pieces[large & ~thin].quartered()
    return pieces
