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
from fem_reference.solvers.fenicsx.meshes import Displacement, geometry


@dataclass(frozen=True)
class Extreme:
    """The minimum or maximum ``value`` over cells, the index ``cell`` of the cell in the body, and the rest position ``at`` [mm].
    ``where`` names the kind of point; it is empty for means over cells.
    """

    value: float
    where: str
    cell: int
    at: tuple[float, float, float]

    def __str__(self) -> str:
        value = f"{self.value:.3f} at a {self.where} of" if self.where else f"{self.value:.3g} in"
        return f"{value} cell {self.cell} at {place_of(self.at)}"


def least(comm: MPI.Comm, values: Floats, cells: Ints, at: Floats, where: str = "", sign: float = 1.0) -> Extreme:
    """The entry of ``values`` (n, ...) on all ranks that has the smallest ``sign * values``; NaN counts as smallest. ``cells`` (n,)
    and ``at`` (n, ..., 3) [mm]: the cells and positions of the values.
    """
    mine = Extreme(sign * np.inf, where, -1, (0.0, 0.0, 0.0))
    if len(cells):  # a rank may have none
        i = np.unravel_index(np.argmin(np.where(np.isnan(values), -np.inf, sign * values)), values.shape)
        x, y, z = at[i].tolist()
        mine = Extreme(float(values[i]), where, int(cells[i[0]]), (x, y, z))
    everywhere: list[Extreme] = comm.allgather(mine)
    return min(everywhere, key=lambda one: (not np.isnan(one.value), sign * one.value))


class Determinants:
    """Det F at the quadrature points and the vertices of this rank's cells."""

    def __init__(self, displacement: Displacement, cells: Ints, determinant: Any, rule: Floats, kind: Kind) -> None:
        """``cells``: the index in the body of each cell of this rank; ``rule``: quadrature points (q, 3) of a ``kind`` of cell."""
        self.mesh, self.cells, self.unknowns = displacement.space.mesh, cells, displacement.unknowns.x
        vertices = reference_nodes(kind, 1)
        # Compiled, because every iteration needs it, and by all ranks together, even ranks without cells.
        self.inside = compiling.expression(determinant, rule)
        self.at_vertices = displacement.tabulated(vertices, len(cells))
        at_vertices, slopes = geometry(self.mesh, vertices, slice(len(cells)))
        self.rest = {"quadrature point": geometry(self.mesh, rule, slice(len(cells)))[0], "vertex": at_vertices}
        self.to_reference = np.linalg.inv(slopes)

    def smallest(self, where: str | None = None) -> Extreme:
        """The smallest det F at points of one kind, ``"quadrature point"`` or ``"vertex"``, or at both; NaN counts as smallest."""
        found = [self.smallest_of(self._at(name), name) for name in ([where] if where else self.rest)]
        return min(found, key=lambda one: (not np.isnan(one.value), one.value))

    def trouble(self, _: Floats, /) -> Trouble | None:
        """The trouble *inverted* if det F is not positive at some point."""
        smallest = self.smallest()
        return None if smallest.value > 0 else Trouble("inverted", f"det F fell to {smallest}")

    def smallest_of(self, values: Floats, where: str = "quadrature point") -> Extreme:
        """The smallest of ``values`` (p,) at one kind of point in this rank's cells, over all ranks; NaN counts as smallest."""
        places = self.rest[where]
        return least(self.mesh.comm, values.reshape(places.shape[:2]), self.cells, places, where)

    def values_now(self) -> Floats:
        """Det F (p,) at the quadrature points of this rank's cells, at which the energies are evaluated."""
        return self._at("quadrature point").ravel()

    def everywhere(self, good: NDArray[np.bool_]) -> bool:
        """True if all points (p,) of all ranks are ``good``."""
        return bool(self.mesh.comm.allreduce(bool(good.all()), MPI.LAND))

    def _at(self, where: str) -> Floats:
        """Det F in each cell of this rank at each point of one kind."""
        if len(self.cells) == 0:
            return np.zeros(self.rest[where].shape[:2])
        if where == "vertex":
            values = self.unknowns.array[self.at_vertices.unknowns]
            slopes = np.stack([slope @ values for slope in self.at_vertices.slopes], axis=-1)
            return np.asarray(np.linalg.det(np.eye(3) + slopes @ self.to_reference))
        values = self.inside.eval(self.mesh, np.arange(len(self.cells), dtype=np.int32))
        return np.asarray(values).reshape(len(self.cells), -1)
