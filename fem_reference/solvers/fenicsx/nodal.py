"""Positions and unknowns of a body's nodes and cells on every rank, in an order that does not depend on FEniCSx."""

from dataclasses import replace

import numpy as np

from fem_reference.foundations.mesh import Floats, Ints
from fem_reference.problems.body import ELEMENTS, Cells, reference_nodes
from fem_reference.runs.states import NodalState
from fem_reference.solvers.fenicsx.clock import Clock
from fem_reference.solvers.fenicsx.meshes import Displacement, tabulate
from fem_reference.solvers.fenicsx.rest_stress import RestStress


class Nodal:
    """Gathers values on the ``cells`` of a body from the ranks that own the cells."""

    def __init__(
        self, cells: Cells, own: Ints, element: str, displacement: Displacement, clock: Clock, rest: RestStress | None
    ) -> None:
        """``own``: the indices in the body of this rank's cells, in this rank's order."""
        kind, degree, order = ELEMENTS[element]
        self.cells, self.own, self.clock, self.unknowns = cells, own, clock, displacement.unknowns.x
        self.rest = rest
        self.comm = displacement.space.mesh.comm
        self.moves = displacement.tabulated(reference_nodes(cells.kind, cells.degree), len(own))
        self.displacement = displacement.tabulated(reference_nodes(kind, degree), len(own))
        self.pressure = None
        if order is not None:
            space, corners = displacement.unknowns.function_space.sub(1), reference_nodes(kind, 1)
            points = corners if order else corners.mean(axis=0)[None]
            self.pressure = tabulate(space, space.dofmap.list[: len(own), :, None], points)

    def positions(self) -> Floats:
        """The current positions (n, 3) [mm] of the nodes of the mesh."""
        points = np.array(self.cells.points)
        points[self.cells.cells] += self.gathered(self.moves.at(self.unknowns.array))
        return points

    def state(self) -> NodalState:
        """The current state of all cells."""
        before, rate = np.zeros((0, 0, 3)), 0.0
        if self.clock.step is not None:
            before = self._displaced(self.clock.step.before.x.array)
            rate = float(self.clock.step.rate.value)
        found = NodalState(self._displaced(self.unknowns.array), self._pressed(self.unknowns.array), before, rate)
        if self.rest is None:
            return found
        response = self.rest.response.x.array
        return replace(found, response=self._displaced(response), response_pressure=self._pressed(response))

    def _displaced(self, unknowns: Floats) -> Floats:
        """The displacement (m, k, 3) [mm] of all cells for given ``unknowns`` (n,)."""
        return self.gathered(self.displacement.at(unknowns))

    def _pressed(self, unknowns: Floats) -> Floats:
        """The pressure (m, l) [MPa] of all cells for given ``unknowns`` (n,); l = 0 for an element without a pressure."""
        if self.pressure is None:
            return np.zeros((len(self.cells.cells), 0))
        return self.gathered(self.pressure.at(unknowns)[..., 0])

    def gathered(self, mine: Floats | Ints) -> Floats:
        """The rows of all cells (m, ...), gathered on every rank from the rows ``mine`` of each rank's cells."""
        gathered = np.zeros((len(self.cells.cells), *mine.shape[1:]))
        for own, part in self.comm.allgather((self.own, mine)):
            gathered[own] = part
        return gathered
