"""Compiled functions for the three constraints of position based dynamics: values, gradients, projections. Report 5.5.3.

Functions whose name begins with ``project_`` move ``points`` (n, 3) [mm] in place, by eq. 5.14 of the report weighted with inverse
masses w (n,): ``dp_i = -stiffness w_i grad_i C / (sum_j w_j |grad_j C|^2) C``. To first order, one projection removes the fraction
``stiffness`` of C. Constraints are projected one after the other in the order of the arrays (Gauss-Seidel), so the result depends
on this order. Arrays should be writable and C-contiguous; for any other layout the functions are compiled again.

Functions whose name begins with ``pull_`` belong to extended position based dynamics (Macklin, Mueller and Chentanez 2016, DOI
10.1145/2994258.2994272), in which a constraint C with the compliance alpha has the energy ``C^2 / (2 alpha)``. A projection moves
points by ``dp_i = w_i grad_i C dl`` with ``dl = -(C + a l) / (sum_j w_j |grad_j C|^2 + a)`` and ``a = alpha / dt^2`` (eq. 18 of the
paper); w is in 1/t (t: tonne). It also adds dl to the multiplier l, which is 0 at the start of each time step; ``l / dt^2`` is the
force of the constraint. Only the path to the solution depends on the order of the constraints.
"""

import math

import numpy as np

from fem_reference.foundations.mesh import Floats, Ints
from fem_reference.solvers.compiled_kernels import compiled

Vector = tuple[float, float, float]

# A pair of triangles counts as flat if the sine of its dihedral angle is below this, where the gradient is rounding noise.
FLAT = 1e-5
# The maximum change of a dihedral angle in one projection [rad]. Points move along straight lines instead of arcs, so a rotation by
# t lengthens a triangle by the fraction t^2 / 2. For pairs that are folded shut (t near pi) this error would grow without bound.
LARGEST_TURN = 0.3
_ZERO = (0.0, 0.0, 0.0)


@compiled
def at(points: Floats, i: int) -> Vector:
    """The point with index ``i``."""
    return points[i, 0], points[i, 1], points[i, 2]


@compiled
def minus(a: Vector, b: Vector) -> Vector:
    """The difference ``a - b``."""
    return a[0] - b[0], a[1] - b[1], a[2] - b[2]


@compiled
def times(factor: float, a: Vector) -> Vector:
    """The product of a ``factor`` and a vector."""
    return factor * a[0], factor * a[1], factor * a[2]


@compiled
def dot(a: Vector, b: Vector) -> float:
    """The scalar product ``a . b``."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


@compiled
def cross(a: Vector, b: Vector) -> Vector:
    """The vector product ``a x b``."""
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


@compiled
def move(points: Floats, i: int, factor: float, direction: Vector) -> None:
    """Move point i by ``factor`` times ``direction``, in place."""
    for axis in range(3):
        points[i, axis] += factor * direction[axis]


@compiled
def distance(p1: Vector, p2: Vector) -> tuple[float, Vector]:
    """The distance [mm] between two points and its gradient at ``p1``. Eq. 5.15-5.17.

    The gradient at ``p2`` has the opposite sign. If the points coincide, the gradient is zero.
    """
    apart = minus(p1, p2)
    length = math.sqrt(dot(apart, apart))
    return length, (times(1 / length, apart) if length > 0 else _ZERO)


@compiled
def volume(points: Floats, triangles: Ints) -> tuple[float, Floats]:
    """Six times the volume [mm3] inside closed ``triangles`` (m, 3), and its gradient (n, 3) [mm2]. Eq. 5.19-5.21.

    Eq. 5.18 omits its factor 1/6 in part; here neither the value nor the gradient contains it. The mean of the points is
    used as the origin, which reduces rounding errors and does not change the volume of a closed surface.
    """
    centre = (points[:, 0].mean(), points[:, 1].mean(), points[:, 2].mean())
    gradient = np.zeros_like(points)
    value = 0.0
    for t in range(len(triangles)):
        i, j, k = triangles[t, 0], triangles[t, 1], triangles[t, 2]
        a, b, c = minus(at(points, i), centre), minus(at(points, j), centre), minus(at(points, k), centre)
        opposite = cross(b, c)
        value += dot(a, opposite)
        move(gradient, i, 1.0, opposite)
        move(gradient, j, 1.0, cross(c, a))
        move(gradient, k, 1.0, cross(a, b))
    return value, gradient


@compiled
def dihedral(p1: Vector, p2: Vector, p3: Vector, p4: Vector) -> tuple[float, Vector, Vector, Vector, Vector]:
    """The dihedral angle [rad] between triangles (p1, p2, p3) and (p1, p2, p4), and its gradients at p1 to p4. Eq. 5.22-5.30.

    The angle is pi for a flat pair and does not depend on the side to which the pair is folded. Gradients are zero where arccos is
    not differentiable: for pairs that are flat, folded shut or without area. Near these, arccos of the cosine d loses half of its
    digits, so the angle is atan2(sine, d). In eq. 5.26, eq. 5.30 must be transposed, and ``n2 . (n2 x p2)`` is an outer product.
    """
    e, a, b = minus(p2, p1), minus(p3, p1), minus(p4, p1)
    u1, u2 = cross(e, a), cross(e, b)
    size1, size2 = math.sqrt(dot(u1, u1)), math.sqrt(dot(u2, u2))
    if size1 == 0 or size2 == 0:
        return math.pi, _ZERO, _ZERO, _ZERO, _ZERO
    n1, n2 = times(1 / size1, u1), times(1 / size2, u2)
    d, normal = dot(n1, n2), cross(n1, n2)
    sine = math.sqrt(dot(normal, normal))
    angle = math.atan2(sine, d)
    if sine < FLAT:
        return angle, _ZERO, _ZERO, _ZERO, _ZERO
    slope = -1 / sine
    to1 = times(slope / size1, minus(n2, times(d, n1)))
    to2 = times(slope / size2, minus(n1, times(d, n2)))
    g3, g4 = cross(to1, e), cross(to2, e)
    g2 = minus(cross(a, to1), cross(to2, b))
    g1 = minus(minus(_ZERO, g2), (g3[0] + g4[0], g3[1] + g4[1], g3[2] + g4[2]))
    return angle, g1, g2, g3, g4


@compiled
def distances(points: Floats, edges: Ints) -> Floats:
    """The lengths (e,) [mm] of ``edges`` (e, 2)."""
    found = np.empty(len(edges))
    for h in range(len(edges)):
        found[h] = distance(at(points, edges[h, 0]), at(points, edges[h, 1]))[0]
    return found


@compiled
def dihedrals(points: Floats, hinges: Ints) -> Floats:
    """The dihedral angles (e,) [rad] of ``hinges`` (e, 4): both ends of an edge, then the two vertices opposite the edge."""
    found = np.empty(len(hinges))
    for h in range(len(hinges)):
        i, j, k, m = hinges[h, 0], hinges[h, 1], hinges[h, 2], hinges[h, 3]
        found[h] = dihedral(at(points, i), at(points, j), at(points, k), at(points, m))[0]
    return found


@compiled
def project_distances(points: Floats, inverse_masses: Floats, edges: Ints, rest: Floats, stiffness: Floats) -> None:
    """Project the length of each of the ``edges`` (e, 2) towards ``rest`` (e,) [mm], with the ``stiffness`` (e,) of the edge."""
    for h in range(len(edges)):
        i, j = edges[h, 0], edges[h, 1]
        weight = inverse_masses[i] + inverse_masses[j]
        if weight > 0:
            length, direction = distance(at(points, i), at(points, j))
            step = -stiffness[h] * (length - rest[h]) / weight
            move(points, i, step * inverse_masses[i], direction)
            move(points, j, -step * inverse_masses[j], direction)


@compiled
def to_segment(p: Vector, start: Vector, end: Vector) -> float:
    """The distance [mm] of point ``p`` from the segment between the points ``start`` and ``end``, which must differ."""
    segment, off = minus(end, start), minus(p, start)
    share = min(1.0, max(0.0, dot(off, segment) / max(dot(segment, segment), 1e-300)))
    return distance(off, times(share, segment))[0]


@compiled
def nearest_segments(points: Floats, starts: Floats, ends: Floats, within: float) -> Ints:
    """The index (n,) of the segment nearest to each of ``points`` (n, 3) [mm].

    Segments go from ``starts`` (k, 3) to ``ends`` (k, 3) [mm]. Segments whose distance exceeds the minimum by at most ``within``
    [mm] count as equally near, and the first of them is returned.
    """
    found, distances = np.zeros(len(points), np.int64), np.empty(len(starts))
    for n in range(len(points)):
        for s in range(len(starts)):
            distances[s] = to_segment(at(points, n), at(starts, s), at(ends, s))
        least = distances.min()
        while distances[found[n]] > least + within:
            found[n] += 1
    return found


@compiled
def project_volume(points: Floats, inverse_masses: Floats, triangles: Ints, rest: float, stiffness: float) -> None:
    """Project six times the volume inside ``triangles`` (m, 3) towards ``rest`` [mm3]: all points move along its gradient."""
    value, gradient = volume(points, triangles)
    weight = 0.0
    for i in range(len(points)):
        slope = at(gradient, i)
        weight += inverse_masses[i] * dot(slope, slope)
    if weight > 0:
        step = -stiffness * (value - rest) / weight
        for i in range(len(points)):
            move(points, i, step * inverse_masses[i], at(gradient, i))


@compiled
def project_dihedrals(points: Floats, inverse_masses: Floats, hinges: Ints, rest: Floats, stiffness: float) -> None:
    """Project the dihedral angle of each of the ``hinges`` (e, 4) towards ``rest`` (e,) [rad]."""
    for h in range(len(hinges)):
        i, j, k, m = hinges[h, 0], hinges[h, 1], hinges[h, 2], hinges[h, 3]
        angle, g1, g2, g3, g4 = dihedral(at(points, i), at(points, j), at(points, k), at(points, m))
        w1, w2, w3, w4 = inverse_masses[i], inverse_masses[j], inverse_masses[k], inverse_masses[m]
        weight = w1 * dot(g1, g1) + w2 * dot(g2, g2) + w3 * dot(g3, g3) + w4 * dot(g4, g4)
        if weight > 0:
            step = -stiffness * min(LARGEST_TURN, max(-LARGEST_TURN, angle - rest[h])) / weight
            move(points, i, step * w1, g1)
            move(points, j, step * w2, g2)
            move(points, k, step * w3, g3)
            move(points, m, step * w4, g4)


@compiled
def multiplier_step(value: float, weight: float, softness: float, multiplier: float) -> float:
    """The step ``dl`` of the ``multiplier`` l of a constraint with the ``value`` C; 0 if none of its points can move.

    ``weight``: the sum of w_j |grad_j C|^2. ``softness``: the value a.
    """
    if weight > 0:
        return -(value + softness * multiplier) / (weight + softness)
    return 0.0


@compiled
def pull_distances(
    points: Floats, inverse_masses: Floats, edges: Ints, rest: Floats, softness: Floats, multipliers: Floats
) -> None:
    """Project the length of each of the ``edges`` (e, 2) once, and update its multiplier.

    ``rest`` (e,) [mm]: lengths at rest. ``softness`` (e,) [1/t]: the value a of each edge.
    """
    for h in range(len(edges)):
        i, j = edges[h, 0], edges[h, 1]
        length, direction = distance(at(points, i), at(points, j))
        weight = inverse_masses[i] + inverse_masses[j]
        step = multiplier_step(length - rest[h], weight, softness[h], multipliers[h])
        multipliers[h] += step
        move(points, i, step * inverse_masses[i], direction)
        move(points, j, -step * inverse_masses[j], direction)


@compiled
def pull_volume(
    points: Floats, inverse_masses: Floats, triangles: Ints, rest: float, softness: float, multiplier: float
) -> float:
    """Project six times the volume inside ``triangles`` (m, 3) once. Returns the new multiplier.

    ``rest`` [mm3]: six times the volume at rest. ``softness`` [mm4/t]: the value a.
    """
    value, gradient = volume(points, triangles)
    weight = 0.0
    for i in range(len(points)):
        slope = at(gradient, i)
        weight += inverse_masses[i] * dot(slope, slope)
    step = multiplier_step(value - rest, weight, softness, multiplier)
    for i in range(len(points)):
        move(points, i, step * inverse_masses[i], at(gradient, i))
    return multiplier + step


@compiled
def pull_dihedrals(
    points: Floats, inverse_masses: Floats, hinges: Ints, rest: Floats, softness: Floats, multipliers: Floats
) -> None:
    """Project the dihedral angle of each of the ``hinges`` (e, 4) once, and update its multiplier.

    ``rest`` (e,) [rad]: angles at rest. ``softness`` (e,) [1/(t mm2)]: the value a of each hinge. As in ``project_dihedrals``, one
    projection changes an angle by at most ``LARGEST_TURN``.
    """
    for h in range(len(hinges)):
        i, j, k, m = hinges[h, 0], hinges[h, 1], hinges[h, 2], hinges[h, 3]
        angle, g1, g2, g3, g4 = dihedral(at(points, i), at(points, j), at(points, k), at(points, m))
        w1, w2, w3, w4 = inverse_masses[i], inverse_masses[j], inverse_masses[k], inverse_masses[m]
        weight = w1 * dot(g1, g1) + w2 * dot(g2, g2) + w3 * dot(g3, g3) + w4 * dot(g4, g4)
        step = multiplier_step(angle - rest[h], weight, softness[h], multipliers[h])
        if abs(step) * weight > LARGEST_TURN:
            step = math.copysign(LARGEST_TURN, step) / weight
        multipliers[h] += step
        move(points, i, step * w1, g1)
        move(points, j, step * w2, g2)
        move(points, k, step * w3, g3)
        move(points, m, step * w4, g4)
