"""Leaving an unstable equilibrium: along the direction in which the energy falls most, to where it falls in fewer."""

import numpy as np
from mpi4py import MPI
from petsc4py import PETSc

from fem_reference.foundations.mesh import Floats
from fem_reference.solvers.fenicsx.body import AssembledBody
from fem_reference.solvers.fenicsx.linear import Factorised

_LARGER = (1, 2, 4, 8)  # how much larger perturbations are tried, where the state comes back or none is found
_SHIFT, _GROWTH, _ITERATIONS = 1e-6, 4.0, 40


def leave(body: AssembledBody, frame: float, share: float) -> float | None:
    """Perturb the present state, that of a ``frame``, by a ``share`` of the body's size along its lowest mode, and solve anew until
    there are fewer negative modes; the perturbation [mm], None where the state is stable or nothing else was found. Collective.
    """
    if body.stability is None or not (modes := body.stability.negative_modes()) > 0:
        return None
    before, body.system.contact = np.array(body.unknowns.x.array), body.contact
    direction, size = lowest(body), share * _size(body)
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
        body.unknowns.x.array[:] = before
        if body.contact:
            body.contact.go_back()
    body.system.linearise()
    return None


def lowest(body: AssembledBody) -> Floats:
    """The displacement of the unknowns (n,), 1 mm at most, along which the energy falls most: by inverse iteration with a shift
    that makes the tangent definite.
    """
    system, stability = body.system, body.stability
    assert stability is not None  # asked for only where modes are counted
    system.linearise()
    free = np.zeros(system.size)
    free[body.displacement.dofs.ravel()] = 1.0
    free[system.fixed] = 0.0
    mask, diagonal = system.b.duplicate(), system.b.duplicate()
    mask.array[:] = free[: system.owned]
    system.matrix.getDiagonal(diagonal)
    sums = np.array([np.abs(diagonal.array * mask.array).sum(), mask.array.sum()])
    total, count = body.comm.allreduce(sums, MPI.SUM)
    shift = _SHIFT * total / count
    while True:
        solver = _shifted(system.matrix, diagonal, mask, shift, body)
        if solver.negative_pivots() <= stability.pressures:
            break
        shift *= _GROWTH
    vector, image = system.b.duplicate(), system.b.duplicate()
    vector.array[:] = mask.array * np.random.default_rng(body.comm.rank).normal(size=len(mask.array))
    for _ in range(_ITERATIONS):
        vector.normalize()
        solver.solve(vector, image, 1e-10)
        vector.array[:] = image.array * mask.array
    return _largest_is_one(vector, body)


def _shifted(matrix: PETSc.Mat, diagonal: PETSc.Vec, mask: PETSc.Vec, shift: float, body: AssembledBody) -> Factorised:
    raised, moved = matrix.duplicate(copy=True), diagonal.duplicate()
    moved.array[:] = diagonal.array + shift * mask.array
    raised.setDiagonal(moved)
    raised.setOption(PETSc.Mat.Option.SYMMETRIC, True)  # type: ignore[arg-type]  # as its stubs have it
    return Factorised(raised, True, False, "double", body.spent)


def _largest_is_one(vector: PETSc.Vec, body: AssembledBody) -> Floats:
    """The vector over this rank's unknowns (n,), its greatest entry 1."""
    found: Floats = np.array(body.unknowns.x.array) * 0
    found[: body.system.owned] = vector.array
    ends = body.comm.allgather((found.max(initial=0.0), found.min(initial=0.0)))
    high, low = max(end[0] for end in ends), min(end[1] for end in ends)
    found /= high if high >= -low else low
    return found


def _size(body: AssembledBody) -> float:
    """The diagonal of the box around the body at rest [mm]."""
    points = body.mesh.geometry.x
    low = [body.comm.allreduce(float(axis.min(initial=np.inf)), MPI.MIN) for axis in points.T]
    high = [body.comm.allreduce(float(axis.max(initial=-np.inf)), MPI.MAX) for axis in points.T]
    return float(np.linalg.norm(np.subtract(high, low)))
