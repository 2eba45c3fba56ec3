"""Sections of a muscle where a field has a value, as triangles, each mapped to the unit square."""

from dataclasses import dataclass
from functools import cached_property

import igl
import numpy as np

from fem_reference.foundations.mesh import Floats, Ints, TetMesh, normals

# A point whose value is this close to the level counts as above it: no triangle may have two corners in one place.
_NUDGE = 1e-4
# The unit square's boundary, counter-clockwise from the middle of its side x = 1, by shares of its length.
_SHARES = (0, 1 / 8, 3 / 8, 5 / 8, 7 / 8, 1)
_SQUARE = ((1, 1, 0, 0, 1, 1), (0.5, 1, 1, 0, 0, 0.5))


@dataclass(frozen=True, eq=False)
class CrossSection:
    """Triangles (m, 3) between ``points`` (n, 3) [mm], in one piece without holes; ``normal`` (3,) is a unit vector."""

    points: Floats
    triangles: Ints
    normal: Floats

    @property
    def moments(self) -> tuple[Floats, Floats]:
        """The centre of area (3,) [mm] and the mean product (3, 3) [mm2] of the distances from it."""
        corners = self.points[self.triangles]
        areas = np.linalg.norm(normals(corners), axis=1) / 2
        centre = areas @ corners.mean(axis=1) / areas.sum()
        corners, sums = corners - centre, 3 * (corners.mean(axis=1) - centre)
        products = np.einsum("mki,mkj->mij", corners, corners) + sums[:, :, None] * sums[:, None, :]
        return centre, np.einsum("m,mij->ij", areas / 12, products) / areas.sum()

    @cached_property
    def rim(self) -> Ints:
        """The points (k,) of the boundary, counter-clockwise about the normal."""
        loop = np.asarray(igl.boundary_loop(self.triangles.astype(np.int64)))
        corners = self.points[loop] - self.points[loop].mean(axis=0)
        upward = np.cross(corners, np.roll(corners, -1, axis=0)).sum(axis=0) @ self.normal > 0
        return loop if upward else loop[::-1]

    def turns(self, first: Floats) -> Floats:
        """The place (k,) of each point of the rim around the unit square, in turns from the middle of its side x = 1;
        ``first`` (3,) is the direction of its first side.

        They are shares of length after a stretch that makes the section as wide as high, so that a rectangle is mapped linearly.
        """
        centre, product = self.moments
        axes = np.stack([first, np.cross(self.normal, first)])
        values, vectors = np.linalg.eigh(axes @ product @ axes.T)
        return _around((self.points[self.rim] - centre) @ axes.T @ (vectors / np.sqrt(values)) @ vectors.T)

    def square(self, turns: Floats) -> Floats:
        """The place (n, 2) in the unit square of each point, by a harmonic map; ``turns`` (k,) are those of the rim."""
        rim = np.stack([np.interp(turns, _SHARES, side) for side in _SQUARE], axis=1)
        return np.asarray(igl.harmonic(self.points, self.triangles.astype(np.int64), self.rim, rim, 1))


def _around(loop: Floats) -> Floats:
    """Shares (k,) of the length of a counter-clockwise ``loop`` (k, 2), from the farthest place where it meets the first axis."""
    ahead = np.roll(loop, -1, axis=0)
    lengths = np.linalg.norm(ahead - loop, axis=1)
    rises = np.flatnonzero((loop[:, 1] < 0) & (ahead[:, 1] >= 0))
    shares = loop[rises, 1] / (loop[rises, 1] - ahead[rises, 1])
    farthest = np.argmax(loop[rises, 0] + shares * (ahead[rises, 0] - loop[rises, 0]))
    along = np.concatenate([[0.0], np.cumsum(lengths)])
    begin = along[rises[farthest]] + shares[farthest] * lengths[rises[farthest]]
    return np.asarray(((along[:-1] - begin) / along[-1]) % 1)


def cross_section(mesh: TetMesh, values: Floats, level: float) -> CrossSection | None:
    """The greatest piece of the section of a ``mesh`` where ``values`` (n,) at its points are ``level``; None where that piece
    has holes or there is none. Its normal has the direction of increase.
    """
    above = values - level
    above = np.where(np.abs(above) < _NUDGE, _NUDGE, above)
    ends, rise = _cut(mesh, above)
    if len(ends) == 0:
        return None
    edges, triangles = np.unique(np.sort(ends.reshape(-1, 2), axis=1), axis=0, return_inverse=True)
    low, high = above[edges].T
    points = mesh.points[edges[:, 0]] + (low / (low - high))[:, None] * (
        mesh.points[edges[:, 1]] - mesh.points[edges[:, 0]]
    )
    triangles = triangles.reshape(-1, 3)
    turned = np.einsum("ij,ij->i", normals(points[triangles]), rise) < 0
    triangles[turned] = triangles[turned][:, ::-1]
    return _greatest(points, triangles)


def _cut(mesh: TetMesh, above: Floats) -> tuple[Ints, Floats]:
    """For each triangle that a section cuts from a tet the three cut edges (k, 3, 2), and a direction (k, 3) of increase."""
    order = np.take_along_axis(mesh.tets, np.argsort(above[mesh.tets], axis=1, kind="stable"), axis=1)
    below = (above[order] < 0).sum(axis=1)
    patterns = {
        1: [((0, 1), (0, 2), (0, 3))],
        2: [((0, 2), (0, 3), (1, 3)), ((0, 2), (1, 3), (1, 2))],
        3: [((0, 3), (1, 3), (2, 3))],
    }
    found = [(order[below == count], np.array(corners)) for count, some in patterns.items() for corners in some]
    ends = np.concatenate([tets[:, corners] for tets, corners in found])
    up = np.concatenate([mesh.points[tets[:, 3]] - mesh.points[tets[:, 0]] for tets, _ in found])
    return ends, up


def _greatest(points: Floats, triangles: Ints) -> CrossSection | None:
    """The piece of the greatest area, if it has one boundary only."""
    _, pieces = igl.facet_components(triangles.astype(np.int64))
    areas = np.bincount(pieces, weights=np.linalg.norm(normals(points[triangles]), axis=1))
    triangles = triangles[pieces == np.argmax(areas)]
    used, triangles = np.unique(triangles, return_inverse=True)
    triangles = triangles.reshape(-1, 3)
    sides = np.unique(np.sort(triangles[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1), axis=0)
    if len(used) - len(sides) + len(triangles) != 1:
        return None
    upward = normals(points[used][triangles]).sum(axis=0)
    return CrossSection(points[used], triangles, upward / np.linalg.norm(upward))
