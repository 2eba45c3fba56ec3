"""Cubes of a material in a homogeneous state, as at a single material point. The stress follows from the energies of effects."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import scipy

from fem_reference.effects import Effect, State, moduli, total_energy
from fem_reference.foundations.errors import InputError
from fem_reference.foundations.jets import JET_FUNCTIONS, variables
from fem_reference.foundations.mesh import Floats

FREE = None  # an axis along which no stress acts
# The allowed stress on free sides: a fraction of the maximum stress, plus a fraction of the bulk modulus for rounding.
_LEFT, _ROUNDING = 1e-8, 1e-13


@dataclass(frozen=True, eq=False)
class CubeState:
    """The deformation gradient ``F`` (3, 3) and the nominal stress ``P`` (3, 3) [MPa] of a cube."""

    F: Floats
    P: Floats

    @property
    def stretches(self) -> Floats:
        """The stretches (3,) along x, y and z."""
        return np.diag(self.F)

    def poisson_ratio(self, loaded: int, axis: int) -> float:
        """Minus the logarithmic strain along ``axis``, divided by the logarithmic strain along the axis ``loaded``."""
        return float(-np.log(self.stretches[axis]) / np.log(self.stretches[loaded]))


def nominal_stress(acting: Sequence[Effect], F: Floats, fibre: Floats) -> Floats:
    """The derivative (3, 3) [MPa] of the energies of all ``acting`` effects with respect to ``F`` (3, 3), exact up to rounding."""
    jets = variables(F.reshape(9, 1), curved=False)
    rows = [jets[3 * i : 3 * i + 3] for i in range(3)]
    energy = total_energy([(one, 1.0) for one in acting], State(F=rows, fibre=tuple(fibre), functions=JET_FUNCTIONS))
    return np.asarray(energy.slope.reshape(3, 3))


def loaded(acting: Sequence[Effect], stretches: Sequence[float | None], fibre: Floats) -> CubeState:
    """The state of a cube at ``stretches`` along x, y and z. A stretch is ``FREE`` along an axis without stress; at least one
    stretch is a number.

    The ``fibre`` direction is in the plane of x and y. If it is at an angle to the load, the cube is sheared (lines along y lean
    towards x) until no shear stress acts. It is then in tension or compression along x alone, like material far from the plates of
    a testing machine, which would prevent the shear. Raises ArithmeticError if no such state is found.
    """
    if not all(one is FREE or 0 < one < np.inf for one in stretches):
        raise InputError("stretches", stretches, "numbers above zero, or FREE")
    free = np.array([one is FREE for one in stretches])
    given = np.array([1.0 if one is FREE else one for one in stretches])
    start = np.append(np.full(free.sum(), -np.log(given[~free]).sum() / max(free.sum(), 1)), 0.0)

    def gradient(unknown: Floats) -> Floats:
        diagonal = given.copy()
        diagonal[free] = np.exp(unknown[:-1])
        F = np.diag(diagonal)
        F[0, 1] = unknown[-1]
        return F

    def left(unknown: Floats) -> Floats:
        F = gradient(unknown)
        cauchy = nominal_stress(acting, F, fibre) @ F.T
        return np.append(np.diag(cauchy)[free], cauchy[0, 1])

    found = scipy.optimize.root(left, start, options={"xtol": 1e-14}).x
    F = gradient(found)
    P = nominal_stress(acting, F, fibre)
    if not np.abs(left(found)).max() <= _LEFT * np.abs(P).max() + _ROUNDING * moduli(acting).bulk:
        raise ArithmeticError(
            f"no homogeneous state at stretches {stretches}: {np.abs(left(found)).max():.1e} MPa of residual stress"
        )
    return CubeState(F, P)
