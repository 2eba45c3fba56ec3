"""Compiled functions for masses and springs: forces and time steps. Report section 5.5.1.

Units are mm, N, s and tonne. Arrays should be writable and C-contiguous; for any other layout the functions are compiled again.
"""

import math
from typing import NamedTuple

import numpy as np

from fem_reference.foundations.mesh import Floats, Ints
from fem_reference.solvers.compiled_kernels import compiled


class Network(NamedTuple):
    """Point ``masses`` (n,) [tonne], connected by ``springs`` (e, 2).

    ``lengths`` (e,) [mm]: lengths of the springs at rest. ``stiffness`` k [N/mm] of each spring. ``damping`` c [N s/mm] of each
    mass. ``gravity`` (3,) [mm/s^2].
    """

    masses: Floats
    springs: Ints
    lengths: Floats
    stiffness: float
    damping: float
    gravity: Floats


class PrescribedPath(NamedTuple):
    """The ``fixed`` masses (h,), which move at constant velocity from the positions ``before`` to ``after``, both (h, 3) [mm]."""

    fixed: Ints
    before: Floats
    after: Floats


@compiled
def forces(points: Floats, network: Network) -> Floats:
    """The force (n, 3) [N] on each mass without damping: the weight of the mass plus the forces of its springs.

    A spring from mass i to mass j pulls on i with the force ``k (l - L) (x_j - x_i) / l``. F_ij in eq. 5.3 has the opposite sign,
    because it is on the left-hand side of eq. 5.4. If both ends coincide, the spring has no direction and no force.
    """
    found = np.empty_like(points)
    for i in range(len(points)):
        for axis in range(3):
            found[i, axis] = network.masses[i] * network.gravity[axis]
    for s in range(len(network.springs)):
        i, j = network.springs[s, 0], network.springs[s, 1]
        x, y, z = points[j, 0] - points[i, 0], points[j, 1] - points[i, 1], points[j, 2] - points[i, 2]
        length = math.sqrt(x * x + y * y + z * z)
        if length > 0:
            pull = network.stiffness * (1 - network.lengths[s] / length)
            found[i, 0] += pull * x
            found[i, 1] += pull * y
            found[i, 2] += pull * z
            found[j, 0] -= pull * x
            found[j, 1] -= pull * y
            found[j, 2] -= pull * z
    return found


@compiled
def advance(
    points: Floats, previous: Floats, network: Network, path: PrescribedPath, time_step: float, steps: int
) -> None:
    """Move ``points`` (n, 3) [mm] in place through a number of ``steps``, each of ``time_step`` [s].

    ``previous`` (n, 3) [mm]: the positions one step earlier, which are updated. The scheme is position Verlet with the velocity of
    the previous step, eqs 5.6 and 5.7:
    ``x(t + dt) = 2 x(t) - x(t - dt) + dt^2 / m (F(t) - c (x(t) - x(t - dt)) / dt)``.
    """
    for step in range(1, steps + 1):
        acting = forces(points, network)
        for i in range(len(points)):
            gain = time_step * time_step / network.masses[i]
            kept = 1 - time_step * network.damping / network.masses[i]
            for axis in range(3):
                displacement = points[i, axis] - previous[i, axis]
                previous[i, axis] = points[i, axis]
                points[i, axis] += kept * displacement + gain * acting[i, axis]
        share = step / steps
        for h in range(len(path.fixed)):
            i = path.fixed[h]
            for axis in range(3):
                points[i, axis] = (1 - share) * path.before[h, axis] + share * path.after[h, axis]
