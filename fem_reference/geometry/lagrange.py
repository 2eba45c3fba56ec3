"""Lagrange functions and Gauss rules on intervals and triangles, for integrals over a field."""

from collections.abc import Callable
from functools import cache

import numpy as np
from scipy.special import roots_jacobi, roots_legendre

from fem_reference.foundations.mesh import Floats, Ints
from fem_reference.geometry.field_mesh import FieldMesh

POINTS = 5  # of the rules along each direction: exact up to degree 9


def l2_distance(mesh: FieldMesh, values: Floats, exact: Callable[[Floats], Floats]) -> float:
    """The L2 norm over a ``mesh`` of intervals or triangles, in the plane or in space, of a Lagrange function minus an ``exact``
    one, which gives values (q,) at points (q, d). The function has ``values`` (N,) at the nodes: the vertices, then for order 2
    the middles of ``mesh.edges``.
    """
    order = 1 if len(values) == len(mesh.points) else 2
    barycentric, weights = rule(mesh.cells.shape[1])
    places = np.einsum("qk,mkd->mqd", barycentric, mesh.points[mesh.cells])
    found = values[nodes(mesh, order)] @ functions(barycentric, order).T
    wanted = exact(places.reshape(-1, places.shape[2])).reshape(found.shape)
    return float(np.sqrt(np.sum(mesh.sizes[:, None] * weights * (found - wanted) ** 2)))


@cache
def rule(corners: int) -> tuple[Floats, Floats]:
    """Barycentric coordinates (q, k) of the points of a rule for cells of k ``corners``, 2 or 3, and their weights (q,), which sum
    to 1: Gauss-Legendre, in a triangle times Gauss-Jacobi along lines through a corner (Stroud 1971, Approximate Calculation of
    Multiple Integrals, 2.4).
    """
    x, w = roots_legendre(POINTS)
    along, weights = (1 + x) / 2, w / 2
    if corners == 2:
        return np.column_stack([1 - along, along]), weights
    x, w = roots_jacobi(POINTS, 1, 0)
    from_side, others = np.repeat((1 + x) / 2, POINTS), np.tile(along, POINTS)
    barycentric = np.column_stack([(1 - from_side) * (1 - others), (1 - from_side) * others, from_side])
    return barycentric, np.repeat(w / 2, POINTS) * np.tile(weights, POINTS)


def nodes(mesh: FieldMesh, order: int) -> Ints:
    """The nodes (m, k) of each cell: its corners, then for order 2 the middles of its edges, from each corner to the next."""
    if order == 1:
        return mesh.cells
    count = mesh.cells.shape[1]
    pairs = [[0, 1]] if count == 2 else [[0, 1], [1, 2], [2, 0]]
    middles = mesh.edge_numbers(mesh.cells[:, pairs].reshape(-1, 2)).reshape(len(mesh.cells), -1)
    return np.concatenate([mesh.cells, len(mesh.points) + middles], axis=1)


def functions(barycentric: Floats, order: int) -> Floats:
    """The Lagrange functions (q, k) at ``barycentric`` coordinates (q, 2 or 3), in the order of :func:`nodes`: ``L_i``, or
    ``L_i (2 L_i - 1)`` at corners and ``4 L_i L_j`` between two (Zienkiewicz and Taylor
    2000, The Finite Element Method, vol. 1, 8.8).
    """
    if order == 1:
        return barycentric
    after = np.roll(barycentric, -1, axis=1)
    between = (4 * barycentric * after)[:, : 1 if barycentric.shape[1] == 2 else 3]
    return np.concatenate([barycentric * (2 * barycentric - 1), between], axis=1)
