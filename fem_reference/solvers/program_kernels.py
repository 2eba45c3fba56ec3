"""Compiled functions of the report's program for position based dynamics, with the same order of summation.

The code follows the source of the program. The result is chaotic, so the last digit matters: terms are summed in the order found in
the machine code from gcc 12 with the flags in the program's CMakeLists.txt (-Ofast, which leaves the order to the compiler; no
vectors wider than SSE2). Do not simplify the sums. Functions are compiled again for arrays that are not writable and C-contiguous.
"""

import math

import numpy as np

from fem_reference.foundations.mesh import Bools, Floats, Ints
from fem_reference.solvers.compiled_kernels import compiled
from fem_reference.solvers.pbd_kernels import Vector, at, cross, dot, minus, move, times

# A pair of triangles is left unchanged if the cosine of the angle between their normals exceeds this in magnitude.
FLAT_COSINE = 1 - 1e-10
# A fold is corrected only if the ratio of the displacements to the gradients of the cosine is in this range.
SMALLEST_RATIO, GREATEST_RATIO = 0.1, 10.0
# The lower bound of the sum of the squared gradients of a fold [1/mm2].
SMALLEST_WEIGHT = 1e-4
# The diagonal of a voxel [voxels], as the program computes it.
DIAGONAL = math.sqrt(3) + 1e-3


@compiled
def plus(a: Vector, b: Vector) -> Vector:
    """The sum ``a + b``."""
    return a[0] + b[0], a[1] + b[1], a[2] + b[2]


@compiled
def add_dot(total: float, a: Vector, b: Vector) -> float:
    """The sum ``total + a . b``, beginning with the product of the last components."""
    return (total + a[2] * b[2]) + (a[0] * b[0] + a[1] * b[1])


@compiled
def project_edges(points: Floats, edges: Ints, rest: Floats, stiffness: Floats) -> None:
    """Move the ends of each of the ``edges`` (e, 2) so that the fraction ``stiffness`` (e,) of the error of its length is removed.

    ``rest`` (e,) [mm]: the lengths at rest.
    """
    for h in range(len(edges)):
        i, j = edges[h, 0], edges[h, 1]
        apart = minus(at(points, i), at(points, j))
        share = times((1 - rest[h] / math.sqrt(dot(apart, apart))) * stiffness[h], apart)
        move(points, i, -0.5, share)
        move(points, j, 0.5, share)


@compiled
def six_volumes(points: Floats, triangles: Ints) -> tuple[float, Floats]:
    """Six times the volume [mm3] inside closed ``triangles`` (m, 3), summed about the origin, and its gradient (n, 3) [mm2]."""
    gradient, value = np.zeros_like(points), 0.0
    for t in range(len(triangles)):
        i, j, k = triangles[t, 0], triangles[t, 1], triangles[t, 2]
        a, b, c = at(points, i), at(points, j), at(points, k)
        opposite = cross(a, b)
        value = add_dot(value, opposite, c)
        move(gradient, k, 1.0, opposite)
        move(gradient, j, 1.0, cross(c, a))
        move(gradient, i, 1.0, cross(b, c))
    return value, gradient


@compiled
def project_volume(points: Floats, triangles: Ints, rest: float) -> None:
    """Move all points along the gradient of six times the volume, towards its value ``rest`` [mm3] at rest.

    To first order, this removes a sixth of the error.
    """
    value, gradient = six_volumes(points, triangles)
    weight = 0.0
    for i in range(len(points)):
        weight = add_dot(weight, at(gradient, i), at(gradient, i))
    if weight > 0:
        step = (value * (1 / 6) - rest * (1 / 6)) / weight
        for i in range(len(points)):
            move(points, i, -step, at(gradient, i))


@compiled
def normals_of(points: Floats, triangles: Ints) -> Floats:
    """The unit normals (m, 3) of ``triangles`` (m, 3); zero for a triangle without area."""
    found = np.empty((len(triangles), 3))
    for t in range(len(triangles)):
        a, b, c = at(points, triangles[t, 0]), at(points, triangles[t, 1]), at(points, triangles[t, 2])
        found[t, 0], found[t, 1], found[t, 2] = _unit_normal(minus(b, a), minus(c, a))
    return found


@compiled
def angles_of(normals: Floats, pairs: Ints) -> Floats:
    """The dihedral angles (e,) [rad] between the triangles of each of ``pairs`` (e, 2): pi for a flat or nearly flat pair."""
    found = np.empty(len(pairs))
    for h in range(len(pairs)):
        cosine = dot(at(normals, pairs[h, 0]), at(normals, pairs[h, 1]))
        found[h] = math.pi - math.acos(max(-1.0, min(1.0, cosine)))
    return found


@compiled
def _turn(point: Vector, other: Vector, own: Vector, cosine: float) -> Vector:
    """The vector ``point x other + cosine own x point``: in Mueller 2007, a term in the gradients of the cosine between the unit
    normals ``own`` and ``other``.
    """
    return plus(cross(point, other), times(cosine, cross(own, point)))


@compiled
def _gradients(e: Vector, a: Vector, b: Vector) -> tuple[float, Vector, Vector, Vector, Vector]:
    """The cosine of the angle between the normals of triangles (0, e, a) and (0, e, b), and four vectors q [1/mm].

    The vectors are defined in Mueller 2007, appendix A. They belong to 0, e, a and b, in this order: the negative gradient of the
    cosine at 0, a and b, and its gradient at e. For the last component at e, the compiler sums the squares in the norms of the
    normals in a different order.
    """
    u1, u2 = cross(e, a), cross(e, b)
    r1 = 1 / math.sqrt((u1[2] * u1[2] + u1[0] * u1[0]) + u1[1] * u1[1])
    r2 = 1 / math.sqrt((u2[2] * u2[2] + u2[0] * u2[0]) + u2[1] * u2[1])
    s1 = 1 / math.sqrt((u1[2] * u1[2] + u1[1] * u1[1]) + u1[0] * u1[0])
    s2 = 1 / math.sqrt((u2[2] * u2[2] + u2[1] * u2[1]) + u2[0] * u2[0])
    n1, n2 = times(r1, u1), times(r2, u2)
    d = dot(n1, n2)
    q3, q4 = times(r1, _turn(e, n2, n1, d)), times(r2, _turn(e, n1, n2, d))
    x, y, _ = plus(times(r1, _turn(a, n2, n1, d)), times(r2, _turn(b, n1, n2, d)))
    z = s1 * _turn(a, n2, times(s1, u1), d)[2] + s2 * _turn(b, n1, times(s2, u2), d)[2]
    q1 = (x - q3[0]) - q4[0], (y - q3[1]) - q4[1], z - (q3[2] + q4[2])
    return d, q1, (x, y, z), q3, q4


@compiled
def _squares(q1: Vector, q2: Vector, q3: Vector, q4: Vector) -> float:
    """The sum of the squared lengths of four vectors."""
    third = (q3[2] * q3[2] + q4[2] * q4[2]) + (q3[0] * q3[0] + q3[1] * q3[1])
    fourth = (q4[0] * q4[0] + q4[1] * q4[1]) + (q2[0] * q2[0] + q2[1] * q2[1])
    first = (q1[0] * q1[0] + q1[1] * q1[1]) + (q1[2] * q1[2] + q2[2] * q2[2])
    return (third + fourth) + first


@compiled
def project_folds(points: Floats, hinges: Ints, rest: Floats, factor: float) -> None:
    """Open each of the ``hinges`` (h, 4) whose dihedral angle is less than its ``rest`` angle (h,) [rad], as in Mueller 2007.

    Points move by ``ratio``, which contains the ``factor``, times the negative gradient of the cosine. A hinge is left unchanged if
    ``ratio`` is too small or too large.
    """
    for h in range(len(hinges)):
        i, j, k, m = hinges[h, 0], hinges[h, 1], hinges[h, 2], hinges[h, 3]
        p = at(points, i)
        d, q1, q2, q3, q4 = _gradients(minus(at(points, j), p), minus(at(points, k), p), minus(at(points, m), p))
        if abs(d) > FLAT_COSINE:
            continue
        error = math.sqrt(1 - d * d) * (rest[h] - math.acos(d))
        ratio = factor * error / max(SMALLEST_WEIGHT, _squares(q1, q2, q3, q4))
        if SMALLEST_RATIO <= ratio <= GREATEST_RATIO:
            move(points, i, ratio, q1)
            move(points, j, -ratio, q2)
            move(points, k, ratio, q3)
            move(points, m, ratio, q4)


@compiled
def _unit_normal(a: Vector, b: Vector) -> Vector:
    """The unit vector along a x b; zero if this product is almost zero."""
    normal = cross(a, b)
    size = math.sqrt(dot(normal, normal))
    return times(1 / size, normal) if size > 1e-10 else (0.0, 0.0, 0.0)


@compiled
def _is_inside(inside: Bools, place: Vector) -> bool:
    """True if the position ``place`` [voxels] is in a voxel inside the bone."""
    x, y, z = place
    count = len(inside)
    return 0 <= x < count and 0 <= y < count and 0 <= z < count and inside[int(x), int(y), int(z)]


@compiled
def _marks(a: Vector, b: Vector, c: Vector, normal: Vector, corner: Vector) -> bool:
    """True if the triangle with vertices a, b, c [voxels] marks the voxel whose lower corner is ``corner``.

    The triangle marks the voxel if its plane is at most half a diagonal from the corner, and the corner is not more than a
    diagonal beyond any edge of the triangle. The planes through the edges contain ``normal``, which is computed in mm although
    voxels are not cubes.
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
    """Set the entries of ``border`` (k, k, k) for voxels that one of the ``triangles`` (m, 3) marks.

    ``points`` (n, 3) [mm] and ``places`` (n, 3) [voxels] are the same vertices in different units.
    """
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
    """A mask (k, k, k) of the voxels outside ``border`` that a flood fill from (0, 0, 0) reaches through faces.

    As in the program, the flood fill never returns to index 0 along an axis.
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
    """A mask (n,) of the positions ``places`` (n, 3) [voxels] that are in a voxel inside the bone."""
    found = np.empty(len(places), np.bool_)
    for i in range(len(places)):
        found[i] = _is_inside(inside, at(places, i))
    return found


@compiled
def march_out(inside: Bools, goals: Floats, displacements: Floats) -> tuple[Floats, Bools]:
    """Move points that are inside a bone back along their path. Returns their final positions (n, 3) [voxels] and a mask (n,).

    ``goals`` (n, 3) [voxels]: positions inside the bone. ``displacements`` (n, 3) [voxels]: vectors from there back to the start of
    the time step. Points move along them in steps of 1 voxel until they are outside the bone. The mask is True for points that
    travel farther than the length of their displacement plus 1.
    """
    reached, too_far = goals.copy(), np.empty(len(goals), np.bool_)
    for i in range(len(goals)):
        length = math.sqrt(dot(at(displacements, i), at(displacements, i)))
        step = times(1 / length, at(displacements, i))
        taken = 0
        while taken < length + 1 and _is_inside(inside, at(reached, i)):
            move(reached, i, 1.0, step)
            taken += 1
        too_far[i] = taken > length + 1
    return reached, too_far
