"""Newton's method: inexact if this saves time, and damped if a full step would invert a cell."""

import numpy as np

from fem_reference.foundations.mesh import Floats
from fem_reference.runs.contents import Status
from fem_reference.solvers.common.load_steps import Attempt
from fem_reference.solvers.fenicsx.contact import ContactForces, Tractions
from fem_reference.solvers.fenicsx.determinants import Determinants
from fem_reference.solvers.fenicsx.linear import LinearSolveError
from fem_reference.solvers.fenicsx.multigrid import LinearSolver
from fem_reference.solvers.fenicsx.settings import BodySettings
from fem_reference.solvers.fenicsx.system import System

# A step is halved until det F keeps _KEPT times its value at every point, or the step is shorter than _SHORTEST times a full step.
_KEPT, _SHORTEST = 0.1, 1e-2
# Eisenstat and Walker 1996 (doi 10.1137/0917003), choice 2: the tolerance of the first linear system, then the factor of later
# tolerances and their bounds.
_FIRST, _FACTOR, _LOOSEST, _TIGHTEST = 1e-3, 0.5, 1e-3, 1e-9
# Newton's method gives up if the residual has not fallen to ``_PROGRESS`` times its earlier best within ``_PATIENCE`` iterations.
_PATIENCE, _PROGRESS = 6, 0.5
# If the tolerance of a linear system is below the target of Newton's method, it is lowered to this fraction of the target: the
# residual of the last linear system is what remains at the end of the iteration.
_PAST = 1e-2


class Newton:
    """Newton's method on a ``system``; ``linear`` solves for the full steps. There is no line search: it would weigh forces [N]
    against volumes [mm3], and would stall for bodies that bend or are soft.
    """

    def __init__(
        self, system: System, linear: LinearSolver, determinants: Determinants, settings: BodySettings
    ) -> None:
        self.system, self.linear, self.determinants = system, linear, determinants
        self.residual, self.most = settings.residual, settings.newton_iterations
        self.step = system.b.duplicate()
        self.thrown = 0

    def solve_among(self, contact: ContactForces | None, frame: float) -> Attempt:
        """Solve as ``solve`` does, at first without ``contact`` if the current state has no contact pressure. If the result has no
        contact pressure either, it is final, as contact would give the same result. Otherwise it is discarded, and its iterations
        count as ``thrown``, as they do not show how hard the load step is.
        """
        system, before = self.system, np.array(self.system.unknowns.x.array)
        system.contact = contact if contact and contact.presses() else None
        found = self.solve(frame)
        if contact is None or system.contact is not None:
            return found
        if found.converged:
            contact.update(frame)
            if not contact.presses():
                return found
        system.unknowns.x.array[:], system.contact = before, contact
        contact.go_back()
        if system.touching:
            system.touching.go_back()
        self.thrown += found.iterations
        return self.solve(frame)

    def solve(self, frame: float) -> Attempt:
        """Solve at ``frame``. The attempt ends if even the shortest step inverts a cell."""
        smallest, last = self.determinants.values_now(), np.nan
        residuals = [self._begin(frame)]
        while not residuals[-1] <= self.residual or self.system.lacking():
            if (why := self._hopeless(residuals)) is not None:
                return self._failed(residuals, why)
            scaled = self.system.b.norm()
            try:
                self.linear.solve(self.system.b, self.step, self._tolerance(scaled, last))
            except LinearSolveError as error:
                why = f"met a linear system that cannot be solved ({error}) in iteration {len(residuals)}"
                return self._failed(residuals, why)
            smallest, last = self._take(smallest), scaled
            if not self.determinants.everywhere(smallest > 0):
                why = f"turned a cell inside out in iteration {len(residuals)}, however short its step"
                return self._failed([*residuals, np.nan], why)
            self._meet(frame)
            norm = self.system.residual()
            residuals.append(norm if norm <= self.residual else self._linearise())
        return Attempt("converged", len(residuals) - 1, tuple(residuals))

    def _hopeless(self, residuals: list[float]) -> str | None:
        """The reason to stop iterating after ``residuals``; None to continue."""
        iterations = len(residuals) - 1
        if not np.isfinite(residuals[-1]):
            return f"reached in {iterations} iterations a state where a law, or a prescribed path, has no value"
        if iterations == self.most:
            return f"did not converge in {iterations} iterations"
        if (since := stalled(residuals)) > _PATIENCE:
            return f"made no progress in the last {since} of {iterations} iterations"
        return None

    def _failed(self, residuals: list[float], why: str) -> Attempt:
        """The record of a failed attempt, with status *inverted* if det F is not positive in its last state, else *diverged*."""
        status: Status = "diverged" if self.determinants.smallest().value > 0 else "inverted"
        return Attempt(status, len(residuals) - 1, tuple(residuals), f"Newton's method {why}")

    def _begin(self, frame: float) -> float:
        """Assemble the system of the first iteration.

        With the bones in their next poses, points that have not moved yet would overlap them, and the iteration would start from
        meaningless forces. The first system therefore has the contact pressures of the last state, changed to first order by the
        motion of the bones.
        """
        moves = -self.system.missing()
        if self.system.contact is None:
            return self._linearise(moves)
        norm = self._linearise(moves, self.system.contact.predicted(frame, moves))
        if norm <= self.residual:  # only new contact can drive the step, and only the new gaps show it
            self._meet(frame)
            norm = self._linearise(moves)
        return norm

    def _linearise(self, moves: Floats | None = None, tractions: Tractions | None = None) -> float:
        moves = -self.system.missing() if moves is None else moves
        return self.system.linearise(moves if moves.any() else None, tractions)

    def _meet(self, frame: float) -> None:
        if self.system.contact is not None:
            self.system.contact.update(frame)

    def _tolerance(self, norm: float, last: float) -> float:
        """The tolerance of the linear system, relative to the ``norm`` of its right-hand side; ``last`` is the previous norm."""
        if norm == 0 or last == 0:
            return _FIRST
        wanted = _FIRST if np.isnan(last) else float(np.clip(_FACTOR * (norm / last) ** 2, _TIGHTEST, _LOOSEST))
        # In linear systems the residual of a pressure is multiplied by the scale of the pressure.
        enough = self.residual * min(1.0, self.system.tangent.unit)
        if wanted * norm < enough:
            wanted = min(wanted, _PAST * enough / norm)
        return max(wanted, 1e-13)

    def _take(self, smallest: Floats) -> Floats:
        """Take the step, shortened as det F requires, and return det F after it."""
        unknowns, owned = self.system.unknowns.x, self.system.owned
        before, share = np.array(unknowns.array), 1.0
        step = np.where(self.system.fixed, self.system.missing(), 0.0)
        step[:owned] += np.where(self.system.fixed[:owned], 0.0, self.system.scale[:owned] * self.step.array)
        while True:
            unknowns.array[:owned] = before[:owned] - share * step[:owned]
            unknowns.scatter_forward()
            now = self.determinants.values_now()
            if self.determinants.everywhere(now > _KEPT * smallest) or share < _SHORTEST:
                return now
            share /= 2
            self.system.spent.counts["halved_steps"] += 1


def stalled(residuals: list[float]) -> int:
    """The number of ``residuals`` after the last one that fell below half of the best before it.

    >>> stalled([1.0]), stalled([1.0, 0.4, 0.1]), stalled([1.0, 0.4, 0.3, 2.0])
    (0, 0, 2)
    """
    best, since = np.inf, 0
    for norm in residuals:
        best, since = (norm, 0) if norm < _PROGRESS * best else (best, since + 1)
    return since
