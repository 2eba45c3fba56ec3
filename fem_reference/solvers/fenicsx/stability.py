"""Stability of a state of equilibrium: the number of directions in which its energy falls."""

import numpy as np
from dolfinx import fem
from mpi4py import MPI
from petsc4py import PETSc

from fem_reference.effects import Load
from fem_reference.foundations.mesh import Floats, Ints
from fem_reference.problems.body import Body
from fem_reference.solvers.fenicsx.linear import Factorised, LinearSolveError, LinearSolver
from fem_reference.solvers.fenicsx.system import System

_ITERATIONS = 40  # of inverse iteration


def has_energy(body: Body) -> bool:
    """True where all effects on ``body`` have an energy, so that its tangent is symmetric; loads may have none."""
    return not any(isinstance(effect, Load) for effect in body.effects)


def softest(linear: LinearSolver, system: System, displacement: Ints) -> PETSc.Vec:
    """The mode of the least eigenvalue, by magnitude, of the matrix of ``linear``; its displacements have length 1.

    Inverse iteration from a random start; ``displacement``: the unknowns that have a mass. ``LinearSolveError`` where no unknown
    is free to move.
    """
    comm, moves = system.unknowns.function_space.mesh.comm, np.zeros(system.size)
    moves[displacement.ravel()] = 1.0
    moves[system.fixed] = 0.0
    moves = moves[: system.owned]
    if not comm.allreduce(moves.any(), MPI.LOR):
        raise LinearSolveError("nothing is left to move")
    vector: PETSc.Vec = system.b.duplicate()
    image: PETSc.Vec = system.b.duplicate()
    image.array[:] = moves * np.random.default_rng(comm.rank).normal(size=len(moves))
    for _ in range(_ITERATIONS):
        vector.array[:] = image.array * moves
        vector.normalize()
        linear.solve(vector, image, 1e-10)
    vector.array[:] = image.array * moves
    image.scale(float(vector.dot(vector)) ** -0.5)
    return image


def displacements(mode: PETSc.Vec, system: System, displacement: Ints) -> Floats:
    """The displacements (n, 3) of the nodes of this rank in a ``mode``, whose unknowns are ``displacement`` (n, 3)."""
    found: Floats = np.zeros(system.size)
    found[: system.owned] = mode.array
    return found[displacement]


class Stability:
    """The inertia of the tangent of a ``system``, from an LDL^T factorisation that ``linear`` uses afterwards.

    An unknown pressure p has the energy ``p (J - 1) - p^2 / 2K`` and takes one negative pivot of its own, -1/K. The others are
    the negative modes of the displacement with its own pressure (Haynsworth 1968, doi 10.1016/0024-3795(68)90050-5).
    Prescribed unknowns have pivots of 1.
    """

    def __init__(self, system: System, linear: Factorised, unknowns: fem.Function) -> None:
        space = unknowns.function_space
        self.system, self.linear = system, linear
        self.pressures = space.sub(1).collapse()[0].dofmap.index_map.size_global if space.num_sub_spaces > 1 else 0

    def of_material(self) -> float:
        """The ``negative_modes`` that the material certainly has: those in which the energy also falls where the pressure follows
        the volume at every point. Pressures of an element control the volume on average only: shrinking in one place and swelling
        in another costs nothing, and under a stress of several shear moduli the energy may fall that way although that of the
        material does not. The elements' displacements are a subset of the body's, which has at least this many modes.
        """
        found = self._counted(pointwise=self.pressures > 0)
        self._counted()  # the next solve finds the tangent and its factors unchanged
        return found

    def negative_modes(self) -> float:
        """The number of directions in which the energy falls from the present state; NaN where the tangent is singular."""
        return self._counted()

    def _counted(self, *, pointwise: bool = False) -> float:
        self.system.linearise(pointwise=pointwise)
        self.linear.changed()
        try:
            return float(self.linear.negative_pivots() - self.pressures)
        except LinearSolveError:
            return float(np.nan)
