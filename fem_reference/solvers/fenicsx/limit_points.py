"""Limit points: states at which a path of equilibria turns back in time, with no state near beyond."""

from dataclasses import dataclass

import numpy as np
from petsc4py import PETSc

from fem_reference.foundations.mesh import Floats, place_of
from fem_reference.solvers.fenicsx.body import AssembledBody
from fem_reference.solvers.fenicsx.linear import Factorised, LinearSolveError
from fem_reference.solvers.fenicsx.stability import displacements, softest

# The share of the smallest load step over which slopes are taken.
_DIFFERENCE = 1e-3
# In smallest load steps. One that failed was up to two of them, and the distance is known up to a factor.
_NEAR = 4
_SOFT = 0.3  # The largest share of its stiffness at rest that the softest mode keeps near a limit point.


@dataclass(frozen=True)
class LimitPoint:
    """The ``frame`` of a limit point, and the rest position [mm] where its mode moves most."""

    frame: float
    at: tuple[float, float, float]

    def __str__(self) -> str:
        return (
            f"the equilibrium comes to a limit point at frame {self.frame:.4g}, where the stiffness of its softest mode, "
            f"largest at {place_of(self.at)}, is 0: no state is near beyond it, and what follows is a snap"
        )


def ahead(body: AssembledBody, step: float) -> LimitPoint | None:
    """The limit point that follows the last good state within a few load steps of the smallest size ``step``; None where there is
    none or it cannot be known. Collective.

    Before a limit point the least eigenvalue of the tangent falls as the square root of the remaining path. So its square is
    linear, and the remaining path is half of the eigenvalue over its slope along the path. The slope is that of a Newton step.
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
    system, linear = body.system, body.linear
    assert isinstance(linear, Factorised)  # true where there is a stability
    body.set_frame(body.at)
    system.contact = body.contact
    system.linearise()
    linear.changed()
    mode = softest(body.linear, body.system, body.displacement.dofs)
    stiffness = _stiffness(body, mode)
    if abs(stiffness) > _SOFT * _stiffness_at_rest(body):
        return None
    motion = _motion(body, difference)
    now, ends = np.array(body.unknowns.x.array), []
    for sign in (1, -1):
        body.unknowns.x.array[:] = now + sign * motion
        if body.contact:
            body.contact.update(body.at + sign * difference)
        system.linearise()
        ends.append(_stiffness(body, mode))
    slope = (ends[0] - ends[1]) / (2 * difference)
    left = -stiffness / (2 * slope) if slope != 0 else np.inf
    return LimitPoint(body.at + left, _largest(body, mode)) if 0 < left < np.inf else None


def _stiffness_at_rest(body: AssembledBody) -> float:
    """The least eigenvalue at rest, without contact; the state is restored, except for the tangent."""
    now, body.system.contact = np.array(body.unknowns.x.array), None
    body.unknowns.x.array[:] = 0
    body.system.linearise()
    body.linear.changed()
    found = _stiffness(body, softest(body.linear, body.system, body.displacement.dofs))
    body.unknowns.x.array[:], body.system.contact = now, body.contact
    body.system.linearise()
    body.linear.changed()
    return found


def _motion(body: AssembledBody, difference: float) -> Floats:
    """The first-order change of the unknowns (n,) from the present state over a small ``difference`` in frames."""
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
    """Twice the energy of a ``mode`` by the present tangent."""
    image = mode.duplicate()
    body.system.matrix.mult(mode, image)
    return float(image.dot(mode))


def _largest(body: AssembledBody, mode: PETSc.Vec) -> tuple[float, float, float]:
    """The rest position [mm] at which a mode moves most."""
    lengths = np.linalg.norm(displacements(mode, body.system, body.displacement.dofs), axis=1)
    i = int(np.argmax(lengths))
    place = body.displacement.space.tabulate_dof_coordinates()[i].tolist()
    _, (x, y, z) = max(body.comm.allgather((float(lengths[i]), place)))
    return x, y, z
