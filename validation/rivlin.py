"""Closed forms for bodies of incompressible material: torsion of a cylinder, inflation of a sphere, flexure of a block.

Neo-Hooke ``mu/2 (I1 - 3)`` or Mooney-Rivlin ``c1 (I1 - 3) + c2 (I2 - 3)`` with J = 1. In a body with bulk modulus K
results differ by a fraction of order mu / K. No digitisation error: closed forms, and root finding to rounding where stated.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Torsion:
    """A solid cylinder of ``radius`` A [mm] and fixed length, each section rotated by ``twist`` [rad/mm] times its height:
    ``r = R, theta = Theta + twist Z, z = Z``; c1, c2 [MPa].

    Source: Rivlin 1949, Phil. Trans. R. Soc. A 242, 173, doi 10.1098/rsta.1949.0009; Ogden 1984, ch. 5.3.
    """

    c1: float
    c2: float
    radius: float
    twist: float

    def moment(self) -> float:
        """``pi (c1 + c2) twist A^4`` [N mm], exactly linear in the twist; ``mu = 2 (c1 + c2)``."""
        return np.pi * (self.c1 + self.c2) * self.twist * self.radius**4

    def axial_force(self) -> float:
        """``-pi/2 (c1 + 2 c2) twist^2 A^4`` [N]: negative, because the ends must be pressed together (Poynting effect)."""
        return -np.pi / 2 * (self.c1 + 2 * self.c2) * self.twist**2 * self.radius**4

    def end_stress(self, radius: float) -> float:
        """The axial Cauchy stress [MPa] at ``radius`` [mm]: ``-c1 twist^2 (A^2 - r^2) - 2 c2 twist^2 r^2``."""
        return -(self.twist**2) * (self.c1 * (self.radius**2 - radius**2) + 2 * self.c2 * radius**2)


@dataclass(frozen=True)
class Sphere:
    """A neo-Hookean shell between the radii ``inner`` A and ``outer`` B [mm], ``mu`` [MPa], inflated from inside.

    Source: Green and Zerna 1954, Theoretical Elasticity, ch. 3; Ogden 1984, ch. 5.3.2.
    """

    mu: float
    inner: float
    outer: float

    def outer_stretch(self, inner_stretch: float) -> float:
        """Stretch b / B of the outer face, from the constant volume of the wall, ``b^3 - a^3 = B^3 - A^3``."""
        return float(np.cbrt(1 + (self.inner / self.outer) ** 3 * (inner_stretch**3 - 1)))

    def radius(self, inner_stretch: float, rest: Floats) -> Floats:
        """The present radius [mm] of points with the radius ``rest`` [mm] at rest."""
        return np.cbrt(rest**3 + self.inner**3 * (inner_stretch**3 - 1))

    def pressure(self, inner_stretch: float) -> float:
        """Pressure inside minus pressure outside [MPa], at the stretch a / A of the inner face:
        ``mu (2/lb + 1/(2 lb^4) - 2/la - 1/(2 la^4))``, the integral of ``W'(l) / (l^3 - 1)`` from lb to la.
        """
        la, lb = inner_stretch, self.outer_stretch(inner_stretch)
        return self.mu * (2 / lb + 1 / (2 * lb**4) - 2 / la - 1 / (2 * la**4))

    def limit_point(self) -> tuple[float, float]:
        """The inner stretch at which the pressure is greatest, and this pressure [MPa]; beyond it the pressure falls.

        ``dp/dla = 0``: ``(la^-4 + la^-7) = (A/B)^3 (lb^-4 + lb^-7)``, by root finding to 1e-14.
        """

        def slope(la: float) -> float:
            lb = self.outer_stretch(la)
            return float(la**-4 + la**-7 - (self.inner / self.outer) ** 3 * (lb**-4 + lb**-7))

        stretch = float(brentq(slope, 1.0, 100 * self.outer / self.inner, xtol=1e-14, rtol=1e-14))
        return stretch, self.pressure(stretch)


@dataclass(frozen=True)
class Flexure:
    """A neo-Hookean block bent into a sector of a tube in plane strain, its curved faces free: ``r^2 = 2 X / c + (r1^2 + r2^2)/2``,
    ``theta = c Y``, X from -h/2 to h/2 through its ``thickness`` h [mm], Y from -L/2 to L/2 along its ``length`` L [mm],
    ``c = angle / L``, with ``angle`` [rad], positive, between the two ends; ``mu`` [MPa].

    ``T_rr = W - W(face)`` with ``W = mu/2 (c^2 r^2 + 1/(c^2 r^2))``: both faces are free if ``c^2 r1 r2 = 1``.
    Source: Rivlin 1949, Proc. R. Soc. A 195, 463, doi 10.1098/rspa.1949.0004; Ogden 1984, ch. 5.3.
    """

    mu: float
    thickness: float
    length: float
    angle: float

    @property
    def curvature(self) -> float:
        """The factor c [1/mm]."""
        return self.angle / self.length

    def radii(self) -> tuple[float, float]:
        """Radii r1 < r2 [mm] of the two curved faces: ``c^2 r^2 = sqrt(1 + (h c)^2) -+ h c``."""
        c, x = self.curvature, self.thickness * self.curvature
        root = np.hypot(1, x)
        return float(1 / np.sqrt(root + x) / c), float(np.sqrt(root + x) / c)

    def moment(self) -> float:
        """Moment per width [N]: ``mu / (2 c^2) (h c sqrt(1 + (h c)^2) - arsinh(h c))``, about ``mu h^3 c / 3`` in a thin block.

        The forces on an end have no resultant, so the moment is the same about every point.
        """
        c, x = self.curvature, self.thickness * self.curvature
        return float(self.mu / (2 * c**2) * (x * np.hypot(1, x) - np.arcsinh(x)))

    def hoop_stress(self, radius: Floats) -> Floats:
        """Cauchy stress [MPa] along the arc at ``radius`` [mm]: ``T_rr + mu (c^2 r^2 - 1/(c^2 r^2))``."""
        square = (self.curvature * radius) ** 2
        return self.radial_stress(radius) + self.mu * (square - 1 / square)

    def radial_stress(self, radius: Floats) -> Floats:
        """Cauchy stress [MPa] across the arc at ``radius`` [mm], zero on both faces."""
        square, face = (self.curvature * radius) ** 2, (self.curvature * self.radii()[0]) ** 2
        return self.mu / 2 * (square + 1 / square - face - 1 / face)

    def positions(self, points: Floats) -> Floats:
        """Positions (n, 3) of rest points (n, 3) [mm], bent in the xy plane about the line along z through (-rm, 0), with rm
        the radius of the points with X = 0. So the origin does not move, and points tend to their rest positions as the angle
        decreases to 0.
        """
        X, Y, Z = points.T
        c = self.curvature
        middle = (1 + (self.thickness * c) ** 2) ** 0.25
        stretch, theta = np.sqrt(middle**2 + 2 * X * c), c * Y
        x = 2 * X / (stretch + middle) - stretch * c * Y**2 / 2 * np.sinc(theta / (2 * np.pi)) ** 2
        return np.stack([x, stretch * Y * np.sinc(theta / np.pi), Z], axis=1)
