"""Quadrature rules for the energies in a cell."""

import basix
import numpy as np

from fem_reference.foundations.mesh import Floats
from fem_reference.problems.body import ELEMENTS

# By element: the degree up to which polynomials on a straight cell are integrated exactly.
DEGREE = {"P1": 2, "P1/P1": 2, "P2": 5, "P2/P0": 5, "P2/P1": 5, "Q1": 3, "Q2": 5, "Q1/P0": 3, "Q2/Q1": 5}

# Shares of the volume and barycentric coordinates of the orbits of a rule of degree 5 that includes the vertices.
_VERTEX_SHARE = 0.002
_ON_MEDIANS = ((0.11990832171874463, 0.3141518976943535), (0.09393542311163477, 0.10944719170192463))
_ON_BIMEDIANS = (0.02277083677974708, 0.010913290341505138)


def rule(element: str, degree: int | None) -> tuple[Floats, Floats]:
    """Points (q, 3) and weights (q,) on the reference cell of an element, of ``degree`` or, where it is None, of ``DEGREE``.

    On quadratic tetrahedra the default rule includes the vertices. There det F of a quadratic displacement is smallest in an
    inverting cell, and an energy that grows without bound as det F falls to zero keeps it positive where it is evaluated.
    Standard rules leave the vertices out.
    """
    kind, order, _ = ELEMENTS[element]
    if degree is None and kind == "tetrahedron" and order == 2:
        return with_vertices()
    points, weights = basix.make_quadrature(basix.CellType[kind], degree or DEGREE[element])
    return np.asarray(points), np.asarray(weights)


def with_vertices() -> tuple[Floats, Floats]:
    """18 points on the unit tetrahedron, exact to degree 5: vertices, twice 4 on the medians and 6 on the bimedians.

    Its shares and coordinates solve the seven moment equations of degrees 0, 2, 3, 4, 4, 5 and 5 for the given share of a vertex;
    without it they are those of Walkington 2000, Quadrature on simplices of arbitrary dimension.
    """
    points, weights = [np.eye(4, 3, -1)], [np.full(4, _VERTEX_SHARE)]
    for share, a in _ON_MEDIANS:
        points.append(np.array([[a, a, a], [a, a, 1 - 3 * a], [a, 1 - 3 * a, a], [1 - 3 * a, a, a]]))
        weights.append(np.full(4, share))
    share, b = _ON_BIMEDIANS
    c = 0.5 - b
    points.append(np.array([[b, b, c], [b, c, b], [c, b, b], [c, c, b], [c, b, c], [b, c, c]]))
    weights.append(np.full(6, share))
    return np.concatenate(points), np.concatenate(weights) / 6
