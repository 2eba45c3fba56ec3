"""Compiled functions for as-rigid-as-possible deformation: local step, right-hand side and energy. Report eq. 5.10 and 5.11.

The arguments ``points`` (n, 3) [mm] and ``rotations`` (n, 3, 3) should be writable and C-contiguous arrays.
"""

import math
from typing import NamedTuple

import numpy as np

from fem_reference.foundations.mesh import Floats, Ints
from fem_reference.solvers.compiled_kernels import compiled

# The maximum number of Jacobi sweeps over a symmetric 4 x 4 matrix. Convergence is quadratic: about five make it diagonal.
_SWEEPS = 30
_ROUNDING = 1e-17


class VertexCells(NamedTuple):
    """The cells of a surface: for each vertex, the edges to its neighbours.

    ``rest`` (n, 3) [mm]: the vertices at rest. The edges from vertex i lead to ``neighbours[starts[i]:starts[i + 1]]``, and
    ``weights`` has their weights in the same order; an edge may have different weights at its two ends. ``starts`` (n + 1,),
    ``neighbours`` and ``weights`` (e,).
    """

    rest: Floats
    starts: Ints
    neighbours: Ints
    weights: Floats


@compiled
def _turn(matrix: Floats, vectors: Floats, p: int, q: int) -> None:
    """Rotate rows and columns p, q of a symmetric ``matrix`` (4, 4), so that its entry [p, q] becomes 0.

    The columns p, q of ``vectors`` (4, 4) are rotated in the same way.
    """
    slope = 0.5 * (matrix[q, q] - matrix[p, p]) / matrix[p, q]
    tangent = math.copysign(1.0, slope) / (abs(slope) + math.sqrt(slope * slope + 1))
    c = 1 / math.sqrt(tangent * tangent + 1)
    s = tangent * c
    for k in range(4):
        matrix[k, p], matrix[k, q] = c * matrix[k, p] - s * matrix[k, q], s * matrix[k, p] + c * matrix[k, q]
    for k in range(4):
        matrix[p, k], matrix[q, k] = c * matrix[p, k] - s * matrix[q, k], s * matrix[p, k] + c * matrix[q, k]
    for k in range(4):
        vectors[k, p], vectors[k, q] = c * vectors[k, p] - s * vectors[k, q], s * vectors[k, p] + c * vectors[k, q]
    matrix[p, q] = matrix[q, p] = 0.0


@compiled
def _diagonalise(matrix: Floats, vectors: Floats) -> None:
    """Diagonalise a symmetric ``matrix`` (4, 4) in place by Jacobi rotations; the columns of ``vectors`` become eigenvectors."""
    vectors[:] = 0.0
    for k in range(4):
        vectors[k, k] = 1.0
    for _ in range(_SWEEPS):
        turns = 0
        for p in range(3):
            for q in range(p + 1, 4):
                if abs(matrix[p, q]) > _ROUNDING * (abs(matrix[p, p]) + abs(matrix[q, q])):
                    _turn(matrix, vectors, p, q)
                    turns += 1
        if turns == 0:
            break


@compiled
def _rotate(covariance: Floats, matrix: Floats, vectors: Floats, rotation: Floats) -> None:
    """Compute the ``rotation`` R (3, 3), with det R = 1, that maximises sum_ab R_ab C_ba for the ``covariance`` C (3, 3).

    The quaternion of R is the eigenvector for the largest eigenvalue of a 4 x 4 matrix that is formed from C (Horn 1987,
    doi:10.1364/JOSAA.4.000629). The report's singular value decomposition gives the same rotation, except in cells that are flat or
    inside out, where it gives a reflection. ``matrix`` and ``vectors`` (4, 4) are work arrays.
    """
    C = covariance
    matrix[0, 0] = C[0, 0] + C[1, 1] + C[2, 2]
    for a in range(3):
        b, c = (a + 1) % 3, (a + 2) % 3
        matrix[0, a + 1] = matrix[a + 1, 0] = C[b, c] - C[c, b]
        matrix[a + 1, a + 1] = C[a, a] - C[b, b] - C[c, c]
        matrix[b + 1, c + 1] = matrix[c + 1, b + 1] = C[b, c] + C[c, b]
    _diagonalise(matrix, vectors)
    best = 0
    for k in range(1, 4):
        if matrix[k, k] > matrix[best, best]:
            best = k
    w, x, y, z = vectors[0, best], vectors[1, best], vectors[2, best], vectors[3, best]
    rotation[0, 0], rotation[0, 1], rotation[0, 2] = 1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)
    rotation[1, 0], rotation[1, 1], rotation[1, 2] = 2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)
    rotation[2, 0], rotation[2, 1], rotation[2, 2] = 2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)


@compiled
def fit_rotations(points: Floats, cells: VertexCells) -> Floats:
    """The rotations (n, 3, 3) that map the edges of each cell at rest to the edges between ``points``, fitted by least squares.

    The covariance is ``C = sum_j w_ij (p_i - p_j) (p'_i - p'_j)^T``, in which edges start at the vertex i, as in Sorkine and
    Alexa 2007. With edges from the centroid of the cell, as in the report's text, the fit would not minimise eq. 5.10.
    """
    rotations = np.empty((len(points), 3, 3))
    covariance, matrix, vectors = np.empty((3, 3)), np.empty((4, 4)), np.empty((4, 4))
    for i in range(len(points)):
        covariance[:] = 0
        for at in range(cells.starts[i], cells.starts[i + 1]):
            j = cells.neighbours[at]
            for a in range(3):
                edge = cells.weights[at] * (cells.rest[i, a] - cells.rest[j, a])
                for b in range(3):
                    covariance[a, b] += edge * (points[i, b] - points[j, b])
        _rotate(covariance, matrix, vectors, rotations[i])
    return rotations


@compiled
def right_side(rotations: Floats, cells: VertexCells) -> Floats:
    """The right-hand side ``b_i = sum_j w_ij / 2 (R_i + R_j) (p_i - p_j)`` (n, 3) [mm] of eq. 5.11."""
    found = np.zeros_like(cells.rest)
    for i in range(len(cells.rest)):
        for at in range(cells.starts[i], cells.starts[i + 1]):
            j = cells.neighbours[at]
            for b in range(3):
                edge = 0.5 * cells.weights[at] * (cells.rest[i, b] - cells.rest[j, b])
                for a in range(3):
                    found[i, a] += edge * (rotations[i, a, b] + rotations[j, a, b])
    return found


@compiled
def energy(points: Floats, rotations: Floats, cells: VertexCells) -> float:
    """The energy ``sum_i sum_j w_ij |(p'_i - p'_j) - R_i (p_i - p_j)|^2`` [mm2].

    This is eq. 5.10 with squared norms, as in Sorkine and Alexa 2007.
    """
    found = 0.0
    for i in range(len(cells.rest)):
        for at in range(cells.starts[i], cells.starts[i + 1]):
            j = cells.neighbours[at]
            for a in range(3):
                off = points[i, a] - points[j, a]
                for b in range(3):
                    off -= rotations[i, a, b] * (cells.rest[i, b] - cells.rest[j, b])
                found += cells.weights[at] * off * off
    return found
