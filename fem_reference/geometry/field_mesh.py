"""Meshes of scalar fields: intervals and triangles, in the plane or in space; their sizes, boundary and refinement.

Vocabulary of shapes: points ``(n, d)`` with d from 1 to 3, cells ``(m, 2)`` of an interval (d = 1) or ``(m, 3)`` of triangles.
"""

from dataclasses import dataclass

import numpy as np

from fem_reference.foundations.errors import InputError
from fem_reference.foundations.mesh import Floats, Ints, read_only


@dataclass(frozen=True, eq=False)
class FieldMesh:
    """Straight ``cells`` between ``points``; ``place`` is their source, for messages."""

    points: Floats
    cells: Ints
    place: str = "mesh"

    def __post_init__(self) -> None:
        object.__setattr__(self, "points", read_only(self.points, np.float64))
        object.__setattr__(self, "cells", read_only(self.cells, np.int64))

    @property
    def edges(self) -> Ints:
        """Every edge once (e, 2), the smaller vertex first, in the order of their vertices."""
        return np.asarray(np.unique(_all_edges(self.cells), axis=0))

    @property
    def facets(self) -> Ints:
        """The facets that belong to one cell only: vertices (f, 1) of an interval's ends, edges (f, 2) of a rim."""
        parts = self.cells.reshape(-1, 1) if self.cells.shape[1] == 2 else _all_edges(self.cells)
        unique, sides = np.unique(parts, axis=0, return_counts=True)
        return np.asarray(unique[sides == 1])

    def edge_numbers(self, pairs: Ints) -> Ints:
        """The number (k,) among ``edges`` of each of ``pairs`` (k, 2) of vertices; all must be edges."""
        key = np.array([len(self.points), 1])
        return np.asarray(np.searchsorted(self.edges @ key, np.sort(pairs, axis=1) @ key))

    @property
    def nodes(self) -> dict[int, Floats]:
        """The places of the nodes of Lagrange elements of order 1 and 2: the vertices, then the middles of the edges."""
        middles = self.points[self.edges].mean(axis=1)
        return {1: self.points, 2: np.concatenate([self.points, middles])}

    @property
    def sizes(self) -> Floats:
        """Length or area of each cell (m,)."""
        corners = self.points[self.cells]
        sides = corners[:, 1:] - corners[:, :1]
        gram = np.einsum("mid,mjd->mij", sides, sides)
        return np.asarray(np.sqrt(np.maximum(np.linalg.det(gram), 0)) / (self.cells.shape[1] - 1))


# No coordinate is larger, so that areas and results computed from them are finite.
FURTHEST = 1e50


def check(mesh: FieldMesh) -> FieldMesh:
    """``mesh`` itself; InputError where a number is not finite, a vertex index is invalid, a vertex is in no cell, a cell is
    flat, or three triangles share an edge.
    """
    count = len(mesh.points)
    if not np.isfinite(mesh.points).all():
        raise InputError(mesh.place, "a coordinate that is no finite number", "finite coordinates")
    if np.abs(mesh.points).max(initial=0.0) > FURTHEST:
        raise InputError(mesh.place, f"a coordinate beyond {FURTHEST:g}", "coordinates whose squares are numbers")
    if mesh.cells.size == 0 or mesh.cells.min() < 0 or mesh.cells.max() >= count:
        raise InputError(mesh.place, f"a cell with a vertex outside of 1 to {count}", "vertices of its points")
    lonely = np.flatnonzero(np.bincount(mesh.cells.ravel(), minlength=count) == 0)
    if len(lonely):
        raise InputError(mesh.place, f"vertex {lonely[0] + 1} in no cell", "every vertex in a cell")
    extent = float(np.ptp(mesh.points, axis=0).max())
    flat = np.flatnonzero(mesh.sizes <= 1e-14 * extent ** (mesh.cells.shape[1] - 1))
    if len(flat):
        raise InputError(mesh.place, f"cell {flat[0] + 1} without extent", "cells with a length or an area")
    if mesh.cells.shape[1] == 3:
        edges, sides = np.unique(_all_edges(mesh.cells), axis=0, return_counts=True)
        if sides.max() > 2:
            a, b = edges[sides.argmax()] + 1
            raise InputError(mesh.place, f"{sides.max()} triangles on the edge of vertices {a} and {b}", "at most two")
    return mesh


def barycentric_gradients(mesh: FieldMesh) -> Floats:
    """The gradients (m, k, d) of the hat functions of each cell's k vertices, tangential to the cell."""
    corners = mesh.points[mesh.cells]
    slopes = np.linalg.pinv(corners[:, 1:] - corners[:, :1]).transpose(0, 2, 1)
    return np.asarray(np.concatenate([-slopes.sum(axis=1, keepdims=True), slopes], axis=1))


def share_above(mesh: FieldMesh, level: float) -> Floats:
    """The share (m,) of each triangle's area with y above ``level``."""
    heights = np.sort(mesh.points[mesh.cells][:, :, 1] - level, axis=1)
    low, middle, high = heights.T
    # The corner that is alone on its side cuts off a triangle similar in two directions.
    with np.errstate(divide="ignore", invalid="ignore"):
        top = np.where(high > 0, high**2 / ((high - low) * (high - middle)), 0.0)
        bottom = np.where(low < 0, low**2 / ((high - low) * (middle - low)), 0.0)
    share = np.where(middle <= 0, top, 1 - bottom)
    return np.asarray(np.where(low >= 0, np.where(high > 0, 1.0, 0.0), np.where(high <= 0, 0.0, share)))


def stabilisation(mesh: FieldMesh, diffusion: float, velocity: Floats, order: int) -> tuple[float, Floats]:
    """The greatest Peclet number of all cells and, of each (m,), the parameter ``tau = h / 2|v| (coth Pe - 1 / Pe)`` of upwinding.

    ``Pe = |v| h / 2k``, with ``diffusion`` k, v the part of the ``velocity`` (d,) along the cell and h the distance of nodes along
    it, ``2|v| / sum |v . grad lambda|`` over the ``order`` of the elements (Brooks and Hughes 1982, doi
    10.1016/0045-7825(82)90071-8; h after Tezduyar 1986). On an interval it makes linear elements exact at their nodes for constant
    coefficients.
    """
    slopes = barycentric_gradients(mesh)
    rates = np.abs(slopes @ velocity).sum(axis=1) * order / 2  # |v| / h
    tangents = mesh.points[mesh.cells][:, 1:] - mesh.points[mesh.cells][:, :1]
    along = np.einsum("mid,mik,k->md", tangents, slopes[:, 1:], velocity)
    with np.errstate(divide="ignore", invalid="ignore"):
        peclet = np.where(rates > 0, (along**2).sum(axis=1) / (2 * diffusion * rates), 0.0)
        # Below 1e-3 the difference loses its digits; its series is Pe / 3 - Pe^3 / 45 + ...
        upwind = np.where(peclet > 1e-3, 1 / np.tanh(peclet) - 1 / peclet, peclet / 3)
        return float(peclet.max()), np.where(rates > 0, upwind / (2 * rates), 0.0)


def refined(mesh: FieldMesh) -> FieldMesh:
    """Every interval cut in two, every triangle in four, at the middles of the edges; vertex i stays vertex i, edge j becomes
    vertex n + j.
    """
    count, edges = len(mesh.points), mesh.edges
    points = np.concatenate([mesh.points, mesh.points[edges].mean(axis=1)])
    middle = count + mesh.edge_numbers(_all_edges(mesh.cells)).reshape(len(mesh.cells), -1)
    cells: list[tuple[Ints, ...]]
    if mesh.cells.shape[1] == 2:
        (a, b), (ab,) = mesh.cells.T, middle.T
        cells = [(a, ab), (ab, b)]
    else:
        (a, b, c), (ab, bc, ca) = mesh.cells.T, middle.T
        cells = [(a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca)]
    return FieldMesh(points, np.concatenate([np.stack(cell, axis=1) for cell in cells]), mesh.place)


def _all_edges(cells: Ints) -> Ints:
    """The edges of every cell, cell by cell, (m or 3 m, 2), the smaller vertex first."""
    pairs = cells[:, [[0, 1]]] if cells.shape[1] == 2 else cells[:, [[0, 1], [1, 2], [2, 0]]]
    return np.asarray(np.sort(pairs.reshape(-1, 2), axis=1))
