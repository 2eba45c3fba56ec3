"""Inflation of a sphere and of a tube, of any law with a finite bulk modulus.

What ``validation/rivlin.py`` has in closed form for incompressible material, without its part of the order of mu / K. The radius
now is ``r(R)`` of incompressible material plus a polynomial, such that the virtual work, the integral of ``P : dF R^n``, vanishes
for every polynomial of its degree (Galerkin, Gauss quadrature, root finding). Source: the deformations are those of Ogden 1984,
ch. 5.2 and 5.3. The error falls exponentially with the degree: below 1e-11 of what is found, for a wall as thick as its
inner radius.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.polynomial import legendre
from scipy.optimize import root

from validation.homogeneous import nominal_stress
from validation.laws import Floats, Law

AXIS = np.array([0.0, 0.0, 1.0])
DEGREE = 10
# Of r', r and R: F in axes along the radius, around, and along the axis (of the sphere: around too); linear in r' and r.
Gradient = Callable[[float, float, float], Floats]


@dataclass(frozen=True, eq=False)
class Wall:
    """At radii at rest ``R`` (q,) [mm] with ``weights`` (q,) of their quadrature: where they are in incompressible material,
    ``start`` (q,) [mm], and its ``steepness`` (q,); polynomials that may be added to it, ``shapes`` (q, k), and their
    ``slopes`` (q, k).
    """

    R: Floats
    weights: Floats
    start: Floats
    steepness: Floats
    shapes: Floats
    slopes: Floats


def sphere_pressure(law: Law, bulk: float, radii: tuple[float, float], inner_stretch: float) -> float:
    """Inside a sphere of inner and outer ``radii`` at rest [mm], of an isotropic ``law``, from the stretch a / A of its inner face;
    [MPa], as ``bulk``.
    """

    def gradient(slope: float, r: float, R: float) -> Floats:
        return np.diag([slope, r / R, r / R])

    wall = _hollow(radii, inner_stretch, 2)
    _, P = _balanced(law, bulk, wall, gradient, 2)
    return _work_of_expansion(wall, P, gradient, 2) / (inner_stretch * radii[0]) ** 2


def tube(law: Law, bulk: float, radii: tuple[float, float], inner_stretch: float) -> tuple[float, float]:
    """Pressure [MPa] in a tube that is fixed at its length, and force along the axis in its wall [N], the integral of
    ``2 pi R P_zz``; arguments as of :func:`sphere_pressure`, a fibre runs along the axis.
    """

    def gradient(slope: float, r: float, R: float) -> Floats:
        return np.diag([slope, r / R, 1.0])

    wall = _hollow(radii, inner_stretch, 1)
    _, P = _balanced(law, bulk, wall, gradient, 1)
    force = 2 * np.pi * np.sum(wall.weights * wall.R * P[:, 2, 2])
    return _work_of_expansion(wall, P, gradient, 1) / (inner_stretch * radii[0]), float(force)


def _hollow(radii: tuple[float, float], inner_stretch: float, power: int) -> Wall:
    """A wall whose inner face is fixed: ``start^(n+1) - a^(n+1) = R^(n+1) - A^(n+1)``, shapes that vanish at the inner face."""
    ticks, weights = legendre.leggauss(DEGREE + 8)
    half = (radii[1] - radii[0]) / 2
    R, inner = radii[0] + half * (ticks + 1), inner_stretch * radii[0]
    start = (R ** (power + 1) - radii[0] ** (power + 1) + inner ** (power + 1)) ** (1 / (power + 1))
    values = legendre.legvander(ticks, DEGREE)
    shapes = (ticks + 1)[:, None] * values
    slopes = (values + (ticks + 1)[:, None] * _slopes(ticks)) / half
    return Wall(R, half * weights, start, (R / start) ** power, shapes, slopes)


def _slopes(ticks: Floats) -> Floats:
    """Of the Legendre polynomials up to DEGREE, (q, k)."""
    return np.asarray(legendre.legval(ticks, legendre.legder(np.eye(DEGREE + 1))).T, dtype=np.float64)


def _balanced(law: Law, bulk: float, wall: Wall, gradient: Gradient, power: int) -> tuple[Floats, Floats]:
    """Where the wall is in balance, r (q,) [mm], and its nominal stress (q, 3, 3) [MPa]."""

    def at(factors: Floats) -> tuple[Floats, Floats]:
        r, slope = wall.start + wall.shapes @ factors, wall.steepness + wall.slopes @ factors
        places = zip(slope, r, wall.R, strict=True)
        return r, np.array([nominal_stress(law, bulk, gradient(*place), AXIS) for place in places])

    def unbalanced(factors: Floats) -> Floats:
        _, P = at(factors)
        return (wall.weights * wall.R**power) @ (
            P[:, 0, 0, None] * wall.slopes + _around(wall, P, gradient)[:, None] * wall.shapes
        )

    found = root(unbalanced, np.zeros(DEGREE + 1), options={"xtol": 1e-13}).x
    left = np.abs(unbalanced(found)).max()
    if not left <= 1e-11 * bulk * wall.R[-1] ** power:
        raise ArithmeticError(f"no balance found: {left:.1e} N of virtual work left")
    return at(found)


def _around(wall: Wall, P: Floats, gradient: Gradient) -> Floats:
    """``P : dF/dr`` (q,) [N / mm3]."""
    change = np.array([gradient(0.0, 1.0, R) - gradient(0.0, 0.0, R) for R in wall.R])
    return np.asarray(np.einsum("qij,qij->q", P, change))


def _work_of_expansion(wall: Wall, P: Floats, gradient: Gradient, power: int) -> float:
    """The work [MPa mm^n] of moving every radius out by 1, which is that of the pressure on the inner face, ``p a^n``."""
    return float(np.sum(wall.weights * wall.R**power * _around(wall, P, gradient)))
