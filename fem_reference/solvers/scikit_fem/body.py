"""Equilibria of bodies by Newton's method, with stress and stiffness by automatic differentiation (jets) of energies."""

import logging
import time
from dataclasses import dataclass
from typing import Annotated, Any

import numpy as np
from pydantic import Field
from scipy.sparse.linalg import splu

from fem_reference.effects import Load, in_situ
from fem_reference.foundations.errors import InputError
from fem_reference.foundations.mesh import Floats, Ints
from fem_reference.foundations.records import Record
from fem_reference.problems.body import ELEMENTS, Body, Prescribed
from fem_reference.problems.checks import check
from fem_reference.runs.store import Frame, Outcome, Sink
from fem_reference.solvers.common.load_steps import Attempt, Step, StepSizes, march
from fem_reference.solvers.common.protocol import Trade
from fem_reference.solvers.common.state_checks import Trouble
from fem_reference.solvers.scikit_fem.equations import Equations

log = logging.getLogger(__name__)

_HALVINGS = 10
_ROUNDING = 1e-14  # the rounding error of prescribed displacements, as a fraction of the size of the body
_GROWTH = 10.0  # a Newton step is halved if the residual grows by at least this factor


class ScikitBodySettings(Record):
    """Numerical settings for a body; the sizes of load steps are in frame numbers.

    ``element``: P1, P1/P1, P2, P2/P0 or P2/P1 (tetrahedra), Q1, Q1/P0, Q2 or Q2/Q1 (hexahedra). ``first_step``: the first load
    step, by default one step per frame. The size grows by half after an easy step (at most 5 Newton iterations). It is halved, down
    to ``smallest_step``, if Newton's method needs more than ``newton_iterations`` or a cell inverts. ``residual`` [N, mm3]:
    Newton's method ends when the norm of the residual (nodal forces, errors of the volume equation) is below this value.
    ``quadrature_degree``: polynomials of this degree are integrated exactly on a straight cell; the default suits the element.
    """

    element: Annotated[str, Trade(tuple(ELEMENTS))] = "P2/P1"
    first_step: float = Field(default=1e9, gt=0)
    smallest_step: float = Field(default=0.02, gt=0)
    newton_iterations: int = Field(default=14, gt=0)
    residual: float = Field(default=1e-8, gt=0)
    quadrature_degree: int | None = Field(default=None, gt=0)


def _check_known(body: Body) -> None:
    """Raise InputError if the body contains something that this solver does not support."""
    if body.contact is not None or body.touching:
        name, got = ("touching", "parts that touch") if body.touching else ("contact", "bones")
        raise InputError(name, got, "a body without contact, which this solver does not support")
    if any(not isinstance(entry.on, str) for entry in body.prescribed):
        want = "springs on facets, as this solver has no other springs"
        raise InputError("prescribed", "springs at points of a skin", want)
    if body.start is not None:
        raise InputError("start", "a state other than rest", "rest, from which this solver begins")
    timed = [effect.title for effect in body.effects if "interval" in effect.needs]
    if timed:
        raise InputError("effects", ", ".join(timed), "effects without rates, as this solver has no time steps")
    if in_situ.among(body.effects) is not None:
        want = "effects that leave the body at rest, as this solver does not support tension at rest"
        raise InputError("effects", "in_situ", want)
    if any(isinstance(effect, Load) and effect.stored for effect in body.effects):
        raise InputError("effects", "membrane", "other effects: this solver has no surface energies")


def solve(body: Body, settings: ScikitBodySettings, sink: Sink) -> Outcome:
    """Compute the states of ``body`` at its frames, up to the first frame that cannot be reached."""
    check(body, settings.element, settings.quadrature_degree)
    _check_known(body)
    begin = time.perf_counter()
    march_of = March(body, settings)
    sink(march_of.state(Step(body.frames[0])))
    counts = {"newton_iterations": 0.0, "load_steps": 0.0, "cut_backs": 0.0}

    def cost() -> dict[str, float]:
        return counts | {"seconds": time.perf_counter() - begin, "unknowns": float(march_of.equations.space.size)}

    sizes = StepSizes(settings.first_step, settings.smallest_step, stops=body.stops)
    for step in march(march_of.attempt, body.frames, sizes):
        for name, count in zip(counts, (step.iterations, step.steps, step.cutbacks), strict=True):
            counts[name] += count
        if not step.last.converged:
            sentence = f"{step.last.detail} beyond frame {step.at:.4g}; try other cells or a smaller motion"
            return Outcome(step.last.status, sentence, cost())
        sink(march_of.state(step))
        log.debug("frame %g: %d Newton iterations", step.frame, step.iterations)
    return Outcome("converged", f"all {len(body.frames)} frames reached", cost())


@dataclass(frozen=True, eq=False)
class _Tangent:
    """The linearised equations at ``unknowns`` (N,): the ``residual`` (N,) and its derivative, the ``matrix`` (N, N)."""

    unknowns: Floats
    residual: Floats
    matrix: Any

    def step(self, free: Ints, fixed: Ints, gap: Floats) -> Floats:
        """The Newton step (N,) in which the ``fixed`` unknowns change by ``gap`` (k,). Raises RuntimeError if it is not unique."""
        step = np.zeros_like(self.unknowns)
        step[fixed] = gap
        rows = self.matrix[free]
        step[free] = splu(rows[:, free].tocsc()).solve(-self.residual[free] - rows[:, fixed] @ gap)
        return step


class March:
    """The unknowns of a body on the load path through its frames."""

    def __init__(self, body: Body, settings: ScikitBodySettings) -> None:
        self.body, self.settings = body, settings
        self.equations = Equations(body, settings.element, settings.quadrature_degree)
        self.unknowns = np.zeros(self.equations.space.size)
        self.nodes = {entry.name: self.equations.space.nodes_on(str(entry.on)) for entry in body.prescribed}

    def attempt(self, frame: float) -> Attempt:
        """Solve at ``frame``, starting from the last converged state, which is restored if the attempt fails.

        A state in which det F is not positive, at a quadrature point or vertex, is *inverted* even if Newton's method converged.
        """
        with np.errstate(all="ignore"):  # a step to values that are not finite fails
            attempt, unknowns = self._newton(frame)
            if attempt.converged and (trouble := self._trouble(unknowns, frame)) is not None:
                attempt = attempt.refused(trouble)
        self.unknowns = unknowns if attempt.converged else self.unknowns
        return attempt

    def _trouble(self, unknowns: Floats, frame: float) -> Trouble | None:
        """The trouble with a state in equilibrium: inverted cells, or an energy that is not finite; None if there is none."""
        smallest = np.min(self.equations.smallest_determinants(unknowns))
        if not smallest > 0:
            return Trouble("inverted", f"det F fell to {smallest:.3g}")
        if not np.isfinite(self.equations.energy(unknowns, frame)):
            return Trouble("diverged", "to a state in which the energy is not a number")
        return None

    def _newton(self, frame: float) -> tuple[Attempt, Floats]:
        """The record of Newton's method at ``frame``, and the unknowns (N,) of its last iteration."""
        fixed, wanted = self.fixed(frame)
        free = np.setdiff1d(np.arange(len(self.unknowns)), fixed)
        start, allowed = self.unknowns.copy(), self.settings.newton_iterations
        now = _Tangent(start, *self.equations.assembled(start, frame))
        rounding = _ROUNDING * np.ptp(self.equations.space.rest, axis=0).max()
        residuals: list[float] = []

        def ended(why: str) -> tuple[Attempt, Floats]:
            return Attempt("diverged", len(residuals) - 1, tuple(residuals), why), now.unknowns

        while True:
            gap = wanted - now.unknowns[fixed]
            gap[np.abs(gap) < rounding] = 0
            residuals.append(float(np.linalg.norm(now.residual[free])))
            if residuals[-1] < self.settings.residual and not gap.any():
                now.unknowns[fixed] = wanted
                return Attempt("converged", len(residuals) - 1, tuple(residuals)), now.unknowns
            if len(residuals) > allowed:
                return ended(f"Newton's method did not converge in {allowed} iterations")
            try:
                step = now.step(free, fixed, gap)
            except RuntimeError:  # raised by SuperLU if a pivot is zero
                return ended("the equations have no unique solution")
            then = self._along(now, step, free, np.inf if gap.any() else _GROWTH * residuals[-1], frame)
            if then is None:
                return ended("the forces are unbounded, however short the Newton step is")
            now = then

    def _along(self, now: _Tangent, step: Floats, free: Ints, limit: float, frame: float) -> _Tangent | None:
        """The equations after a ``step``, which is halved until the norm of the residual of ``free`` unknowns is below ``limit``.

        None if the norm is never below the limit.
        """
        for halvings in range(_HALVINGS):
            unknowns = now.unknowns + 0.5**halvings * step
            then = _Tangent(unknowns, *self.equations.assembled(unknowns, frame))
            if np.linalg.norm(then.residual[free]) < limit:
                return then
        return None

    def fixed(self, frame: float) -> tuple[Ints, Floats]:
        """The indices (k,) of unknowns that are prescribed exactly, each once, and their values (k,) at ``frame``."""
        values: dict[int, float] = {}
        for entry in self.body.prescribed:
            if entry.stiffness is None:
                nodes = self.nodes[entry.name]
                moved = entry.path(self.equations.space.rest[nodes], frame)
                for i in entry.components:
                    values |= dict(zip((3 * nodes + i).tolist(), moved[:, i].tolist(), strict=True))
        return np.array(list(values), np.int64), np.array(list(values.values()))

    def state(self, step: Step) -> Frame:
        """The present state as a frame."""
        equations, unknowns = self.equations, self.unknowns
        places = equations.space.rest + unknowns[: equations.space.rest.size].reshape(-1, 3)
        residual, _ = equations.assembled(unknowns, step.frame, springs=False)
        fixed = {entry.name: self._force(entry, places, residual) for entry in self.body.prescribed}
        inside, vertices = equations.smallest_determinants(unknowns)
        return Frame(
            step.frame,
            points=places[equations.space.nodes],
            forces={name: force for name, (force, _) in fixed.items()},
            moments={name: moment for name, (_, moment) in fixed.items()},
            scalars={
                "min_det_F_quadrature": inside,
                "min_det_F_vertices": vertices,
                "volume_ratio": equations.volume_ratio(unknowns),
                "energy": equations.energy(unknowns, step.frame),
                "newton_iterations": float(step.iterations),
                "cut_backs": float(step.cutbacks),
            },
            residuals=step.last.residuals,
        )

    def _force(self, entry: Prescribed, places: Floats, residual: Floats) -> tuple[Floats, Floats]:
        """The force (3,) [N] of a constraint on its nodes, along its components, and the moment (3,) [N mm] about the origin."""
        nodes, components = self.nodes[entry.name], list(entry.components)
        forces = np.zeros((len(nodes), 3))
        forces[:, components] = residual[: places.size].reshape(-1, 3)[nodes][:, components]
        return forces.sum(axis=0), np.cross(places[nodes], forces).sum(axis=0)
