"""Departure from an unstable equilibrium along its lowest mode, to a state with fewer negative modes."""

import numpy as np
from mpi4py import MPI
from petsc4py import PETSc

from fem_reference.foundations.mesh import Floats, diagonal
from fem_reference.solvers.fenicsx.body import AssembledBody
from fem_reference.solvers.fenicsx.linear import Factorised
from fem_reference.solvers.fenicsx.spent import Spent
from fem_reference.solvers.fenicsx.stability import displacements, softest

_LARGER = (1, 2, 4, 8)  # factors of the perturbation, tried in turn where the state returns or no solution is found
_SHIFT, _GROWTH = 1e-6, 4.0


def leave(body: AssembledBody, frame: float, share: float) -> float | None:
    """Perturb the present state, that of ``frame``, by a ``share`` of the body's size along its lowest mode, and solve again
    until there are fewer negative modes. The perturbation [mm]; None where the state is stable or no other was found. Collective.
    """
    if body.stability is None or not (modes := body.stability.negative_modes()) > 0:
        return None
    before, body.system.contact = np.array(body.unknowns.x.array), body.contact
    direction, size = lowest(body), share * diagonal(body.nodes.cells.points)
    for amount in (sign * larger * size for larger in _LARGER for sign in (1, -1)):
        body.unknowns.x.array[:] = before + amount * direction
        body.unknowns.x.scatter_forward()
        if body.contact:
            body.contact.update(frame)
        found = body.newton.solve(frame)
        if found.converged and body.determinants.smallest().value > 0 and body.stability.negative_modes() < modes:
            body.path.settle(body.energy(), connected=False)
            if body.contact:
                body.contact.settle()
            return float(abs(amount))
        body.go_back(before)
    body.system.linearise()
    return None


def lowest(body: AssembledBody) -> Floats:
    """The displacement of the unknowns (n,), 1 mm at most, along which the energy falls most. Inverse iteration, with a shift
    that makes the tangent definite.
    """
    system, stability, dofs = body.system, body.stability, body.displacement.dofs
    assert stability is not None  # called only where modes are counted
    system.linearise()
    free, diagonal = np.zeros(system.size), system.b.duplicate()
    free[dofs.ravel()] = 1.0
    free[system.fixed] = 0.0
    mask = free[: system.owned]
    system.matrix.getDiagonal(diagonal)
    total, count = body.comm.allreduce(np.array([np.abs(diagonal.array * mask).sum(), mask.sum()]), MPI.SUM)
    shift = _SHIFT * total / count
    while (solver := _shifted(system.matrix, shift * mask, body.spent)).negative_pivots() > stability.pressures:
        shift *= _GROWTH
    moves = np.where(system.fixed[dofs], 0.0, displacements(softest(solver, system, dofs), system, dofs))
    found = np.zeros(system.size)
    high, low = (
        body.comm.allreduce(moves.max(initial=0.0), MPI.MAX),
        body.comm.allreduce(moves.min(initial=0.0), MPI.MIN),
    )
    found[dofs] = moves / (high if high >= -low else low)
    return found


def _shifted(matrix: PETSc.Mat, shift: Floats, spent: Spent) -> Factorised:
    """The factors of the matrix with ``shift`` (n,) added to its diagonal."""
    raised, diagonal = matrix.duplicate(copy=True), matrix.getDiagonal()
    diagonal.array[:] += shift
    raised.setDiagonal(diagonal)
    raised.setOption(PETSc.Mat.Option.SYMMETRIC, True)  # type: ignore[arg-type]  # the type that the stubs declare
    return Factorised(raised, True, False, "double", spent)
