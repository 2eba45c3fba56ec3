"""Meshes for scalar fields: intervals and triangles, in the plane or in space, with their sizes, boundary and refinement.

Shapes of arrays: points ``(n, d)`` with d from 1 to 3; cells ``(m, 2)`` of an interval (d = 1) or ``(m, 3)`` of triangles.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache

import numpy as np
import scipy

from fem_reference.foundations.errors import InputError
from fem_reference.foundations.mesh import Floats, Ints, read_only
from fem_reference.foundations.rows import distinct


@dataclass(frozen=True, eq=False)
class FieldMesh:
    """A mesh of straight ``cells`` between ``points``; ``place`` names the source of the mesh in messages."""

    points: Floats
    cells: Ints
    place: str = "mesh"

    def __post_init__(self) -> None:
        object.__setattr__(self, "points", read_only(self.points, np.float64))
        object.__setattr__(self, "cells", read_only(self.cells, np.int64))

    @property
    def edges(self) -> Ints:
        """All edges (e, 2), each once and with the smaller vertex first, sorted by their vertices."""
        return distinct(_all_edges(self.cells)).rows

    @property
    def facets(self) -> Ints:
        """Facets that belong to only one cell: the end vertices (f, 1) of an interval, or the rim edges (f, 2) of triangles."""
        parts = self.cells.reshape(-1, 1) if self.cells.shape[1] == 2 else _all_edges(self.cells)
        found = distinct(parts)
        return np.asarray(found.rows[found.counts == 1])

    def edge_numbers(self, pairs: Ints) -> Ints:
        """Index (k,) in ``edges`` of each pair of vertices in ``pairs`` (k, 2); each pair must be an edge."""
        key = np.array([len(self.points), 1])
        return np.asarray(np.searchsorted(self.edges @ key, np.sort(pairs, axis=1) @ key))

    @property
    def nodes(self) -> dict[int, Floats]:
        """Positions of the nodes of Lagrange elements of order 1 and 2: the vertices, followed for order 2 by edge midpoints."""
        middles = self.points[self.edges].mean(axis=1)
        return {1: self.points, 2: np.concatenate([self.points, middles])}

    @property
    def sizes(self) -> Floats:
        """Length or area (m,) of each cell."""
        corners = self.points[self.cells]
        sides = corners[:, 1:] - corners[:, :1]
        gram = np.einsum("mid,mjd->mij", sides, sides)
        return np.asarray(np.sqrt(np.maximum(np.linalg.det(gram), 0)) / (self.cells.shape[1] - 1))


POINTS = 5  # the number of quadrature points along each direction, which makes the rule exact up to degree 9
# The maximum magnitude of a coordinate, chosen so that areas and results computed from it are finite.
FURTHEST = 1e50


def check(mesh: FieldMesh) -> FieldMesh:
    """Return ``mesh``; InputError for wrong coordinates or indices, unused vertices, flat cells, or edges of 3 or more cells."""
    count = len(mesh.points)
    if not np.isfinite(mesh.points).all():
        raise InputError(mesh.place, "a coordinate that is not a finite number", "finite coordinates")
    if np.abs(mesh.points).max(initial=0.0) > FURTHEST:
        raise InputError(mesh.place, f"a coordinate beyond {FURTHEST:g}", "coordinates whose squares are finite")
    if mesh.cells.size == 0 or mesh.cells.min() < 0 or mesh.cells.max() >= count:
        raise InputError(mesh.place, f"a cell with a vertex outside 1 to {count}", "vertex numbers of the mesh")
    lonely = np.flatnonzero(np.bincount(mesh.cells.ravel(), minlength=count) == 0)
    if len(lonely):
        raise InputError(mesh.place, f"vertex {lonely[0] + 1} in no cell", "each vertex in a cell")
    extent = float(np.ptp(mesh.points, axis=0).max())
    flat = np.flatnonzero(mesh.sizes <= 1e-14 * extent ** (mesh.cells.shape[1] - 1))
    if len(flat):
        raise InputError(mesh.place, f"cell {flat[0] + 1} of size zero", "cells with a length or an area")
    if mesh.cells.shape[1] == 3:
        edges, _, _, sides = distinct(_all_edges(mesh.cells))
        if sides.max() > 2:
            a, b = edges[sides.argmax()] + 1
            raise InputError(mesh.place, f"{sides.max()} triangles on the edge of vertices {a} and {b}", "at most two")
    return mesh


def barycentric_gradients(mesh: FieldMesh) -> Floats:
    """Gradients (m, k, d) of the hat functions of the k vertices of each cell, tangential to the cell."""
    corners = mesh.points[mesh.cells]
    slopes = np.linalg.pinv(corners[:, 1:] - corners[:, :1]).transpose(0, 2, 1)
    return np.asarray(np.concatenate([-slopes.sum(axis=1, keepdims=True), slopes], axis=1))


def share_above(mesh: FieldMesh, level: float) -> Floats:
    """Fraction (m,) of each triangle's area in which y is above ``level``."""
    heights = np.sort(mesh.points[mesh.cells][:, :, 1] - level, axis=1)
    low, middle, high = heights.T
    # The level cuts off the corner that is alone on its side. The corner's fraction of the area is the product of the fractions cut
    # off its two edges.
    with np.errstate(divide="ignore", invalid="ignore"):
        top = np.where(high > 0, high**2 / ((high - low) * (high - middle)), 0.0)
        bottom = np.where(low < 0, low**2 / ((high - low) * (middle - low)), 0.0)
    share = np.where(middle <= 0, top, 1 - bottom)
    return np.asarray(np.where(low >= 0, np.where(high > 0, 1.0, 0.0), np.where(high <= 0, 0.0, share)))


def stabilisation(mesh: FieldMesh, diffusion: float, velocity: Floats, order: int) -> tuple[float, Floats]:
    """Return the maximum Peclet number of the cells, and their upwinding parameters ``tau = h / 2|v| (coth Pe - 1 / Pe)`` (m,).

    ``Pe = |v| h / 2k``, with the ``diffusion`` k and the part v of the ``velocity`` (d,) along the cell (Brooks and Hughes 1982,
    doi 10.1016/0045-7825(82)90071-8). The distance h between nodes along v is ``2|v| / sum |v . grad lambda|``, divided by the
    ``order`` of the elements (Tezduyar 1986). For constant coefficients on an interval, tau makes linear elements exact at nodes.
    """
    slopes = barycentric_gradients(mesh)
    rates = np.abs(slopes @ velocity).sum(axis=1) * order / 2  # |v| / h
    tangents = mesh.points[mesh.cells][:, 1:] - mesh.points[mesh.cells][:, :1]
    along = np.einsum("mid,mik,k->md", tangents, slopes[:, 1:], velocity)
    with np.errstate(divide="ignore", invalid="ignore"):
        peclet = np.where(rates > 0, (along**2).sum(axis=1) / (2 * diffusion * rates), 0.0)
        # Below 1e-3 the difference suffers from cancellation, so the first term of the series Pe / 3 - Pe^3 / 45 + ... is used.
        upwind = np.where(peclet > 1e-3, 1 / np.tanh(peclet) - 1 / peclet, peclet / 3)
        return float(peclet.max()), np.where(rates > 0, upwind / (2 * rates), 0.0)


def refined(mesh: FieldMesh) -> FieldMesh:
    """Cut intervals into two, or triangles into four, at edge midpoints. Vertex i keeps its index; vertex n + j halves edge j."""
    cells: list[tuple[Ints, ...]]
    if mesh.cells.shape[1] == 2:
        a, b, ab = nodes(mesh, 2).T
        cells = [(a, ab), (ab, b)]
    else:
        a, b, c, ab, bc, ca = nodes(mesh, 2).T
        cells = [(a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca)]
    return FieldMesh(mesh.nodes[2], np.concatenate([np.stack(cell, axis=1) for cell in cells]), mesh.place)


def _all_edges(cells: Ints) -> Ints:
    """Edges (m or 3 m, 2) of all cells, cell by cell, with the smaller vertex first."""
    pairs = cells[:, [[0, 1]]] if cells.shape[1] == 2 else cells[:, [[0, 1], [1, 2], [2, 0]]]
    return np.asarray(np.sort(pairs.reshape(-1, 2), axis=1))


def l2_distance(mesh: FieldMesh, values: Floats, exact: Callable[[Floats], Floats]) -> float:
    """L2 norm of the difference between a Lagrange function and an ``exact`` function, over a ``mesh`` in the plane or in space.

    ``values`` (N,): the Lagrange function at the nodes, which are the vertices, followed for order 2 by the midpoints of
    ``mesh.edges``. ``exact`` takes points (q, d) and returns values (q,).
    """
    order = 1 if len(values) == len(mesh.points) else 2
    barycentric, weights = rule(mesh.cells.shape[1])
    places = np.einsum("qk,mkd->mqd", barycentric, mesh.points[mesh.cells])
    found = values[nodes(mesh, order)] @ functions(barycentric, order).T
    wanted = exact(places.reshape(-1, places.shape[2])).reshape(found.shape)
    return float(np.sqrt(np.sum(mesh.sizes[:, None] * weights * (found - wanted) ** 2)))


@cache
def rule(corners: int) -> tuple[Floats, Floats]:
    """Return a quadrature rule for cells with k = 2 or 3 ``corners``: barycentric coordinates (q, k), and weights (q,) with sum 1.

    It is a Gauss-Legendre rule; in a triangle, its product with a Gauss-Jacobi rule along lines through a corner (Stroud 1971,
    Approximate Calculation of Multiple Integrals, 2.4).
    """
    x, w = scipy.special.roots_legendre(POINTS)
    along, weights = (1 + x) / 2, w / 2
    if corners == 2:
        return np.column_stack([1 - along, along]), weights
    x, w = scipy.special.roots_jacobi(POINTS, 1, 0)
    from_side, others = np.repeat((1 + x) / 2, POINTS), np.tile(along, POINTS)
    barycentric = np.column_stack([(1 - from_side) * (1 - others), (1 - from_side) * others, from_side])
    return barycentric, np.repeat(w / 2, POINTS) * np.tile(weights, POINTS)


def nodes(mesh: FieldMesh, order: int) -> Ints:
    """Nodes (m, k) of each cell: its corners, followed for order 2 by the midpoints of its edges, from each corner to the next."""
    if order == 1:
        return mesh.cells
    middles = mesh.edge_numbers(_all_edges(mesh.cells)).reshape(len(mesh.cells), -1)
    return np.concatenate([mesh.cells, len(mesh.points) + middles], axis=1)


def functions(barycentric: Floats, order: int) -> Floats:
    """Lagrange basis functions (q, k) at ``barycentric`` coordinates (q, 2 or 3), in the order of :func:`nodes`.

    Order 2: ``L_i (2 L_i - 1)`` at corners and ``4 L_i L_j`` at midpoints (Zienkiewicz and Taylor, The Finite Element Method, 8.8).
    """
    if order == 1:
        return barycentric
    after = np.roll(barycentric, -1, axis=1)
    between = (4 * barycentric * after)[:, : 1 if barycentric.shape[1] == 2 else 3]
    return np.concatenate([barycentric * (2 * barycentric - 1), between], axis=1)
