"""The part of a surface that is exempt from contact: attached parts, and parts near them on the same side."""

from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array

from fem_reference.foundations.mesh import Floats, Ints, Surface, TetMesh, corner_areas, unit_normals
from fem_reference.geometry.distance import distances
from fem_reference.geometry.skins import Pieces, Skin, cut, embedded, points, spacing

# A part that faces more than 120 degrees away from an attached part is on the other side of a thin body.
_SAME_SIDE = -0.5
# Corners are sampled at this fraction of the way to the middle of their piece, so that a point on an edge belongs to one side.
_INWARD = 1e-3


class Corners(NamedTuple):
    """The distinct corners (k,) of the pieces of a surface. The matrix ``carried`` (k, n) maps positions of vertices to positions
    of corners; ``away`` (k,) [mm] is the distance from the attached part, 0 on it, and ``by`` (k,) the index of its attachment.
    ``at`` (p, 3) are the corners of each piece, and ``vertices`` (n,) the corner at each vertex.
    """

    carried: csr_array
    away: Floats
    by: Ints
    at: Ints
    vertices: Ints


@dataclass(frozen=True, eq=False)
class Exemption:
    """The part of a ``surface`` that is exempt from contact: the triangles of the attached ``part`` (r, 3, 3), and the surface
    within ``reach`` [mm] of them on the same side. ``by`` (r,): the index of each triangle's attachment; ``names``: their bones.

    The reach is the ``spacing`` of the contact points: the area of a point closer to the attached part would include attached
    area. The reach depends on the size of the surface and not on its triangles.
    """

    surface: Surface
    part: Floats
    by: Ints
    names: tuple[str, ...]
    reach: float

    @classmethod
    def of(cls, surface: Surface, attached: Iterable[tuple[str, Floats]] = ()) -> "Exemption":
        """The exemption of a surface. ``attached``: for each attachment, the name of the bone and, for each corner of the triangles
        (m, 3), 1 if attached and 0 if not. The attached part is where their linear interpolation is at least 1/2.
        """
        names, shares = zip(*attached, strict=True) if (attached := tuple(attached)) else ((), ())
        quarters = Pieces.whole(np.arange(len(surface.triangles))).quartered()
        corners = quarters.of(surface.points[surface.triangles])
        some = [np.flatnonzero((quarters.of(one[:, :, None])[:, :, 0] >= 1 / 2).all(axis=1)) for one in shares]
        by = np.repeat(np.arange(len(some)), [len(one) for one in some])
        return cls(surface, corners[np.concatenate([np.zeros(0, np.int64), *some])], by, names, spacing(surface))

    def away(self, triangles: Ints, points: Floats) -> tuple[Floats, Ints]:
        """Distances (k,) [mm] of ``points`` (k, 3) of the ``triangles`` (k,) from the attached part, infinite if the part faces
        away, and the index (k,) of its attachment.
        """
        if len(self.part) == 0:
            return np.full(len(points), np.inf), np.full(len(points), -1)
        part = Surface(self.part.reshape(-1, 3), np.arange(3 * len(self.part)).reshape(-1, 3))
        nearest = distances(points, part)
        own = unit_normals(self.surface.points[self.surface.triangles])[triangles]
        facing = np.einsum("ki,ki->k", own, unit_normals(self.part)[nearest.triangle])
        return np.where(facing > _SAME_SIDE, nearest.distance, np.inf), self.by[nearest.triangle]

    @cached_property
    def pieces(self) -> Pieces:
        """The entire surface, cut into pieces of the spacing of contact points."""
        return cut(self.surface, np.arange(len(self.surface.triangles)), self.reach)

    @cached_property
    def corners(self) -> Corners:
        """The corners of the pieces, each with its least distance from the attached part over all pieces."""
        triangles, pieces, count = self.surface.triangles, self.pieces, len(self.surface.points)
        weights = pieces.corners.reshape(-1, 3)
        named = np.where(weights > 0, np.repeat(triangles[pieces.parents], 3, axis=0), count)
        order = np.argsort(named, axis=1)
        rows = np.take_along_axis(named, order, axis=1), np.take_along_axis(weights, order, axis=1)
        different, at = _distinct(np.hstack(rows))
        names, shares = different[:, :3].astype(np.int64), different[:, 3:]
        row, column = np.nonzero(names < count)
        carried = csr_array((shares[row, column], (row, names[row, column])), shape=(len(different), count))
        inward = self._places + _INWARD * (self._places.mean(axis=1, keepdims=True) - self._places)
        away, by = self.away(np.repeat(self.pieces.parents, 3), inward.reshape(-1, 3))
        away = np.where(away > _INWARD / 10 * self.reach, away, 0.0)  # 0 on the attached part
        nearest = np.lexsort((away, at))
        nearest = nearest[np.unique(at[nearest], return_index=True)[1]]
        single = np.flatnonzero(names[:, 1] == count)
        vertices = single[np.argsort(names[single, 0])]
        return Corners(carried, away[nearest], by[nearest], at.reshape(-1, 3), vertices)

    @property
    def vertices(self) -> NDArray[np.bool_]:
        """Mask (n,) of the vertices that are exempt in any triangle around them."""
        return np.asarray(self.corners.away[self.corners.vertices] <= self.reach)

    @cached_property
    def felt(self) -> NDArray[np.bool_]:
        """Mask (p,) of the pieces whose middle can be in contact."""
        return np.asarray(self.away(self.pieces.parents, self._places.mean(axis=1))[0] > self.reach)

    def places(self, count: int) -> csr_array:
        """A matrix from positions of vertices to those of about ``count`` evenly chosen points that can be in contact."""
        felt = np.flatnonzero(self.corners.away > self.reach)
        return self.corners.carried[felt[:: max(1, len(felt) // count)]]

    @cached_property
    def lost(self) -> float:
        """The fraction of the unattached surface that is exempt from contact; 1 if all is attached."""
        areas = corner_areas(self._places)
        loose = areas.sum() - corner_areas(self.part).sum()
        return float(1 - areas[self.felt].sum() / loose) if loose > 0 else 1.0

    @cached_property
    def _places(self) -> Floats:
        """The corners (p, 3, 3) of the pieces at rest."""
        return self.pieces.of(self.surface.points[self.surface.triangles])


def _distinct(rows: Floats) -> tuple[Floats, Ints]:
    """The distinct ``rows`` (k, d), sorted, and the index (n,) of each row among them: seven times as fast as ``np.unique``."""
    order = np.lexsort(rows.T[::-1])
    first = np.append(True, (np.diff(rows[order], axis=0) != 0).any(axis=1))
    number = np.empty(len(rows), np.int64)
    number[order] = np.cumsum(first) - 1
    return rows[order][first], number


def free_skin(exempt: Exemption, mesh: TetMesh, apart: float) -> Skin:
    """The material points in a ``mesh`` that can be in contact (not ``exempt``), on average at most ``apart`` [mm] apart."""
    surface = exempt.surface
    pieces = cut(surface, np.arange(len(surface.triangles)), apart)
    places, areas = points(pieces.of(surface.points[surface.triangles]), np.ones(pieces.corners.shape[:2]))
    felt = exempt.away(np.repeat(pieces.parents, 3), places)[0] > exempt.reach
    return embedded(places[felt], areas[felt], mesh)
