"""A body's mesh in DOLFINx: distributed over ranks, with its regions, its unknowns and the positions of its nodes."""

import basix
import basix.ufl
import numpy as np
from dolfinx import fem, mesh
from mpi4py import MPI

from fem_reference.foundations.mesh import Floats, Ints
from fem_reference.problems.body import ELEMENTS, Cells, reference_nodes
from fem_reference.solvers.fenicsx.tabulated import Displacement


def distribute(comm: MPI.Comm, cells: Cells) -> mesh.Mesh:
    """The mesh, distributed over the ranks; the first rank provides it."""
    element = basix.ufl.element("Lagrange", cells.kind, cells.degree, shape=(3,))
    nodes = basix.create_element(basix.ElementFamily.P, basix.CellType[cells.kind], cells.degree, _VARIANT).points
    ours = reference_nodes(cells.kind, cells.degree)
    order = [int(np.argmin(np.linalg.norm(ours - node, axis=1))) for node in nodes]
    brings = slice(None) if comm.rank == 0 else slice(0)
    return mesh.create_mesh(
        comm, cells=np.array(cells.cells[brings][:, order]), e=element, x=np.array(cells.points[brings])
    )


def own_cells(msh: mesh.Mesh) -> Ints:
    """The cells (m,) of the body's mesh that are this rank's own, in the rank's order."""
    return np.asarray(msh.topology.original_cell_index, np.int64)[: msh.topology.index_map(3).size_local]


_VARIANT = basix.LagrangeVariant.gll_warped


def local_facets(msh: mesh.Mesh, facets: dict[str, Ints]) -> dict[str, Ints]:
    """This rank's facets of each region; the corners (f, 3 or 4) are points of the body's mesh."""
    for start, end in ((2, 3), (2, 0), (0, 3), (3, 0), (3, 2)):
        msh.topology.create_connectivity(start, end)
    exterior = mesh.exterior_facet_indices(msh.topology)
    original = np.sort(_original_points(msh)[_corners(msh, exterior)], axis=1).tolist()
    found = {}
    for name, wanted in facets.items():
        corners = {tuple(facet) for facet in np.sort(wanted, axis=1).tolist()}
        found[name] = exterior[np.array([tuple(facet) in corners for facet in original], bool)]
    return found


def _corners(msh: mesh.Mesh, facets: Ints) -> Ints:
    """The vertices (f, 3 or 4) of facets."""
    connected = msh.topology.connectivity(2, 0)
    count = 3 if msh.topology.cell_name() == "tetrahedron" else 4
    return np.array([connected.links(facet) for facet in facets], np.int64).reshape(len(facets), count)


def _original_points(msh: mesh.Mesh) -> Ints:
    """The point of the body's mesh for each vertex of this rank."""
    connected = msh.topology.connectivity(3, 0)
    corners = connected.array.reshape(connected.num_nodes, 4 if msh.topology.cell_name() == "tetrahedron" else 8)
    points = np.full(msh.topology.index_map(0).size_local + msh.topology.index_map(0).num_ghosts, -1, np.int64)
    points[corners] = np.asarray(msh.geometry.input_global_indices)[msh.geometry.dofmap[:, : corners.shape[1]]]
    return points


class Nodes:
    """The nodes of the body's mesh, moved by a displacement."""

    def __init__(self, cells: Cells, own: Ints, displacement: Displacement) -> None:
        """``own``: the cells of the body's mesh that are this rank's, in the rank's order."""
        self.cells, self.own, self.unknowns = cells, own, displacement.unknowns.x
        self.comm = displacement.space.mesh.comm
        self.moves = displacement.tabulated(reference_nodes(cells.kind, cells.degree), len(own))

    def positions(self) -> Floats:
        """The present positions (n, 3) [mm] of the nodes, on every rank."""
        points = np.array(self.cells.points)
        for own, moved in self.comm.allgather((self.own, self.moves.at(self.unknowns.array))):
            if len(own):
                points[self.cells.cells[own]] = self.cells.points[self.cells.cells[own]] + moved
        return points


def unknowns(msh: mesh.Mesh, element: str) -> fem.Function:
    """Displacement, and pressure where the element has one."""
    kind, degree, pressure = ELEMENTS[element]
    parts = [basix.ufl.element("Lagrange", kind, degree, shape=(3,))]
    if pressure is not None:
        parts.append(basix.ufl.element("Lagrange" if pressure else "Discontinuous Lagrange", kind, pressure))
    return fem.Function(fem.functionspace(msh, basix.ufl.mixed_element(parts)))
