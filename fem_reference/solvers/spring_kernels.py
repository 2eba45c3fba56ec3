"""Masses and springs, compiled: their forces and their steps in time. Report section 5.5.1.

Units: mm, N, s and tonne. Arrays should be writable and C-contiguous: the loops are compiled again for any other kind.
"""

import math
from typing import NamedTuple

import numpy as np

from fem_reference.foundations.mesh import Floats, Ints
from fem_reference.solvers.compiled_kernels import compiled


class Network(NamedTuple):
    """Point ``masses`` (n,) [tonne] and ``springs`` (e, 2) between them, of ``lengths`` (e,) [mm] at rest and one ``stiffness`` k
    [N/mm]; a ``damping`` c [N s/mm] of every mass, and ``gravity`` (3,) [mm/s^2].
    """

    masses: Floats
    springs: Ints
    lengths: Floats
    stiffness: float
    damping: float
    gravity: Floats


class PrescribedPath(NamedTuple):
    """The ``fixed`` masses (h,), which move at constant velocity from their positions ``before`` to those ``after`` (h, 3) [mm]."""

    fixed: Ints
    before: Floats
    after: Floats


@compiled
def forces(points: Floats, network: Network) -> Floats:
    """The force (n, 3) [N] on each mass, without damping: its weight plus the forces of its springs.

    A spring from mass i pulls with ``k (l - L) (x_j - x_i) / l``: F_ij of eq. 5.3 is minus this force, since eq. 5.4 has it on the
    left. If both ends coincide the spring has no direction and does not pull.
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
    """Move ``points`` (n, 3) [mm] in place through ``steps`` of ``time_step`` [s]; ``previous`` (n, 3): positions one step before.

    Position Verlet with the velocity of the step before, eqs 5.6 and 5.7:
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
