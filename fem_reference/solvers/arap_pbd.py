"""ARAP (as rigid as possible) combined with position based dynamics in the two ways that report sections 6.2 and 7.2 propose.

*Volume constraint*: the ARAP energy is minimised at constant volume; the surface is not scaled after each step. The positions of a
global step solve ``L p' = b + lambda grad V``, with the gradient of the volume at the previous iteration and a multiplier lambda
for which the enclosed volume is the volume at rest. At convergence, the gradient of the energy is a multiple of the gradient of the
volume. *Initial guess*: sweeps of PBD's projections (edge lengths, volume, dihedral angles) start from the ARAP state of the frame,
without velocities. If both are requested, the projections come last. As in ``arap``, there is no contact.
"""

from typing import Annotated

import numpy as np
from pydantic import Field

from fem_reference.foundations.mesh import Floats
from fem_reference.foundations.records import Record, rule
from fem_reference.foundations.units import PositiveLength
from fem_reference.problems.setup import Setup
from fem_reference.runs.store import Outcome, Sink
from fem_reference.solvers.arap import Alternation, GlobalStep, Relaxed, Symmetric, alternate, cells_of, farthest
from fem_reference.solvers.arap_kernels import fit_rotations
from fem_reference.solvers.common.protocol import MuscleSolver, TableRow, Trade
from fem_reference.solvers.common.state_checks import Trouble
from fem_reference.solvers.pbd import PbdConstraints, Stiffness, sweep
from fem_reference.solvers.pbd_kernels import volume

# Newton's method for the volume stops at this relative error, or after this many steps.
_REACHED, _STEPS = 1e-12, 20
# A root is taken to be real if its imaginary part is at most this fraction of its magnitude.
_REAL = 1e-8
# The volume counts as preserved if its relative error is at most this value.
_KEPT = 1e-6


class Projections(Record):
    """Projections of PBD that follow ARAP.

    ``sweeps``: the number of sweeps over all constraints. ``stretch``, ``volume``, ``bending``: stiffnesses as in ``pbd``.
    """

    sweeps: Annotated[int, Field(gt=0)]
    stretch: Stiffness
    volume: Stiffness
    bending: Stiffness


class ArapPbdSettings(Record):
    """Settings of ARAP with a volume constraint or projections. Rows of attached vertices are removed, as with fixed = "remove" in
    ``arap``, and rotations are fitted in each iteration.

    ``weights``, ``iterations`` and ``tolerance``: as in ``arap``. The weights "tutte" are not offered, because with removed rows
    they give the same states as "kirchhoff". ``volume_constraint``: minimise the energy at the rest volume. ``projections``: the
    projections of PBD that follow ARAP; by default there are none.
    """

    weights: Symmetric
    iterations: Annotated[int, Field(gt=0), Trade((1, 3, 10, 30, 100))]
    tolerance: PositiveLength | None = None
    volume_constraint: bool
    projections: Projections | None = None

    _check = rule(
        lambda one: one.volume_constraint or one.projections is not None,
        'volume_constraint = true or "projections" (without either it is the solver arap)',
    )


def solve(setup: Setup, settings: ArapPbdSettings, sink: Sink) -> Outcome:
    """Go through every frame number, from the first of ``setup.frames``, which is at rest, to the last."""
    return alternate(_alternation, setup, settings, sink)


def _alternation(setup: Setup, settings: ArapPbdSettings) -> Alternation:
    system = GlobalStep.of(cells_of(setup.surface, settings.weights), setup.attached_vertices, "remove")
    rest = PbdConstraints.at_rest(setup.surface.points, setup.surface.triangles, system.attached)

    def relax(points: Floats) -> Relaxed:
        found = minimise(system, points, settings, rest)
        if settings.projections is None:
            return found
        return Relaxed(projected(found.points, rest, settings.projections), found.iterations, found.met, found.trouble)

    return Alternation(setup, system, relax)


def minimise(system: GlobalStep, points: Floats, settings: ArapPbdSettings, rest: PbdConstraints) -> Relaxed:
    """Alternate local and global steps, starting from ``points`` (n, 3) [mm].

    With ``volume_constraint``, each iteration ends at the volume of ``rest``. The status is *diverged* if this constraint moves a
    point away from the unconstrained minimum by more than the edge length of a cube of that volume: the volume is then preserved
    only by folds of the surface, at a wrong root of the cubic in :func:`at_volume`.
    """
    count, met, tolerance = 0, False, settings.tolerance
    while count < settings.iterations and not met:
        moved = minimum = system.place(points, fit_rotations(points, system.cells))
        if settings.volume_constraint:
            moved = at_volume(system, minimum, points, rest)
        count, met, points = count + 1, tolerance is not None and farthest(moved - points) <= tolerance, moved
        if (far := farthest(moved - minimum)) > np.cbrt(rest.six_volumes / 6):
            why = f"the nearest positions with the volume at rest are {far:.3g} mm away"
            return Relaxed(points, count, False, Trouble("diverged", why))
    ratio = volume(points, rest.triangles)[0] / rest.six_volumes
    kept = not settings.volume_constraint or abs(ratio - 1) <= _KEPT
    lost = Trouble("diverged", f"no multiplier preserves the volume, which is {ratio:.6g} of the volume at rest")
    return Relaxed(points, count, met or tolerance is None, None if kept else lost)


def at_volume(system: GlobalStep, minimum: Floats, before: Floats, rest: PbdConstraints) -> Floats:
    """The positions ``p + lambda L^-1 grad V`` (n, 3) [mm], with the lambda nearest to 0 that gives the volume of ``rest``.

    p is the ``minimum`` (n, 3) of the global step, and the gradient is evaluated at ``before`` (n, 3), the positions before that
    step. The volume is a cubic polynomial in lambda; Newton's method refines the root nearest to 0. Without a root, p is returned.
    """
    direction = np.zeros_like(minimum)
    if system.factor is None:
        return minimum
    direction[system.free] = system.factor.solve(volume(before, rest.triangles)[1][system.free])
    factor = least_root(minimum, direction, rest)
    if factor is None:
        return minimum
    for _ in range(_STEPS):
        value, gradient = volume(minimum + factor * direction, rest.triangles)
        off = value - rest.six_volumes
        if abs(off) <= _REACHED * rest.six_volumes:
            break
        factor -= off / np.sum(gradient * direction)
    return minimum + factor * direction


def least_root(points: Floats, direction: Floats, rest: PbdConstraints) -> float | None:
    """The lambda nearest to 0 for which ``points + lambda direction`` (n, 3) have the volume of ``rest``; None if there is none.

    Six times the volume is a cubic form of the positions. Therefore its values and gradients at ``points`` and at ``direction``
    give the coefficients of the cubic in lambda. The cubic is solved for ``1 / lambda``, which is accurate even if the cubic term
    nearly vanishes.
    """
    (value, slope), (cubic, slope_of_direction) = volume(points, rest.triangles), volume(direction, rest.triangles)
    off = value - rest.six_volumes
    if abs(off) <= _REACHED * rest.six_volumes:
        return 0.0
    coefficients = np.array([off, np.sum(slope * direction), np.sum(slope_of_direction * points), cubic], np.float64)
    if not np.isfinite(coefficients).all():
        return None
    roots = np.roots(coefficients)
    real = roots.real[(np.abs(roots.imag) <= _REAL * np.abs(roots)) & (roots != 0)]
    return float(1 / max(real, key=abs)) if len(real) else None


def projected(points: Floats, rest: PbdConstraints, projections: Projections) -> Floats:
    """The positions (n, 3) [mm] after sweeps of PBD's projections, which start from ``points`` (n, 3)."""
    moved = points.copy()
    for _ in range(projections.sweeps):
        sweep(moved, rest, projections.stretch, projections.volume, projections.bending)
    return moved


_EXAMPLE = {"weights": "clamped cotangent", "iterations": 3, "volume_constraint": True}
# Section 7.2: the volume as a constraint on the energy.
_TABLE = TableRow("ARAP", "arap_pbd", {"weights": "clamped cotangent", "iterations": 4, "volume_constraint": True})
SOLVES = (MuscleSolver(settings=ArapPbdSettings, solve=solve, example=_EXAMPLE, table=(_TABLE,)),)
