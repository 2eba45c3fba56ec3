"""The unknowns of a body's cells, in an order that readers without FEniCSx understand."""

import numpy as np

from fem_reference.foundations.mesh import Floats, Ints
from fem_reference.problems.body import ELEMENTS, reference_nodes
from fem_reference.runs.states import NodalState
from fem_reference.solvers.fenicsx.clock import Clock
from fem_reference.solvers.fenicsx.tabulated import Displacement, tabulate


class Nodal:
    """Gathers the unknowns of every cell of the body's mesh from the ranks that own them."""

    def __init__(self, own: Ints, element: str, displacement: Displacement, clock: Clock) -> None:
        """``own``: the cells of the body's mesh that are this rank's, in the rank's order."""
        kind, degree, order = ELEMENTS[element]
        nodes, corners = reference_nodes(kind, degree), reference_nodes(kind, 1)
        self.own, self.clock, self.unknowns = own, clock, displacement.unknowns.x
        self.comm = displacement.space.mesh.comm
        self.displacement, self.pressure = displacement.tabulated(nodes, len(own)), None
        if order is not None:
            space = displacement.unknowns.function_space.sub(1)
            points = corners if order else corners.mean(axis=0)[None]
            self.pressure = tabulate(space, space.dofmap.list[: len(own), :, None], points)

    def state(self) -> NodalState:
        """The present state, the same on every rank."""
        displacement = self._gathered(self.displacement.at(self.unknowns.array))
        pressure, before, rate = np.zeros((len(displacement), 0)), np.zeros((0, 0, 3)), 0.0
        if self.pressure is not None:
            pressure = self._gathered(self.pressure.at(self.unknowns.array)[..., 0])
        if self.clock.step is not None:
            before = self._gathered(self.displacement.at(self.clock.step.before.x.array))
            rate = float(self.clock.step.rate.value)
        return NodalState(displacement, pressure, before, rate)

    def _gathered(self, mine: Floats) -> Floats:
        parts = self.comm.allgather((self.own, mine))
        gathered = np.zeros((sum(len(own) for own, _ in parts), *mine.shape[1:]))
        for own, part in parts:
            gathered[own] = part
        return gathered
