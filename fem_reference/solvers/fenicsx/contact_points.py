"""Contact points and points of springs: their positions in the cells, and the nodes that carry them."""

from dataclasses import dataclass, fields
from functools import cached_property
from typing import Any

import basix
import numpy as np
from scipy.sparse import csr_array

from fem_reference.foundations.mesh import Floats, Ints
from fem_reference.geometry.embedding import barycentric
from fem_reference.geometry.skins import Skin
from fem_reference.problems.body import Cells
from fem_reference.solvers.fenicsx.meshes import Displacement, geometry


@dataclass(frozen=True, eq=False)
class ContactPoints:
    """n points in this rank's cells. ``rest`` (n, 3) [mm]: rest positions; ``areas`` (n,) [mm2]: rest areas; ``cells`` (n,): the
    cells that carry the points. For the k nodes of each cell: the values ``basis`` (n, k) of their basis functions at the point,
    the rest positions ``nodes`` (n, k, 3) [mm] and the unknowns ``dofs`` (n, k, 3).
    """

    rest: Floats
    areas: Floats
    cells: Ints
    basis: Floats
    nodes: Floats
    dofs: Ints

    def positions(self, unknowns: Floats) -> Floats:
        """The current positions (n, 3) [mm] of the points."""
        carried = self.carried
        return np.asarray(self.rest + carried.shares @ unknowns[carried.dofs])

    def add_forces(self, residual: Floats, forces: Floats, some: Ints | None = None) -> None:
        """Add the weak form of ``forces`` (n, 3) [N] on all points, or on ``some``, to ``residual`` over this rank's unknowns."""
        shares = self.carried.shares if some is None else self.carried.shares[some]
        residual[self.carried.dofs] += shares.T @ forces  # ``dofs`` names each unknown once

    @cached_property
    def carried(self) -> "Carried":
        """The nodes that carry the points."""
        _, first, which = np.unique(self.dofs[:, :, 0], return_index=True, return_inverse=True)
        which = which.reshape(self.basis.shape)
        points = np.repeat(np.arange(len(self.basis)), self.basis.shape[1])
        shares = csr_array((self.basis.ravel(), (points, which.ravel())), shape=(len(self.basis), len(first)))
        return Carried(self.dofs.reshape(-1, 3)[first], self.nodes.reshape(-1, 3)[first], which, shares)


@dataclass(frozen=True, eq=False)
class Carried:
    """The m nodes that carry n points, each listed once. ``dofs`` (m, 3): the unknowns of the nodes; ``rest`` (m, 3) [mm]: their
    rest positions; ``which`` (n, k): the nodes of each point; ``shares`` (n, m): the weight of each node in each point.
    """

    dofs: Ints
    rest: Floats
    which: Ints
    shares: csr_array


def on_facets(displacement: Displacement, mesh: Cells, facets: Ints, degree: int) -> ContactPoints:
    """The quadrature points of a rule of ``degree`` on the ``facets`` of cells that this rank owns."""
    kind, msh = basix.CellType[mesh.kind], displacement.space.mesh
    sides = _sides(msh.topology, facets)
    side = basix.CellType.triangle if mesh.kind == "tetrahedron" else basix.CellType.quadrilateral
    points, weights = basix.make_quadrature(side, degree)
    corners, topology = basix.geometry(kind), basix.topology(kind)[2]
    parts = []
    for number, vertices in enumerate(topology):
        cells = sides[sides[:, 1] == number, 0]
        first, *others = corners[vertices[:3]]
        edges = np.stack([other - first for other in others])  # along the two coordinates of the facet
        within = first + points @ edges
        places, slopes = geometry(msh, within, cells)
        across = np.cross(slopes @ edges[0], slopes @ edges[1])
        areas = np.linalg.norm(across, axis=2) * weights
        repeated = np.repeat(cells, len(points))
        parts.append(_points(displacement, repeated, np.tile(within, (len(cells), 1)), places, areas))
    columns = ([getattr(part, entry.name) for part in parts] for entry in fields(ContactPoints))
    return ContactPoints(*(np.concatenate(column) for column in columns))


def on_skin(displacement: Displacement, skin: Skin, local: Ints) -> ContactPoints:
    """The points of a ``skin`` in cells that this rank owns; ``local`` (m,): this rank's index of each cell of the body, or -1."""
    mine, msh = np.flatnonzero(local[skin.cells] >= 0), displacement.space.mesh
    cells, points = local[skin.cells[mine]], skin.points[mine]
    within = barycentric(points, msh.geometry.x[msh.geometry.dofmap[cells]])[:, 1:]
    return _points(displacement, cells, within, points, skin.areas[mine])


def _points(displacement: Displacement, cells: Ints, within: Floats, rest: Floats, areas: Floats) -> ContactPoints:
    """Contact points at reference coordinates ``within`` (n, 3) of ``cells`` (n,)."""
    space = displacement.space
    element: Any = space.element.basix_element
    basis = element.tabulate(0, within)[0, :, :, 0]
    nodes = space.dofmap.list[cells]
    places = space.tabulate_dof_coordinates()[nodes]
    return ContactPoints(rest.reshape(-1, 3), areas.ravel(), cells, basis, places, displacement.dofs[nodes])


def _sides(topology: Any, facets: Ints) -> Ints:
    """For each facet of a cell that this rank owns, the cell and the number of the facet in the cell (f, 2)."""
    cells, back = topology.connectivity(2, 3), topology.connectivity(3, 2)
    own = topology.index_map(3).size_local
    beside = [(int(cells.links(facet)[0]), facet) for facet in facets]
    found = [(cell, int(np.flatnonzero(back.links(cell) == facet)[0])) for cell, facet in beside if cell < own]
    return np.array(found, np.int64).reshape(-1, 2)
