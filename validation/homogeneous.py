"""Homogeneous states of a body with a law (``validation/laws.py``) and a finite bulk modulus: ``W(F) + K/2 (J - 1)^2``.

Free stretches, along which no stress acts, are found by root finding until the residual stress is at most 1e-13 of the bulk
modulus. The mixed form ``p (J - 1) - p^2 / (2 K)`` has the same states, with ``p = K (J - 1)``.

Source: Ogden 1984, Non-linear Elastic Deformations, ch. 4.3 (homogeneous deformations). No digitisation error.
"""

from dataclasses import dataclass

import numpy as np
from scipy.optimize import root

from validation.laws import Floats, Law, X

FREE = np.nan


@dataclass(frozen=True, eq=False)
class Homogeneous:
    """A state: the deformation gradient ``F`` and the nominal (first Piola-Kirchhoff) stress ``P`` [MPa], each (3, 3)."""

    F: Floats
    P: Floats

    @property
    def stretches(self) -> Floats:
        """The stretches along x, y, z, (3,)."""
        return np.diag(self.F)


def nominal_stress(law: Law, bulk: float, F: Floats, fibre: Floats) -> Floats:
    """The stress ``P = dW/dF + K (J - 1) J F^-T`` (3, 3) [MPa] at ``F`` (3, 3), with a ``fibre`` (3,) and K = ``bulk`` [MPa]."""
    J = np.linalg.det(F)
    return np.asarray(law.stress(F, fibre) + bulk * (J - 1) * J * np.linalg.inv(F).T)


def uniaxial(law: Law, bulk: float, stretch: float, fibre: Floats = X) -> Homogeneous:
    """Stretched along x, free along y and z (whose stretches may differ); the stress is ``P[0, 0]``."""
    return _fixed(law, bulk, fibre, (stretch, FREE, FREE))


def equibiaxial(law: Law, bulk: float, stretch: float, fibre: Floats = X) -> Homogeneous:
    """Stretched equally along x and y, free along z; the stresses are ``P[0, 0]`` and ``P[1, 1]``."""
    return _fixed(law, bulk, fibre, (stretch, stretch, FREE))


def planar(law: Law, bulk: float, stretch: float, fibre: Floats = X) -> Homogeneous:
    """Pure shear: stretched along x, fixed along y, free along z."""
    return _fixed(law, bulk, fibre, (stretch, 1.0, FREE))


def simple_shear(law: Law, bulk: float, amount: float, fibre: Floats = X) -> Homogeneous:
    """Simple shear ``x = X + amount Y`` at constant volume, with no free stretch; the shear stress is ``P[0, 1]``."""
    F = np.eye(3)
    F[0, 1] = amount
    return Homogeneous(F, nominal_stress(law, bulk, F, fibre))


def pulled(law: Law, bulk: float, nominal: float, fibre: Floats = X) -> Homogeneous:
    """Pulled along x by a ``nominal`` stress [MPa], free along y and z; 0 for a muscle that shortens freely.

    If several states have the same stress, the result is the state that is reached when the stress increases from 0.
    """
    state = _fixed(law, bulk, fibre, (FREE, FREE, FREE))
    for share in np.linspace(0, 1, 33)[1:] if nominal else ():
        state = _fixed(law, bulk, fibre, (FREE, FREE, FREE), share * nominal, np.log(state.stretches))
    return state


def _fixed(
    law: Law,
    bulk: float,
    fibre: Floats,
    stretches: tuple[float, float, float],
    nominal: float = 0.0,
    guess: Floats | None = None,
) -> Homogeneous:
    """The state at ``stretches`` along x, y, z. Along a ``FREE`` stretch the stress is 0, except along x, where it is ``nominal``;
    ``guess``: the logarithms of the free stretches.
    """
    given = np.array(stretches)
    free = np.isnan(given)
    target = np.array([nominal, 0.0, 0.0])

    def gradient(logs: Floats) -> Floats:
        found = given.copy()
        found[free] = np.exp(logs)
        return np.diag(found)

    def unbalanced(logs: Floats) -> Floats:
        stress = nominal_stress(law, bulk, gradient(logs), np.asarray(fibre))
        return np.asarray((np.diag(stress) - target)[free])

    if guess is None:
        guess = np.full(free.sum(), -np.log(given[~free]).sum() / free.sum())
    found = root(unbalanced, guess, options={"xtol": 1e-15}).x
    left, F = np.abs(unbalanced(found)).max(), gradient(found)
    P = nominal_stress(law, bulk, F, np.asarray(fibre))
    if not left <= 1e-13 * (bulk + np.abs(P).max()):
        raise ArithmeticError(f"no homogeneous state found: {left:.1e} MPa left of the stress")
    if np.abs(P - np.diag(np.diag(P))).max() > 1e-9 * (bulk + np.abs(P).max()):
        raise ValueError(f"fibre: got {fibre}, want fibres that no stretch along the axes turns")
    return Homogeneous(F, P)
