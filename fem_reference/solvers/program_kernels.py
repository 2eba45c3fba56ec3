"""What the report's own program does otherwise than its text, compiled: folds are opened only, and bones are voxels.

All of it was read in the program's source. Arrays should be writable and C-contiguous: each other kind is compiled for anew.
"""

import math

import numpy as np
from numpy.typing import NDArray

from fem_reference.mesh import Floats, Ints
from fem_reference.solvers.compiled_kernels import compiled
from fem_reference.solvers.pbd_kernels import Vector, at, cross, dihedral, dot, minus, move, times

Bools = NDArray[np.bool_]

# Pairs of triangles whose normals have a greater cosine, either way, are left alone.
FLAT_COSINE = 1 - 1e-10
# A fold is corrected only by so many of its gradients.
SMALLEST_RATIO, GREATEST_RATIO = 0.1, 10.0
# The squares of the gradients of a fold count as at least this [1/mm2].
SMALLEST_WEIGHT = 1e-4
# What the program takes for the diagonal of a voxel, in voxels.
DIAGONAL = math.sqrt(3) + 1e-3


@compiled
def project_folds(points: Floats, hinges: Ints, rest: Floats, factor: float) -> None:
    """Open each of the ``hinges`` (h, 4) that is folded more sharply than its angle ``rest`` (h,) [rad], by Mueller 2007.

    With q the gradients of minus the cosine, the points go by ``ratio q``; what asks for too small or too great a ratio stays.
    """
    for h in range(len(hinges)):
        i, j, k, m = hinges[h, 0], hinges[h, 1], hinges[h, 2], hinges[h, 3]
        angle, g1, g2, g3, g4 = dihedral(at(points, i), at(points, j), at(points, k), at(points, m))
        if angle >= rest[h] or abs(math.cos(angle)) > FLAT_COSINE:
            continue
        sine = math.sin(angle)
        weight = sine * sine * (dot(g1, g1) + dot(g2, g2) + dot(g3, g3) + dot(g4, g4))
        ratio = factor * sine * (rest[h] - angle) / max(SMALLEST_WEIGHT, weight)
        if SMALLEST_RATIO <= ratio <= GREATEST_RATIO:
            move(points, i, ratio * sine, g1)
            move(points, j, ratio * sine, g2)
            move(points, k, ratio * sine, g3)
            move(points, m, ratio * sine, g4)


@compiled
def _unit_normal(a: Vector, b: Vector) -> Vector:
    """The unit vector along a x b; zero where there is none."""
    normal = cross(a, b)
    size = math.sqrt(dot(normal, normal))
    return times(1 / size, normal) if size > 1e-10 else (0.0, 0.0, 0.0)


@compiled
def _is_inside(inside: Bools, place: Vector) -> bool:
    """Whether a ``place``, in voxels, lies in one that is inside."""
    x, y, z = place
    count = len(inside)
    return 0 <= x < count and 0 <= y < count and 0 <= z < count and inside[int(x), int(y), int(z)]


@compiled
def _marks(a: Vector, b: Vector, c: Vector, normal: Vector, corner: Vector) -> bool:
    """Whether the triangle a, b, c, in voxels, marks the voxel whose lower corner is ``corner``.

    It does where its plane is near, and beyond none of its edges by more than a diagonal. The planes at the edges are taken
    with its ``normal`` in mm, though voxels are no cubes.
    """
    away = _unit_normal(minus(b, a), minus(c, a))
    if abs(dot(away, minus(corner, a))) > DIAGONAL / 2:
        return False
    beyond_ab = dot(_unit_normal(minus(b, a), normal), minus(corner, a))
    beyond_bc = dot(_unit_normal(minus(c, b), normal), minus(corner, b))
    beyond_ca = dot(_unit_normal(minus(a, c), normal), minus(corner, c))
    return max(beyond_ab, beyond_bc, beyond_ca) <= DIAGONAL


@compiled
def mark(border: Bools, points: Floats, places: Floats, triangles: Ints) -> None:
    """Set ``border`` (k, k, k) where one of the ``triangles`` (m, 3) marks it; ``points`` [mm] are at ``places`` in voxels."""
    count = len(border)
    for t in range(len(triangles)):
        i, j, k = triangles[t, 0], triangles[t, 1], triangles[t, 2]
        normal = _unit_normal(minus(at(points, j), at(points, i)), minus(at(points, k), at(points, i)))
        a, b, c = at(places, i), at(places, j), at(places, k)
        first = (int(min(a[0], b[0], c[0])), int(min(a[1], b[1], c[1])), int(min(a[2], b[2], c[2])))
        last = (max(a[0], b[0], c[0]), max(a[1], b[1], c[1]), max(a[2], b[2], c[2]))
        for x in range(first[0], min(count, math.ceil(last[0]) + 1)):
            for y in range(first[1], min(count, math.ceil(last[1]) + 1)):
                for z in range(first[2], min(count, math.ceil(last[2]) + 1)):
                    border[x, y, z] |= _marks(a, b, c, normal, (float(x), float(y), float(z)))


@compiled
def flood(border: Bools) -> Bools:
    """Which voxels (k, k, k) a flood from the corner (0, 0, 0) gets to, from face to face and not into the ``border``.

    It never goes back to an index of 0.
    """
    outside = np.zeros(border.shape, np.bool_)
    found = np.zeros((border.size, 3), np.int64)
    outside[0, 0, 0] = not border[0, 0, 0]
    known, seen = int(outside[0, 0, 0]), 0
    while seen < known:
        for side in range(6):
            axis, step = side // 2, 2 * (side % 2) - 1
            x = found[seen, 0] + step * (axis == 0)
            y = found[seen, 1] + step * (axis == 1)
            z = found[seen, 2] + step * (axis == 2)
            if 0 < found[seen, axis] + step < len(border) and not border[x, y, z] and not outside[x, y, z]:
                outside[x, y, z] = True
                found[known, 0], found[known, 1], found[known, 2] = x, y, z
                known += 1
        seen += 1
    return outside


@compiled
def are_inside(inside: Bools, places: Floats) -> Bools:
    """Which of ``places`` (n, 3), in voxels, lie in one that is inside."""
    found = np.empty(len(places), np.bool_)
    for i in range(len(places)):
        found[i] = _is_inside(inside, at(places, i))
    return found


@compiled
def march_out(inside: Bools, starts: Floats, goals: Floats) -> Floats:
    """Where those come to be that go from ``starts`` outside to ``goals`` inside; all (n, 3) in voxels.

    They go straight back, by steps of 1, until they are outside; who is not when it has come farther back than its start
    is put there.
    """
    reached = np.empty_like(goals)
    for i in range(len(goals)):
        place, start = at(goals, i), at(starts, i)
        way = minus(start, place)
        length = math.sqrt(dot(way, way))
        taken = 0
        while taken < length + 1 and _is_inside(inside, place):
            place = (place[0] + way[0] / length, place[1] + way[1] / length, place[2] + way[2] / length)
            taken += 1
        for axis in range(3):
            reached[i, axis] = start[axis] if taken > length + 1 else place[axis]
    return reached
