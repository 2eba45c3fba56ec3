"""Whether a state is a stable equilibrium: how many directions there are in which its energy falls."""

from typing import Any

import numpy as np
from dolfinx import fem
from dolfinx.fem.petsc import NonlinearProblem, assign

from fem_reference.continuum import Continuum
from fem_reference.effects import Load

# What MUMPS calls its entries: its error; negative pivots; the last front, by one process, else those of it are not counted.
_ERROR, _NEGATIVE, _ROOT_BY_ONE = 1, 12, 13


def has_energy(body: Continuum) -> bool:
    """Whether all that acts on ``body`` has an energy, so that its tangent is symmetric; loads may have none."""
    return not any(isinstance(effect, Load) for effect in body.effects)


class Stability:
    """The inertia of the tangent of ``newton``, by the LDL^T factorisation that solves it.

    An unknown pressure p has the energy ``p (J - 1) - p^2 / 2K`` and takes one negative pivot of its own, -1/K; what is left are
    the negative modes of the displacement with the pressure that belongs to it (Haynsworth 1968, doi 10.1016/0024-3795(68)90050-5).
    What is prescribed has pivots of 1.
    """

    def __init__(self, newton: NonlinearProblem, unknowns: fem.Function) -> None:
        space = unknowns.function_space
        self.newton = newton
        self.pressures = space.sub(1).collapse()[0].dofmap.index_map.size_global if space.num_sub_spaces > 1 else 0
        self.factors = _factors(newton)

    def negative_modes(self) -> float:
        """In how many directions the energy falls from the present state; NaN where the tangent is singular."""
        newton = self.newton
        assign(newton.u, newton.x)
        newton.solver.computeJacobian(newton.x, newton.A)
        newton.solver.getKSP().getPC().setUp()
        if self.factors.getMumpsInfog(_ERROR) < 0:
            return float(np.nan)
        return float(self.factors.getMumpsInfog(_NEGATIVE) - self.pressures)


def _factors(newton: NonlinearProblem) -> Any:
    preconditioner = newton.solver.getKSP().getPC()
    preconditioner.setOperators(newton.A, newton.A)
    preconditioner.setFactorSetUpSolverType()
    factors = preconditioner.getFactorMatrix()
    factors.setMumpsIcntl(_ROOT_BY_ONE, 1)
    return factors
