"""Inflation of a sphere and of a tube, for any law with a finite bulk modulus.

Unlike the closed forms of ``validation/rivlin.py`` for incompressible material, these solutions have no error of order mu / K. The
present radius is ``r(R)`` of incompressible material plus a polynomial, such that the virtual work, the integral of ``P : dF R^n``,
vanishes for every polynomial of this degree (Galerkin, Gauss quadrature, root finding). Source of the deformations: Ogden 1984,
ch. 5.2 and 5.3. The relative error decreases exponentially with the degree; it is below 1e-11 for a wall as thick as its inner
radius.
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
# F at r', r and R, in axes along the radius, the circumference and the axis (in a sphere: circumference); linear in r' and r.
Gradient = Callable[[float, float, float], Floats]


@dataclass(frozen=True, eq=False)
class Wall:
    """Radii at rest ``R`` (q,) [mm] with quadrature ``weights`` (q,); radii in incompressible material, ``start`` (q,) [mm], and
    their derivatives ``steepness`` (q,); polynomials that may be added to ``start``, ``shapes`` (q, k), and their derivatives
    ``slopes`` (q, k).
    """

    R: Floats
    weights: Floats
    start: Floats
    steepness: Floats
    shapes: Floats
    slopes: Floats


def sphere_pressure(law: Law, bulk: float, radii: tuple[float, float], inner_stretch: float) -> float:
    """The pressure [MPa] in a sphere with inner and outer ``radii`` [mm] at rest and an isotropic ``law``, at the stretch a / A of
    its inner face; ``bulk`` [MPa].
    """

    def gradient(slope: float, r: float, R: float) -> Floats:
        return np.diag([slope, r / R, r / R])

    wall = _hollow(radii, inner_stretch, 2)
    _, P = _balanced(law, bulk, wall, gradient, 2)
    return _work_of_expansion(wall, P, gradient, 2) / (inner_stretch * radii[0]) ** 2


def tube(law: Law, bulk: float, radii: tuple[float, float], inner_stretch: float) -> tuple[float, float]:
    """The pressure [MPa] in a tube of fixed length, and the axial force [N] in its wall, the integral of ``2 pi R P_zz``. Arguments
    as for :func:`sphere_pressure`; the fibre direction is the axis.
    """

    def gradient(slope: float, r: float, R: float) -> Floats:
        return np.diag([slope, r / R, 1.0])

    wall = _hollow(radii, inner_stretch, 1)
    _, P = _balanced(law, bulk, wall, gradient, 1)
    force = 2 * np.pi * np.sum(wall.weights * wall.R * P[:, 2, 2])
    return _work_of_expansion(wall, P, gradient, 1) / (inner_stretch * radii[0]), float(force)


def _hollow(radii: tuple[float, float], inner_stretch: float, power: int) -> Wall:
    """A wall with a prescribed inner face: ``start^(n+1) - a^(n+1) = R^(n+1) - A^(n+1)``; the shapes vanish at the inner face."""
    ticks, weights = legendre.leggauss(DEGREE + 8)
    half = (radii[1] - radii[0]) / 2
    R, inner = radii[0] + half * (ticks + 1), inner_stretch * radii[0]
    start = (R ** (power + 1) - radii[0] ** (power + 1) + inner ** (power + 1)) ** (1 / (power + 1))
    values = legendre.legvander(ticks, DEGREE)
    shapes = (ticks + 1)[:, None] * values
    slopes = (values + (ticks + 1)[:, None] * _slopes(ticks)) / half
    return Wall(R, half * weights, start, (R / start) ** power, shapes, slopes)


def _slopes(ticks: Floats) -> Floats:
    """Derivatives of the Legendre polynomials up to DEGREE, (q, k)."""
    return np.asarray(legendre.legval(ticks, legendre.legder(np.eye(DEGREE + 1))).T, dtype=np.float64)


def _balanced(law: Law, bulk: float, wall: Wall, gradient: Gradient, power: int) -> tuple[Floats, Floats]:
    """The radii r (q,) [mm] at equilibrium, and the nominal stress (q, 3, 3) [MPa]."""

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
    """The term ``P : dF/dr`` (q,) [N / mm3]."""
    change = np.array([gradient(0.0, 1.0, R) - gradient(0.0, 0.0, R) for R in wall.R])
    return np.asarray(np.einsum("qij,qij->q", P, change))


def _work_of_expansion(wall: Wall, P: Floats, gradient: Gradient, power: int) -> float:
    """The work [MPa mm^n] if every radius grows by 1, equal to that of the pressure on the inner face, ``p a^n``."""
    return float(np.sum(wall.weights * wall.R**power * _around(wall, P, gradient)))
