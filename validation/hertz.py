"""Contact of two spheres, or of a sphere and a half-space, without friction, at small strain (Hertz).

Source: Johnson 1985, Contact Mechanics, ch. 3.4 and 4.2, doi 10.1017/CBO9781139171731; after Hertz 1882,
doi 10.1515/crll.1882.92.156.
No digitisation error; for a contact that is small compared with the spheres the relative error is of the order of ``(a / R)^2``.
"""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Side:
    """One of the two bodies: its ``radius`` [mm] (``math.inf``: a half-space), ``young`` [MPa] (``math.inf``: rigid) and
    ``poisson``.
    """

    radius: float
    young: float
    poisson: float

    @property
    def compliance(self) -> float:
        """``(1 - nu^2) / E`` [1/MPa]."""
        return (1 - self.poisson**2) / self.young


@dataclass(frozen=True)
class Hertz:
    """Two bodies pressed together by ``force`` F [N]."""

    first: Side
    second: Side
    force: float

    @property
    def modulus(self) -> float:
        """E* [MPa]: ``1/E* = (1 - nu1^2)/E1 + (1 - nu2^2)/E2``."""
        return 1 / (self.first.compliance + self.second.compliance)

    @property
    def radius(self) -> float:
        """R [mm]: ``1/R = 1/R1 + 1/R2``."""
        return 1 / (1 / self.first.radius + 1 / self.second.radius)

    @property
    def contact_radius(self) -> float:
        """The radius a [mm]: ``a^3 = 3 F R / (4 E*)``."""
        return float(np.cbrt(3 * self.force * self.radius / (4 * self.modulus)))

    @property
    def approach(self) -> float:
        """The distance by which remote points of the two bodies approach each other [mm]: ``a^2 / R``."""
        return self.contact_radius**2 / self.radius

    @property
    def peak_pressure(self) -> float:
        """p0 [MPa]: ``3 F / (2 pi a^2)``, at the centre."""
        return 3 * self.force / (2 * math.pi * self.contact_radius**2)

    def pressure(self, distance: Floats) -> Floats:
        """The pressure [MPa] at a ``distance`` [mm] from the centre: ``p0 sqrt(1 - (r/a)^2)``, zero outside."""
        return self.peak_pressure * np.sqrt(np.maximum(1 - (distance / self.contact_radius) ** 2, 0))

    def sunk(self, side: Side, distance: Floats) -> Floats:
        """The depression of the surface of ``side`` [mm] at a ``distance`` r [mm]: with ``q = (1 - nu^2)/E p0 / (2 a)``,
        ``q pi/2 (2 a^2 - r^2)`` in the contact, ``q ((2 a^2 - r^2) asin(a/r) + a sqrt(r^2 - a^2))`` outside.
        """
        a = self.contact_radius
        far = np.maximum(distance, a)
        shape = (2 * a**2 - distance**2) * np.arcsin(a / far) + a * np.sqrt(far**2 - a**2)
        return np.asarray(side.compliance * self.peak_pressure / (2 * a) * shape)


def rigid_sphere(radius: float, young: float, poisson: float, force: float) -> Hertz:
    """A rigid sphere of ``radius`` [mm] pressed by ``force`` [N] into a half-space, the ``second`` body, with ``young`` [MPa] and
    ``poisson``.
    """
    return Hertz(Side(radius, math.inf, 0.0), Side(math.inf, young, poisson), force)


def force_at(radius: float, young: float, poisson: float, approach: float) -> float:
    """The force [N] that presses a rigid sphere of ``radius`` R [mm] into a half-space by ``approach`` d [mm]:
    ``4/3 E* sqrt(R) d^(3/2)``, ``E* = young / (1 - poisson^2)``.
    """
    return 4 / 3 * young / (1 - poisson**2) * math.sqrt(radius * approach) * approach
