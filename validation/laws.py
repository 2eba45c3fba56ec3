"""Energies and stresses of the material laws.

A law gives energy per unit rest volume [MPa] and first Piola-Kirchhoff stress [MPa] at a deformation gradient F (3, 3), with
``fibre``, the unit vector (3,) along the fibres at rest. It evaluates one point at a time; ``P = dW/dF`` is derived by hand, with

    I1bar = J^(-2/3) tr C,  I2bar = J^(-4/3) ((tr C)^2 - tr C^2) / 2,

    d I1bar / dF = 2 J^(-2/3) (F - I1/3 F^-T)                      (Holzapfel 2000, Nonlinear Solid Mechanics, ch. 6.4)
    d I2bar / dF = 2 J^(-4/3) (I1 F - F C - 2/3 I2 F^-T)

No digitisation error: the numbers follow from the formulas. Laws of the fibre stretch alone are in ``validation/fibre_laws.py``,
states of a body in ``validation/homogeneous.py``.
"""

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
X = np.array([1.0, 0.0, 0.0])


class Law(Protocol):
    """A material law: its energy and its stress."""

    def energy(self, F: Floats, fibre: Floats) -> float:
        """Energy per unit rest volume [MPa]."""

    def stress(self, F: Floats, fibre: Floats) -> Floats:
        """First Piola-Kirchhoff stress (3, 3) [MPa], ``P[i, k]`` the force along i per unit rest area with the normal k."""


def _invariants(F: Floats) -> tuple[float, float, float]:
    """J and the invariants I1 and I2 of C, not isochoric."""
    C = F.T @ F
    return np.linalg.det(F), np.trace(C), (np.trace(C) ** 2 - np.trace(C @ C)) / 2


@dataclass(frozen=True)
class MooneyRivlin:
    """``c1 (I1bar - 3) + c2 (I2bar - 3)``; c1, c2 [MPa]; the shear modulus at rest is ``2 (c1 + c2)``.

    Source: Mooney 1940, doi 10.1063/1.1712836; isochoric as in Holzapfel 2000, ch. 6.5.
    """

    c1: float
    c2: float

    def energy(self, F: Floats, fibre: Floats) -> float:  # noqa: ARG002
        """Energy per unit rest volume [MPa]."""
        J, I1, I2 = _invariants(F)
        return float(self.c1 * (J ** (-2 / 3) * I1 - 3) + self.c2 * (J ** (-4 / 3) * I2 - 3))

    def stress(self, F: Floats, fibre: Floats) -> Floats:  # noqa: ARG002
        """First Piola-Kirchhoff stress (3, 3) [MPa]."""
        (J, I1, I2), back = _invariants(F), np.linalg.inv(F).T
        first = 2 * J ** (-2 / 3) * (F - I1 / 3 * back)
        second = 2 * J ** (-4 / 3) * (I1 * F - F @ F.T @ F - 2 / 3 * I2 * back)
        return np.asarray(self.c1 * first + self.c2 * second)


def neo_hooke(mu: float) -> MooneyRivlin:
    """``mu/2 (I1bar - 3)``; mu [MPa]. Source: Holzapfel 2000, Nonlinear Solid Mechanics, ch. 6.5."""
    return MooneyRivlin(mu / 2, 0.0)


def isochoric(F: Floats, slope: Floats) -> Floats:
    """First Piola-Kirchhoff stress (3, 3) [MPa] of an energy of ``Ebar = (J^(-2/3) C - I)/2`` with derivative ``slope`` S (3, 3):
    ``J^(-2/3) (F S - (S : C)/3 F^-T)``. Source: Holzapfel 2000, Nonlinear Solid Mechanics, section 6.4.
    """
    part = np.sum(slope * (F.T @ F)) / 3
    return np.asarray(np.linalg.det(F) ** (-2 / 3) * (F @ slope - part * np.linalg.inv(F).T))


@dataclass(frozen=True)
class ActiveTension:
    """``T/2 (J^(-2/3) |F a|^2 - 1)``: at J = 1 a constant second Piola-Kirchhoff stress T [MPa] along the fibre, and a pressure.

    Source: Land et al. 2015, problem 3, doi 10.1098/rspa.2015.0641.
    """

    tension: float

    def energy(self, F: Floats, fibre: Floats) -> float:
        """Energy per unit rest volume [MPa]."""
        return float(self.tension / 2 * (np.linalg.det(F) ** (-2 / 3) * np.sum((F @ fibre) ** 2) - 1))

    def stress(self, F: Floats, fibre: Floats) -> Floats:
        """First Piola-Kirchhoff stress (3, 3) [MPa]."""
        return isochoric(F, self.tension * np.outer(fibre, fibre))


@dataclass(frozen=True)
class HolzapfelOgden:
    """Two families of fibres at +-``angle`` [rad] to the fibre, rotated about the component of ``normal`` across the fibre:
    ``sum of k1/(2 k2) (exp(k2 (I4bar - 1)^2) - 1)`` if ``I4bar = J^(-2/3) |F a|^2 > 1``, else 0; k1 [MPa].

    Source: Holzapfel, Gasser, Ogden 2000, doi 10.1023/A:1010835316564.
    """

    k1: float
    k2: float
    angle: float
    normal: tuple[float, float, float]

    def families(self, fibre: Floats) -> Floats:
        """The unit vectors of both families, (2, 3)."""
        across = np.cross(self.normal, fibre)
        across = across / np.linalg.norm(across)
        return np.array([np.cos(self.angle) * fibre + side * np.sin(self.angle) * across for side in (1, -1)])

    def energy(self, F: Floats, fibre: Floats) -> float:
        """Energy per unit rest volume [MPa]."""
        squares = np.linalg.det(F) ** (-2 / 3) * np.sum((self.families(fibre) @ F.T) ** 2, axis=1)
        return float(np.sum(self.k1 / (2 * self.k2) * np.expm1(self.k2 * np.maximum(squares - 1, 0) ** 2)))

    def stress(self, F: Floats, fibre: Floats) -> Floats:
        """First Piola-Kirchhoff stress (3, 3) [MPa]."""
        shrink, total = np.linalg.det(F) ** (-2 / 3), np.zeros((3, 3))
        for along in self.families(fibre):
            square = np.sum((F @ along) ** 2)
            excess = max(shrink * square - 1, 0.0)
            slope = self.k1 * excess * np.exp(self.k2 * excess**2)
            total += slope * shrink * (2 * np.outer(F @ along, along) - 2 / 3 * square * np.linalg.inv(F).T)
        return total


@dataclass(frozen=True)
class Guccione:
    """``c/2 (exp(Q) - 1)``, ``Q = bf Eff^2 + bt (Ess^2 + Enn^2 + 2 Esn^2) + 2 bfs (Efs^2 + Efn^2)``, ``E = (J^(-2/3) C - I)/2``
    in axes along the fibre f and two across; c [MPa].

    Source: Guccione, McCulloch, Waldman 1991, doi 10.1115/1.2894084; as in Land et al. 2015, doi 10.1098/rspa.2015.0641.
    """

    c: float
    bf: float
    bt: float
    bfs: float

    def _along_axes(self, F: Floats, fibre: Floats) -> tuple[Floats, Floats, Floats]:
        """Axes (3, 3) as columns, the fibre first; E in these axes; and the factor of each squared entry of E."""
        axes = np.linalg.qr(np.column_stack([fibre, np.eye(3)]))[0]
        b = np.full((3, 3), self.bt)
        b[0, :], b[:, 0], b[0, 0] = self.bfs, self.bfs, self.bf
        return axes, axes.T @ (np.linalg.det(F) ** (-2 / 3) * F.T @ F - np.eye(3)) @ axes / 2, b

    def energy(self, F: Floats, fibre: Floats) -> float:
        """Energy per unit rest volume [MPa]."""
        _, E, b = self._along_axes(F, fibre)
        return float(self.c / 2 * np.expm1(np.sum(b * E**2)))

    def stress(self, F: Floats, fibre: Floats) -> Floats:
        """First Piola-Kirchhoff stress (3, 3) [MPa]; the derivative of the energy with respect to E is ``c exp(Q) b E``."""
        axes, E, b = self._along_axes(F, fibre)
        return isochoric(F, axes @ (self.c * np.exp(np.sum(b * E**2)) * b * E) @ axes.T)


@dataclass(frozen=True)
class Prestretched:
    """``law`` at ``F Fp``, ``Fp = l a (x) a + l^(-1/2) (I - a (x) a)``: at rest its fibres have the stretch l = ``stretch``.

    Source: multiplicative split as in Rodriguez, Hoger, McCulloch 1994, doi 10.1016/0021-9290(94)90021-3.
    """

    law: Law
    stretch: float

    def _fitted(self, fibre: Floats) -> Floats:
        along = np.outer(fibre, fibre)
        return np.asarray(self.stretch * along + self.stretch**-0.5 * (np.eye(3) - along))

    def energy(self, F: Floats, fibre: Floats) -> float:
        """Energy per unit rest volume [MPa]."""
        return self.law.energy(F @ self._fitted(fibre), fibre)

    def stress(self, F: Floats, fibre: Floats) -> Floats:
        """First Piola-Kirchhoff stress (3, 3) [MPa]: that of ``law`` times ``Fp^T``."""
        fitted = self._fitted(fibre)
        return self.law.stress(F @ fitted, fibre) @ fitted.T


@dataclass(frozen=True)
class Together:
    """Several laws in parallel: their energies add up."""

    laws: tuple[Law, ...]

    def energy(self, F: Floats, fibre: Floats) -> float:
        """Energy per unit rest volume [MPa]."""
        return sum(law.energy(F, fibre) for law in self.laws)

    def stress(self, F: Floats, fibre: Floats) -> Floats:
        """First Piola-Kirchhoff stress (3, 3) [MPa]."""
        return np.asarray(sum(law.stress(F, fibre) for law in self.laws))
