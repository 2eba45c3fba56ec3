"""The unknowns of a body's cells, in an order that can be read without FEniCSx."""

from typing import Any

import numpy as np
import ufl
from dolfinx import fem

from fem_reference.foundations.mesh import Floats, Ints
from fem_reference.problems.body import ELEMENTS, reference_nodes
from fem_reference.runs.states import NodalState
from fem_reference.solvers.fenicsx import compiling
from fem_reference.solvers.fenicsx.clock import Clock


class Nodal:
    """Gathers the unknowns of every cell of the body's mesh from the ranks that own them."""

    def __init__(self, own: Ints, element: str, unknowns: fem.Function, clock: Clock) -> None:
        """``own``: the cells of the body's mesh that are this rank's, in the rank's order."""
        kind, degree, order = ELEMENTS[element]
        nodes, corners = reference_nodes(kind, degree), reference_nodes(kind, 1)
        displacement, *pressures = ufl.split(unknowns)
        self.own, self.clock, self.mesh = own, clock, unknowns.function_space.mesh
        self.displacement = _Values(displacement, nodes, (3,))
        self.pressure = (
            _Values(pressures[0], corners if order else corners.mean(axis=0)[None], ()) if pressures else None
        )
        self.before = None if clock.step is None else _Values(ufl.split(clock.step.before)[0], nodes, (3,))

    def state(self) -> NodalState:
        """The present state, the same on every rank."""
        displacement = self._gathered(self.displacement)
        pressure = np.zeros((len(displacement), 0)) if self.pressure is None else self._gathered(self.pressure)
        before = np.zeros((0, 0, 3)) if self.before is None else self._gathered(self.before)
        rate = 0.0 if self.clock.step is None else float(self.clock.step.rate.value)
        return NodalState(displacement, pressure, before, rate)

    def _gathered(self, values: "_Values") -> Floats:
        parts = self.mesh.comm.allgather((self.own, values.inside(self.mesh, len(self.own))))
        gathered = np.zeros((sum(len(own) for own, _ in parts), *values.shape))
        for own, part in parts:
            gathered[own] = part
        return gathered


class _Values:
    """An expression of ``size`` at reference points (k, 3)."""

    def __init__(self, expression: Any, points: Floats, size: tuple[int, ...]) -> None:
        self.compiled, self.shape = compiling.expression(expression, points), (len(points), *size)

    def inside(self, msh: Any, count: int) -> Floats:
        """Its values in the first ``count`` cells of this rank, (count, k, ...)."""
        if count == 0:  # which the compiled expression does not take
            return np.zeros((0, *self.shape))
        return np.asarray(self.compiled.eval(msh, np.arange(count, dtype=np.int32)), float).reshape(count, *self.shape)
