"""The softest mode of a body: leaving an unstable equilibrium along it, and limit points, at which the mode's stiffness is 0.

At a limit point the path of equilibria ends: at a later frame there is no equilibrium nearby.
"""

from dataclasses import dataclass

import numpy as np
from mpi4py import MPI
from petsc4py import PETSc

from fem_reference.foundations.mesh import Floats, diagonal, place_of
from fem_reference.solvers.fenicsx.body import AssembledBody
from fem_reference.solvers.fenicsx.linear import Factorised, LinearSolveError
from fem_reference.solvers.fenicsx.multigrid import LinearSolver

_ITERATIONS = 40  # the number of inverse iterations
_LARGER = (1, 2, 4, 8)  # factors of the perturbation, tried in turn, with both signs, until a state is more stable
_SHIFT, _GROWTH = 1e-6, 4.0
_DIFFERENCE = 1e-3  # the interval for differences along the path, as a fraction of the smallest load step
# A limit point is reported if it is at most this many smallest load steps ahead: the step that failed was up to two of them long,
# and the distance is known only roughly.
_NEAR = 4
_SOFT = 0.3  # Near a limit point, the stiffness of the softest mode is at most this fraction of its value at rest.


def softest(body: AssembledBody, linear: LinearSolver) -> PETSc.Vec:
    """The mode of the matrix of ``linear`` whose eigenvalue has the smallest magnitude; its displacements have norm 1.

    It is found from a random start by inverse iteration, in which only displacements have a mass. Raises ``LinearSolveError`` if no
    displacement is free.
    """
    moves = _free(body)
    if not body.comm.allreduce(moves.any(), MPI.LOR):
        raise LinearSolveError("all displacements are prescribed")
    vector: PETSc.Vec = body.system.b.duplicate()
    image: PETSc.Vec = body.system.b.duplicate()
    image.array[:] = moves * np.random.default_rng(body.comm.rank).normal(size=len(moves))
    for _ in range(_ITERATIONS):
        vector.array[:] = image.array * moves
        vector.normalize()
        linear.solve(vector, image, 1e-10)
    vector.array[:] = image.array * moves
    image.scale(float(vector.dot(vector)) ** -0.5)
    return image


def _free(body: AssembledBody) -> Floats:
    """A vector with 1 for each displacement that this rank owns and that is not prescribed, 0 for every other unknown."""
    free = np.zeros(body.system.size)
    free[body.displacement.dofs.ravel()] = 1.0
    free[body.system.fixed] = 0.0
    return free[: body.system.owned]


def _displacements(body: AssembledBody, mode: PETSc.Vec) -> Floats:
    """The displacements (n, 3) of this rank's nodes in a ``mode``."""
    found = np.zeros(body.system.size)
    found[: body.system.owned] = mode.array
    return found[body.displacement.dofs]


def leave(body: AssembledBody, frame: float, share: float) -> float | None:
    """Perturb the current state, at ``frame``, along its lowest mode by ``share`` times the size of the body and solve again, until
    there are fewer negative modes. Returns the perturbation [mm]; None if the state is stable or no other is found. Collective.
    """
    if body.stability is None or not (modes := body.stability.negative_modes()) > 0:
        return None
    before, body.system.contact = np.array(body.unknowns.x.array), body.contact
    direction, size = _lowest(body, body.stability.pressures), share * diagonal(body.nodal.cells.points)
    for amount in (sign * larger * size for larger in _LARGER for sign in (1, -1)):
        body.unknowns.x.array[:] = before + amount * direction
        body.unknowns.x.scatter_forward()
        if body.contact:
            body.contact.update(frame)
        found = body.newton.solve(frame)
        if found.converged and body.determinants.smallest().value > 0 and body.stability.negative_modes() < modes:
            body.arrive(frame)
            return float(abs(amount))
        body.go_back(before)
    body.system.linearise()
    return None


def _lowest(body: AssembledBody, pressures: int) -> Floats:
    """The displacement (n,) of the unknowns, at most 1 mm, along which the energy decreases most, by inverse iteration. The
    diagonal is shifted until only ``pressures`` negative pivots remain, one for each pressure unknown.
    """
    system, free, dofs = body.system, _free(body), body.displacement.dofs
    system.linearise()
    entries = system.matrix.getDiagonal().array
    total, count = body.comm.allreduce(np.array([np.abs(entries * free).sum(), free.sum()]), MPI.SUM)
    shift = _SHIFT * total / count
    while (solver := _shifted(body, shift * free)).negative_pivots() > pressures:
        shift *= _GROWTH
    moves = np.where(system.fixed[dofs], 0.0, _displacements(body, softest(body, solver)))
    high = body.comm.allreduce(moves.max(initial=0.0), MPI.MAX)
    low = body.comm.allreduce(moves.min(initial=0.0), MPI.MIN)
    found = np.zeros(system.size)
    found[dofs] = moves / (high if high >= -low else low)
    return found


def _shifted(body: AssembledBody, shift: Floats) -> Factorised:
    """A factorisation of the tangent with ``shift`` (n,) added to its diagonal."""
    raised, entries = body.system.matrix.duplicate(copy=True), body.system.matrix.getDiagonal()
    entries.array[:] += shift
    raised.setDiagonal(entries)
    raised.setOption(PETSc.Mat.Option.SYMMETRIC, True)  # type: ignore[arg-type]  # a number in the stubs
    return Factorised(raised, True, False, "double", body.spent)


@dataclass(frozen=True)
class LimitPoint:
    """The ``frame`` of a limit point, and the rest position ``at`` [mm] of the largest displacement of the softest mode."""

    frame: float
    at: tuple[float, float, float]

    def __str__(self) -> str:
        return (
            f"the equilibrium reaches a limit point at frame {self.frame:.4g}, where the stiffness of its softest mode, "
            f"largest at {place_of(self.at)}, is 0: beyond it there is no equilibrium nearby, and the body snaps"
        )


def ahead(body: AssembledBody, step: float) -> LimitPoint | None:
    """The limit point that follows the last good state within a few load steps of the smallest size ``step``; None if there is
    none or it cannot be found. Collective.

    Before a limit point, the lowest eigenvalue of the tangent falls as the square root of the remaining path. Its square is
    therefore linear, and the remaining path is half of the eigenvalue divided by its slope along the path, as in a Newton step.
    """
    if body.stability is None or body.clock.matters:
        return None
    before = np.array(body.unknowns.x.array)
    try:
        found = _limit_point(body, step * _DIFFERENCE)
    except LinearSolveError:
        return None
    finally:
        body.set_frame(body.at)
        body.go_back(before)
    return found if found is not None and found.frame - body.at <= _NEAR * step else None


def _limit_point(body: AssembledBody, difference: float) -> LimitPoint | None:
    system, now, ends = body.system, body.unknowns.x.array, []
    start = np.array(now)
    body.set_frame(body.at)
    # The stiffness at rest and without contact, for comparison.
    now[:], system.contact = 0, None
    system.linearise()
    at_rest = _stiffness(body, softest(body, body.linear))
    now[:], system.contact = start, body.contact
    system.linearise()
    mode = softest(body, body.linear)
    stiffness = _stiffness(body, mode)
    if abs(stiffness) > _SOFT * at_rest:
        return None
    motion = _motion(body, difference)
    for sign in (1, -1):
        now[:] = start + sign * motion
        if body.contact:
            body.contact.update(body.at + sign * difference)
        system.linearise()
        ends.append(_stiffness(body, mode))
    slope = (ends[0] - ends[1]) / (2 * difference)
    left = -stiffness / (2 * slope) if slope != 0 else np.inf
    return LimitPoint(body.at + left, _largest(body, mode)) if 0 < left < np.inf else None


def _motion(body: AssembledBody, difference: float) -> Floats:
    """The first-order change (n,) of the unknowns from the current state over a small ``difference`` in frames."""
    system, frame = body.system, body.at + difference
    body.set_frame(frame)
    moves = -system.missing()
    system.linearise(moves, body.contact.predicted(frame, moves) if body.contact else None)
    step = system.b.duplicate()
    body.linear.solve(system.b, step, 1e-9)
    free = ~system.fixed[: system.owned]
    before = np.array(body.unknowns.x.array)
    body.unknowns.x.array[: system.owned] -= np.where(free, system.scale[: system.owned] * step.array, 0.0)
    body.unknowns.x.scatter_forward()
    found = np.asarray(body.unknowns.x.array - before + moves)
    body.unknowns.x.array[:] = before
    return found


def _stiffness(body: AssembledBody, mode: PETSc.Vec) -> float:
    """Twice the energy of a ``mode`` with the current tangent."""
    image = mode.duplicate()
    body.system.matrix.mult(mode, image)
    return float(image.dot(mode))


def _largest(body: AssembledBody, mode: PETSc.Vec) -> tuple[float, float, float]:
    """The rest position [mm] of the node with the largest displacement in a ``mode``."""
    lengths = np.linalg.norm(_displacements(body, mode), axis=1)
    place = body.displacement.space.tabulate_dof_coordinates()[np.argmax(lengths)].tolist()
    _, (x, y, z) = max(body.comm.allgather((float(lengths.max()), place)))
    return x, y, z
