"""The benchmark of cardiac mechanics: three problems on whose results eleven groups agree.

Source: Land et al., Verification of cardiac mechanics software, Proc. R. Soc. A 471 (2015) 20150641, doi
10.1098/rspa.2015.0641. Units: mm, N, MPa (the paper has kPa). In all problems the material is incompressible and the load is a
fluid pressure: a force per deformed area along the inward normal of the deformed surface (a follower load).

The passive law is Guccione's, ``W = C/2 (e^Q - 1)``, ``Q = b_f E_ff^2 + b_t (E_ss^2 + E_nn^2 + 2 E_sn^2) + 2 b_fs (E_fs^2 +
E_fn^2)``, E the Green-Lagrange strain in the fibre direction f and two directions s, n across it, whose choice does not matter.
The active stress of problem 3 is a second Piola-Kirchhoff stress ``T_a f f^T``, f the unit fibre direction at rest: an energy
``T_a/2 (f . C f - 1)`` per unit rest volume.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Guccione:
    """Parameters of the passive law: ``c`` [MPa] and the exponents ``bf``, ``bt``, ``bfs``."""

    c: float
    bf: float
    bt: float
    bfs: float


@dataclass(frozen=True)
class Problem:
    """A problem of the benchmark: its ``law``, ``pressure`` and active ``tension`` T_a [MPa] at their full values."""

    law: Guccione
    pressure: float
    tension: float = 0.0


# Problem 1: the beam 0 <= x <= 10, 0 <= y <= 1, 0 <= z <= 1 mm, fibres along x; x = 0 clamped; the pressure on all of z = 0, so
# that the beam bends towards +z. Results: z of the material point (10, 0.5, 1), and the line (x, 0.5, 0.5).
BEAM = (10.0, 1.0, 1.0)
BEAM_POINT = (10.0, 0.5, 1.0)
PROBLEM_1 = Problem(Guccione(2e-3, 8.0, 2.0, 4.0), pressure=4e-6)

# Problems 2 and 3: the wall between two truncated ellipsoids of revolution about z, below z = 5 mm; the base z = 5 mm clamped;
# the pressure on the inside (endocardium). Results: z of the two apices (0, 0, -17) and (0, 0, -20).
SHORT = (7.0, 10.0)
LONG = (17.0, 20.0)
BASE = 5.0
PROBLEM_2 = Problem(Guccione(10e-3, 1.0, 1.0, 1.0), pressure=10e-3)
PROBLEM_3 = Problem(Guccione(2e-3, 8.0, 2.0, 4.0), pressure=15e-3, tension=60e-3)
FIBRE_ANGLES = (90.0, -90.0)

# Results [mm] on which the codes agree, as later publications quote them: the paper shows curves, which were not digitised again
# (fenicsx-pulse states 4.17 in its demonstration of problem 1). The codes differ by more than the last digit: finer solutions
# typically differ by 0.5 per cent (abstract), here of 5, 28 and 15 mm: 0.03, 0.15 and 0.1 mm.
TIP_OF_BEAM = 4.17
PASSIVE_APICES = (-26.6, -28.2)
ACTIVE_APICES = (-12.3, -15.4)


def axes(depth: Floats) -> tuple[Floats, Floats]:
    """Short and long semi-axes [mm] of the surface at ``depth`` t: ``7 + 3 t`` and ``17 + 3 t``, with t 0 at the endocardium and 1
    at the epicardium.
    """
    depth = np.asarray(depth, dtype=float)
    return SHORT[0] + (SHORT[1] - SHORT[0]) * depth, LONG[0] + (LONG[1] - LONG[0]) * depth


def base_angle(depth: Floats) -> Floats:
    """The angle u [rad] at which the surface at ``depth`` meets the base: ``-arccos(5 / long axis)``; at the apex u is -pi."""
    return -np.arccos(BASE / axes(depth)[1])


def wall(u: Floats, v: Floats, depth: Floats) -> Floats:
    """Points (n, 3) [mm] of the wall at angles u in [-pi, base_angle] and v in [-pi, pi] and at ``depth``, each (n,):
    ``(s sin u cos v, s sin u sin v, l cos u)`` with the axes s and l.
    """
    short, long = axes(depth)
    return np.stack([short * np.sin(u) * np.cos(v), short * np.sin(u) * np.sin(v), long * np.cos(u)], axis=-1)


def depth(points: Floats) -> Floats:
    """The depth t (n,) of ``points`` (n, 3) [mm] in the wall: the root of ``(x^2 + y^2) / (7 + 3 t)^2 + z^2 / (17 + 3 t)^2 = 1``.

    Newton's method starts from a t that is too small. The left side is convex and falls with t, so t grows towards the root.
    It also works somewhat outside the wall, but not deep in the cavity, through which no surface of this family passes.
    """
    points = np.asarray(points, dtype=float)
    radius, height = np.hypot(points[:, 0], points[:, 1]), np.abs(points[:, 2])
    steps = SHORT[1] - SHORT[0], LONG[1] - LONG[0]
    t = np.maximum((radius - SHORT[0]) / steps[0], (height - LONG[0]) / steps[1])
    for _ in range(40):
        short, long = axes(t)
        excess = (radius / short) ** 2 + (height / long) ** 2 - 1
        slope = -2 * (steps[0] * radius**2 / short**3 + steps[1] * height**2 / long**3)
        t = t - excess / slope
    return np.asarray(t)


def fibre(points: Floats) -> Floats:
    """Unit fibre directions (n, 3) of problem 3 at rest points (n, 3) [mm] of the wall.

    ``sin a x_u / |x_u| + cos a x_v / |x_v|``, with the derivatives x_u and x_v of :func:`wall` and the angle a, linear in the depth
    from +90 degrees inside to -90 degrees outside. x_u points from apex to base and, because sin u < 0, x_v counter-clockwise
    seen from +z. On the axis, where x_v is 0, its direction is taken as y.

    Public codes differ in the handedness of this helix (cardiac-geometries has u in [0, pi], so that x_u points down). They solve
    the mirror image of the body, whose apices have the same z and which twists in the other direction.
    """
    points = np.asarray(points, dtype=float)
    t = depth(points)
    short, long = axes(t)
    radius = np.hypot(points[:, 0], points[:, 1])
    off_axis = radius > 0
    outward = np.where(off_axis[:, None], points[:, :2] / np.where(off_axis, radius, 1.0)[:, None], [1.0, 0.0])
    nothing = np.zeros_like(t)
    upward = np.column_stack([-(points[:, 2] * short / long)[:, None] * outward, radius * long / short])
    upward = upward / np.linalg.norm(upward, axis=1, keepdims=True)
    around = np.column_stack([-outward[:, 1], outward[:, 0], nothing])
    angle = np.radians(FIBRE_ANGLES[0] + (FIBRE_ANGLES[1] - FIBRE_ANGLES[0]) * t)[:, None]
    return np.asarray(np.sin(angle) * upward + np.cos(angle) * around)
