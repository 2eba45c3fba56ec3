"""Closed forms for bodies of incompressible material: torsion of a cylinder, inflation of a sphere, flexure of a block.

Neo-Hooke ``mu/2 (I1 - 3)`` or Mooney-Rivlin ``c1 (I1 - 3) + c2 (I2 - 3)`` with J = 1. A body of bulk modulus K differs from it by
a part of the order of mu / K. No reading error: closed forms, and root finding to rounding where a docstring says so.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Torsion:
    """A solid cylinder of ``radius`` A [mm] fixed at its length, each section turned by ``twist`` [rad/mm] times its height:
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
        """``-pi/2 (c1 + 2 c2) twist^2 A^4`` [N]: negative, the ends must be pressed together (Poynting effect)."""
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
        """Of the outer face, b / B, from the volume of the wall, ``b^3 - a^3 = B^3 - A^3``."""
        return float(np.cbrt(1 + (self.inner / self.outer) ** 3 * (inner_stretch**3 - 1)))

    def radius(self, inner_stretch: float, rest: Floats) -> Floats:
        """Where the points of radius ``rest`` [mm] are, [mm]."""
        return np.cbrt(rest**3 + self.inner**3 * (inner_stretch**3 - 1))

    def pressure(self, inner_stretch: float) -> float:
        """Inside above outside [MPa], from the stretch a / A of the inner face:
        ``mu (2/lb + 1/(2 lb^4) - 2/la - 1/(2 la^4))``, the integral of ``W'(l) / (l^3 - 1)`` from lb to la.
        """
        la, lb = inner_stretch, self.outer_stretch(inner_stretch)
        return self.mu * (2 / lb + 1 / (2 * lb**4) - 2 / la - 1 / (2 * la**4))

    def limit_point(self) -> tuple[float, float]:
        """The inner stretch where the pressure is largest, and that pressure [MPa]; beyond it the shell grows by itself.

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
    ``c = angle / L``; ``angle`` [rad] above zero is between the two ends, ``mu`` [MPa].

    ``T_rr = W - W(face)`` with ``W = mu/2 (c^2 r^2 + 1/(c^2 r^2))``: both faces are free where ``c^2 r1 r2 = 1``.
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
        """Of the two curved faces, r1 < r2 [mm]: ``c^2 r^2 = sqrt(1 + (h c)^2) -+ h c``."""
        c, x = self.curvature, self.thickness * self.curvature
        root = np.hypot(1, x)
        return float(1 / np.sqrt(root + x) / c), float(np.sqrt(root + x) / c)

    def moment(self) -> float:
        """Per width [N]: ``mu / (2 c^2) (h c sqrt(1 + (h c)^2) - arsinh(h c))``, near ``mu h^3 c / 3`` for a thin block.

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
        """Where rest points (n, 3) [mm] are, (n, 3): bent in the plane of x and y about the z axis through (-rm, 0), with rm
        the radius of the points of X = 0, which therefore keep the origin and tend to where they rest as the angle falls.
        """
        X, Y, Z = points.T
        c = self.curvature
        middle = (1 + (self.thickness * c) ** 2) ** 0.25
        stretch, theta = np.sqrt(middle**2 + 2 * X * c), c * Y
        x = 2 * X / (stretch + middle) - stretch * c * Y**2 / 2 * np.sinc(theta / (2 * np.pi)) ** 2
        return np.stack([x, stretch * Y * np.sinc(theta / np.pi), Z], axis=1)
