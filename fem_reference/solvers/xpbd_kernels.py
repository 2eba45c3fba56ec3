"""The constraints of extended position based dynamics, compiled. Macklin, Mueller and Chentanez 2016, DOI 10.1145/2994258.2994272.

A constraint C stands for the energy ``C^2 / (2 alpha)`` with a compliance alpha. A projection moves ``points`` (n, 3) [mm] in
place by ``dp_i = w_i grad_i C dl``, ``dl = -(C + a l) / (sum_j w_j |grad_j C|^2 + a)`` with the inverse masses w (n,) [1/t] and
``a = alpha / dt^2`` (their eq. 18), and adds dl to the multiplier l, which begins a time step as 0: ``l / dt^2`` is the
constraint's force. The constraints of an array follow each other (Gauss-Seidel), so that the path to the solution depends on
their order and the solution does not.
"""

import math

from fem_reference.foundations.mesh import Floats, Ints
from fem_reference.solvers.compiled_kernels import compiled
from fem_reference.solvers.pbd_kernels import LARGEST_TURN, at, dihedral, distance, dot, move, volume


@compiled
def multiplier_step(value: float, weight: float, softness: float, multiplier: float) -> float:
    """``dl`` of a constraint of this ``value``; 0 where nothing could move."""
    if weight > 0:
        return -(value + softness * multiplier) / (weight + softness)
    return 0.0


@compiled
def pull_distances(
    points: Floats, inverse_masses: Floats, edges: Ints, rest: Floats, softness: Floats, multipliers: Floats
) -> None:
    """One projection of the length of each of the ``edges`` (e, 2), ``rest`` (e,) [mm] at rest; ``softness`` a (e,) [1/t]."""
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
    """One projection of six times the volume inside ``triangles`` (m, 3), ``rest`` [mm3] at rest; ``softness`` a [mm4/t].

    Returns the multiplier after it.
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
    """One projection of the angle of each of the ``hinges`` (e, 4), ``rest`` (e,) [rad] at rest; ``softness`` a (e,) [1/(t mm2)].

    As in position based dynamics, no projection turns a pair by more than ``LARGEST_TURN``.
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
