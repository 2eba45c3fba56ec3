"""A body's mesh in DOLFINx: distributed over ranks, with its regions and its unknowns."""

from collections.abc import Iterable

import basix.ufl
import numpy as np
import ufl
from dolfinx import fem, mesh
from mpi4py import MPI

from fem_reference.foundations.mesh import Ints
from fem_reference.problems.body import ELEMENTS, Cells, reference_nodes
from fem_reference.solvers.fenicsx.reference_cells import lagrange


def distribute(comm: MPI.Comm, cells: Cells) -> mesh.Mesh:
    """The mesh, distributed over the ranks; the first rank provides it."""
    element = basix.ufl.element("Lagrange", cells.kind, cells.degree, shape=(3,))
    ours = reference_nodes(cells.kind, cells.degree)
    nodes = lagrange(cells.kind, cells.degree).points
    order = [int(np.argmin(np.linalg.norm(ours - node, axis=1))) for node in nodes]
    brings = slice(None) if comm.rank == 0 else slice(0)
    return mesh.create_mesh(
        comm, cells=np.array(cells.cells[brings][:, order]), e=element, x=np.array(cells.points[brings])
    )


def local_facets(msh: mesh.Mesh, regions: Iterable[Ints]) -> list[Ints]:
    """This rank's facets of each region, whose facets (f, k) are given by their corners, points of the original mesh."""
    topology, facet = msh.topology, msh.topology.dim - 1
    for start, end in ((facet, facet + 1), (facet + 1, facet), (facet, 0), (0, facet + 1), (facet + 1, 0)):
        topology.create_connectivity(start, end)
    exterior, vertices = mesh.exterior_facet_indices(topology), topology.connectivity(facet, 0)
    count = topology.index_map(0).size_local + topology.index_map(0).num_ghosts
    nodes = mesh.entities_to_geometry(msh, 0, np.arange(count, dtype=np.int32))[:, 0]
    points = np.asarray(msh.geometry.input_global_indices)[nodes]
    size = len(vertices.array) // max(1, vertices.num_nodes)  # corners of a facet; a rank may have none
    corners = vertices.array.reshape(-1, max(1, size))[exterior]
    original = list(map(tuple, np.sort(points[corners], axis=1).tolist()))
    wanted = (set(map(tuple, np.sort(region, axis=1).tolist())) for region in regions)
    return [exterior[np.array([corners in region for corners in original], bool)] for region in wanted]


def facet_measure(msh: mesh.Mesh, regions: Iterable[Ints], degree: int) -> ufl.Measure:
    """The measure of this rank's facets, by number of the region and by degree."""
    kind = fem.IntegralType.exterior_facet
    parts = [(i, fem.compute_integration_domains(kind, msh.topology, facets)) for i, facets in enumerate(regions)]
    return ufl.Measure("ds", domain=msh, subdomain_data=parts, metadata={"quadrature_degree": degree})


def unknowns(msh: mesh.Mesh, element: str) -> fem.Function:
    """Displacement, and pressure where the element has one."""
    kind, degree, pressure = ELEMENTS[element]
    parts = [basix.ufl.element("Lagrange", kind, degree, shape=(3,))]
    if pressure is not None:
        parts.append(basix.ufl.element("Lagrange" if pressure else "Discontinuous Lagrange", kind, pressure))
    return fem.Function(fem.functionspace(msh, basix.ufl.mixed_element(parts)))
