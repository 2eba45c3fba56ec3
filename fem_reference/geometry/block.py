"""Grids of boxes, each cut into the six Kuhn tetrahedra along the same diagonals, so that refined grids are nested.

Each cell and each of its faces is cut along the diagonal from its lowest to its highest corner.
"""

from itertools import permutations

import numpy as np

from fem_reference.foundations.errors import InputError
from fem_reference.foundations.mesh import Floats, Ints, Surface, TetMesh, enclosed_volume, place_of
from fem_reference.foundations.rows import distinct
from fem_reference.geometry.tetrahedra import check_size

Counts = tuple[int, int, int]

_SAME = 1e-6  # tolerance relative to the longest edge of the box, for rounding errors of single-precision coordinates


def fill(surface: Surface, size: float) -> TetMesh:
    """Fill the axis-aligned box bounded by the closed outward ``surface`` with a grid of boxes with edges of about ``size`` [mm].

    Raises InputError if ``surface`` does not bound such a box, or if ``size`` is far too small or too large.
    """
    low, high = _extent(surface)
    check_size(surface, size)
    x, y, z = (max(1, round(float(length) / size)) for length in high - low)
    lattice, tets = kuhn((x, y, z))
    return TetMesh(low + (high - low) * lattice / [x, y, z], tets, maker="block")


def kuhn(counts: Counts) -> tuple[Ints, Ints]:
    """Return the nodes (n, 3) of a lattice of ``counts`` cells along x, y and z (z varies fastest), and the tets (k, 4)."""
    nodes = np.indices((counts[0] + 1, counts[1] + 1, counts[2] + 1)).reshape(3, -1).T
    strides = np.array([(counts[1] + 1) * (counts[2] + 1), counts[2] + 1, 1])
    lowest = np.indices(counts).reshape(3, -1).T @ strides
    tets = []
    for order in permutations(range(3)):
        path = np.cumsum([0, *strides[list(order)]])
        upright = np.linalg.det(np.eye(3)[list(order)]) > 0
        tets.append(lowest[:, None] + (path if upright else path[[0, 2, 1, 3]]))
    return nodes, np.stack(tets, axis=1).reshape(-1, 4)


def lattice_skin(counts: Counts) -> tuple[Ints, Ints]:
    """Return the nodes (n, 3) on the surface of a lattice of ``counts`` cells, and the surface's outward triangles (m, 3)."""
    sheets = [_sheet(counts, axis, end) for axis in range(3) for end in (0, 1)]
    corners = np.concatenate(sheets).reshape(-1, 3)
    found = distinct(corners)
    return found.rows, found.which.reshape(-1, 3)


def _sheet(counts: Counts, axis: int, end: int) -> Ints:
    """Corners (m, 3, 3) of the outward triangles on the face of a lattice at the low (0) or high (1) ``end`` of an ``axis``."""
    one, other = (axis + 1) % 3, (axis + 2) % 3
    lowest = np.zeros((counts[one] * counts[other], 3), np.int64)
    lowest[:, [one, other]] = np.indices((counts[one], counts[other])).reshape(2, -1).T
    lowest[:, axis] = end * counts[axis]
    first, second = np.eye(3, dtype=np.int64)[[one, other]]
    halves = np.array([[0 * first, first, first + second], [0 * first, first + second, second]])
    return np.asarray((lowest[:, None, None] + (halves if end else halves[:, ::-1])).reshape(-1, 3, 3))


def _extent(surface: Surface) -> tuple[Floats, Floats]:
    """Return the lowest and the highest corner (3,) of the axis-aligned box bounded by ``surface``; InputError if there is none."""
    low, high = surface.points.min(axis=0), surface.points.max(axis=0)
    near = _SAME * float((high - low).max())
    corners = surface.points[surface.triangles]
    in_a_face = (np.abs(corners - low) <= near).all(axis=1) | (np.abs(corners - high) <= near).all(axis=1)
    inside = np.flatnonzero(~in_a_face.any(axis=1))
    want = 'the surface of an axis-aligned box, or muscle.mesher = "quality"'
    if len(inside):
        first = place_of(corners[inside[0]].mean(axis=0))
        got = f"{len(inside)} triangles outside the faces of the bounding box, the first at {first}"
        raise InputError(surface.place, got, want)
    volume, wanted = enclosed_volume(surface.points, surface.triangles), float(np.prod(high - low))
    if not abs(volume - wanted) <= wanted / 2:
        raise InputError(surface.place, f"an enclosed volume of {volume:.6g} mm3 in a box of {wanted:.6g} mm3", want)
    return low, high
