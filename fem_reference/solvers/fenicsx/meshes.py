"""A body's mesh in DOLFINx, distributed over ranks, with its regions, quadrature rules and unknowns. Tabulated basis functions,
which need no compilation, give positions and unknowns at reference points.
"""

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

import basix.ufl
import numpy as np
import ufl
from dolfinx import fem, mesh
from mpi4py import MPI

from fem_reference.foundations.mesh import Floats, Ints, found_in
from fem_reference.problems.body import ELEMENTS, Cells, reference_nodes

# For each element, the degree up to which polynomials on a straight cell are integrated exactly.
DEGREE = {"P1": 2, "P1/P1": 2, "P2": 5, "P2/P0": 5, "P2/P1": 5, "Q1": 3, "Q2": 5, "Q1/P0": 3, "Q2/Q1": 5}

# A rule of degree 5 that includes the vertices: the weight of a vertex, then weights and barycentric coordinates of the other
# sets of points. Weights are fractions of the volume.
_VERTEX_SHARE = 0.002
_ON_MEDIANS = ((0.11990832171874463, 0.3141518976943535), (0.09393542311163477, 0.10944719170192463))
_ON_BIMEDIANS = (0.02277083677974708, 0.010913290341505138)


def rule(element: str, degree: int | None) -> tuple[Floats, Floats]:
    """The points (q, 3) and weights (q,) of a quadrature rule of ``degree``, by default ``DEGREE``, on an element's reference cell.

    On quadratic tetrahedra the default rule includes the vertices, which standard rules leave out. In a cell that inverts, det F of
    a quadratic displacement is smallest at a vertex, and an energy that grows without bound as det F falls to zero keeps det F
    positive where the energy is evaluated.
    """
    kind, order, _ = ELEMENTS[element]
    if degree is None and kind == "tetrahedron" and order == 2:
        return with_vertices()
    points, weights = basix.make_quadrature(basix.CellType[kind], degree or DEGREE[element])
    return np.asarray(points), np.asarray(weights)


def with_vertices() -> tuple[Floats, Floats]:
    """A rule of 18 points on the unit tetrahedron, exact to degree 5: the 4 vertices, two sets of 4 points on the medians, and
    6 points on the bimedians.

    Weights and coordinates solve the seven moment equations of degrees 0, 2, 3, 4, 4, 5 and 5 for the given weight of a vertex;
    for a weight of 0 they agree with Walkington 2000, Quadrature on simplices of arbitrary dimension.
    """
    points, weights = [np.eye(4, 3, -1)], [np.full(4, _VERTEX_SHARE)]
    for share, a in _ON_MEDIANS:
        points.append(np.array([[a, a, a], [a, a, 1 - 3 * a], [a, 1 - 3 * a, a], [1 - 3 * a, a, a]]))
        weights.append(np.full(4, share))
    share, b = _ON_BIMEDIANS
    c = 0.5 - b
    points.append(np.array([[b, b, c], [b, c, b], [c, b, b], [c, c, b], [c, b, c], [b, c, c]]))
    weights.append(np.full(6, share))
    return np.concatenate(points), np.concatenate(weights) / 6


def lagrange(kind: str, degree: int) -> Any:
    """The Lagrange element of ``degree`` on this ``kind`` of cell, as DOLFINx creates it."""
    return basix.create_element(basix.ElementFamily.P, basix.CellType[kind], degree, basix.LagrangeVariant.gll_warped)


def geometry(msh: mesh.Mesh, points: Floats, cells: Ints | slice) -> tuple[Floats, Floats]:
    """The rest positions (m, q, 3) [mm] of reference ``points`` (q, 3) in ``cells`` (m,), and their derivatives (m, q, 3, 3)."""
    values = lagrange(msh.topology.cell_name(), msh.geometry.cmap.degree).tabulate(1, points)[..., 0]
    nodes = msh.geometry.x[msh.geometry.dofmap[cells]]
    return np.einsum("qk,mki->mqi", values[0], nodes), np.einsum("jqk,mki->mqij", values[1:], nodes)


@dataclass(frozen=True, eq=False)
class Tabulated:
    """Interpolation of some of the unknowns to reference points of cells. ``values`` (q, k): the basis functions at the points;
    ``slopes`` (3, q, k): their derivatives along the reference coordinates; ``unknowns`` (m, k, c): those of the cells' nodes.
    """

    values: Floats
    slopes: Floats
    unknowns: Ints

    def at(self, unknowns: Floats) -> Floats:
        """The values (m, q, c) at the points, for given ``unknowns`` (n,)."""
        return np.asarray(self.values @ unknowns[self.unknowns])


def tabulate(space: fem.FunctionSpace, unknowns: Ints, points: Floats) -> Tabulated:
    """Interpolation to reference ``points`` (q, 3) in a ``space``; ``unknowns`` (m, k, c): the unknowns of the cells' nodes."""
    element: Any = space.element.basix_element
    values, *slopes = element.tabulate(1, points)[..., 0]
    return Tabulated(values, np.stack(slopes), unknowns)


class Displacement:
    """The displacement part of the ``unknowns`` of a body: its ``space``, and the unknowns ``dofs`` (n, 3) of its nodes."""

    def __init__(self, unknowns: fem.Function) -> None:
        self.unknowns = unknowns
        self.space, parents = unknowns.function_space.sub(0).collapse()
        self.dofs: Ints = np.reshape(np.asarray(parents, np.int64), (-1, 3))

    def tabulated(self, points: Floats, count: int) -> Tabulated:
        """The displacement at reference ``points`` (q, 3) of the first ``count`` cells."""
        return tabulate(self.space, self.dofs[self.space.dofmap.list[:count]], points)


def distribute(comm: MPI.Comm, cells: Cells) -> mesh.Mesh:
    """Distribute the first rank's mesh over all ranks."""
    element = basix.ufl.element("Lagrange", cells.kind, cells.degree, shape=(3,))
    ours = reference_nodes(cells.kind, cells.degree)
    nodes = lagrange(cells.kind, cells.degree).points
    order = [int(np.argmin(np.linalg.norm(ours - node, axis=1))) for node in nodes]
    brings = slice(None) if comm.rank == 0 else slice(0)
    corners, points = np.array(cells.cells[brings][:, order]), np.array(cells.points[brings])
    return mesh.create_mesh(comm, cells=corners, e=element, x=points)


def local_facets(msh: mesh.Mesh, regions: Iterable[Ints]) -> list[Ints]:
    """This rank's facets in each of the ``regions``, which are arrays (f, k) of the corners of facets in the original mesh."""
    topology, facet = msh.topology, msh.topology.dim - 1
    for start, end in ((facet, facet + 1), (facet + 1, facet), (facet, 0), (0, facet + 1), (facet + 1, 0)):
        topology.create_connectivity(start, end)
    exterior, vertices = mesh.exterior_facet_indices(topology), topology.connectivity(facet, 0)
    count = topology.index_map(0).size_local + topology.index_map(0).num_ghosts
    nodes = mesh.entities_to_geometry(msh, 0, np.arange(count, dtype=np.int32))[:, 0]
    points = np.asarray(msh.geometry.input_global_indices)[nodes]
    size = len(vertices.array) // max(1, vertices.num_nodes)  # corners of a facet; a rank may have none
    corners = vertices.array.reshape(-1, max(1, size))[exterior]
    return [exterior[found_in(points[corners], region)] for region in regions]


def facet_measure(msh: mesh.Mesh, regions: Iterable[Ints], degree: int) -> ufl.Measure:
    """The measure of this rank's facets, with quadrature of a ``degree``. Its subdomains are in the order of the ``regions``."""
    kind = fem.IntegralType.exterior_facet
    parts = [(i, fem.compute_integration_domains(kind, msh.topology, facets)) for i, facets in enumerate(regions)]
    return ufl.Measure("ds", domain=msh, subdomain_data=parts, metadata={"quadrature_degree": degree})


def unknowns(msh: mesh.Mesh, element: str) -> fem.Function:
    """The unknowns of a body: the displacement, and the pressure if the element has one."""
    kind, degree, pressure = ELEMENTS[element]
    parts = [basix.ufl.element("Lagrange", kind, degree, shape=(3,))]
    if pressure is not None:
        parts.append(basix.ufl.element("Lagrange" if pressure else "Discontinuous Lagrange", kind, pressure))
    return fem.Function(fem.functionspace(msh, basix.ufl.mixed_element(parts)))
