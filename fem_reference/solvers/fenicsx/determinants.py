"""The smallest det F of a state: the check that a converged state is physically possible."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from mpi4py import MPI
from numpy.typing import NDArray

from fem_reference.foundations.mesh import Floats, Ints, place_of
from fem_reference.problems.body import Kind, reference_nodes
from fem_reference.solvers.common.state_checks import Trouble
from fem_reference.solvers.fenicsx import compiling
from fem_reference.solvers.fenicsx.tabulated import Displacement, geometry


@dataclass(frozen=True)
class Smallest:
    """The smallest det F over a set of points of the cells, with the kind of point, the cell and the rest position [mm]."""

    value: float
    where: str
    cell: int
    at: tuple[float, float, float]

    def __str__(self) -> str:
        return f"{self.value:.3f} at a {self.where} of cell {self.cell} at {place_of(self.at)}"


class Determinants:
    """Det F at the quadrature points and the vertices of this rank's cells."""

    def __init__(self, displacement: Displacement, cells: Ints, determinant: Any, rule: Floats, kind: Kind) -> None:
        """``cells``: the cell of the body for each of this rank's; ``rule``: quadrature points (q, 3) of a ``kind`` of cell."""
        self.mesh, self.cells, self.unknowns = displacement.space.mesh, cells, displacement.unknowns.x
        self.points = {"quadrature point": rule, "vertex": reference_nodes(kind, 1)}
        # Compiled, as each iteration needs it, and by all ranks together: a rank without cells evaluates it nowhere.
        self.inside = compiling.expression(determinant, rule)
        self.at_vertices = displacement.tabulated(self.points["vertex"], len(cells))
        self.rest, slopes = {}, {}
        for name, points in self.points.items():
            self.rest[name], slopes[name] = geometry(self.mesh, points, slice(len(cells)))
        self.to_reference = np.linalg.inv(slopes["vertex"])

    def smallest(self, where: str | None = None) -> Smallest:
        """The smallest det F at points of one kind, ``"quadrature point"`` or ``"vertex"``, or at both; NaN counts as smallest."""
        return self._least([self._mine(name, self._at(name)) for name in ([where] if where else self.points)])

    def trouble(self, _: Floats, /) -> Trouble | None:
        """Inverted where det F is not positive somewhere."""
        smallest = self.smallest()
        return None if smallest.value > 0 else Trouble("inverted", f"det F fell to {smallest}")

    def smallest_of(self, values: Floats) -> Smallest:
        """The smallest of other ``values`` (p,) at the quadrature points of this rank's cells, and its place; NaN is smallest."""
        where = "quadrature point"
        return self._least([self._mine(where, values.reshape(len(self.cells), len(self.points[where])))])

    def _least(self, mine: list[Smallest]) -> Smallest:
        everywhere: list[Smallest] = [found for rank in self.mesh.comm.allgather(mine) for found in rank]
        return min(everywhere, key=lambda found: (not np.isnan(found.value), found.value))

    def values_now(self) -> Floats:
        """Det F at the quadrature points of this rank's cells (p,), where the energies are evaluated."""
        return self._at("quadrature point").ravel()

    def everywhere(self, good: NDArray[np.bool_]) -> bool:
        """True where all points (p,) of all ranks are ``good``."""
        return bool(self.mesh.comm.allreduce(bool(good.all()), MPI.LAND))

    def _at(self, where: str) -> Floats:
        """Det F by cell of this rank and point of a kind."""
        if len(self.cells) == 0:
            return np.zeros((0, len(self.points[where])))
        if where == "vertex":
            slopes = self.at_vertices.slopes_at(self.unknowns.array)
            return np.asarray(np.linalg.det(np.eye(3) + slopes @ self.to_reference))
        values = self.inside.eval(self.mesh, np.arange(len(self.cells), dtype=np.int32))
        return np.asarray(values).reshape(len(self.cells), -1)

    def _mine(self, where: str, values: Floats) -> Smallest:
        if len(self.cells) == 0:  # a rank without cells
            return Smallest(float("inf"), where, -1, (0.0, 0.0, 0.0))
        cell, point = np.unravel_index(np.argmin(np.where(np.isnan(values), -np.inf, values)), values.shape)
        x, y, z = self.rest[where][cell, point]
        return Smallest(float(values[cell, point]), where, int(self.cells[cell]), (float(x), float(y), float(z)))
