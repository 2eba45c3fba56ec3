"""Elements of scikit-fem on the cells of a body, evaluated at points in cells and on facets.

An effect may depend on 13 variables at a point: the entries of F row by row, the displacement and the pressure. Each variable is an
affine function of the unknowns of the cell, which are the three displacement components node by node, then the pressures.
"""

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
import skfem
from scipy.spatial.distance import cdist
from skfem.quadrature import get_quadrature

from fem_reference.foundations.errors import InputError
from fem_reference.foundations.mesh import Floats, Ints
from fem_reference.problems.body import ELEMENTS, Cells, reference_nodes

VARIABLES = 13
DISPLACEMENT = slice(9, 12)
PRESSURE = 12
_REST = np.append(np.eye(3).ravel(), np.zeros(4))
# The meshes of degree 1 and 2, and the elements of degree 0 to 2, for each kind of cell.
_MESHES = {"tetrahedron": (skfem.MeshTet1, skfem.MeshTet2), "hexahedron": (skfem.MeshHex1, skfem.MeshHex2)}
_ELEMENTS = {
    "tetrahedron": (skfem.ElementTetP0, skfem.ElementTetP1, skfem.ElementTetP2),
    "hexahedron": (skfem.ElementHex0, skfem.ElementHex1, skfem.ElementHex2),
}


@dataclass(frozen=True, eq=False)
class Points:
    """The q quadrature points in, or on a facet of, each of m ``cells`` (m,).

    ``places`` (m, q, 3) [mm]: positions. ``weights`` (m, q) [mm3, on facets mm2]. ``values`` (m, q, k), ``slopes`` (m, q, 3, k)
    [1/mm]: the k basis functions of the displacement and their gradients. ``pressures`` (m, q, l): the l basis functions of the
    pressure. ``dofs`` (m, 3 k + l): the indices of the unknowns. ``normals`` (m, q, 3): outward unit normals, on facets only.
    ``fibre`` (m, q, 3): fibre directions, in a body with fibres.
    """

    cells: Ints
    places: Floats
    weights: Floats
    values: Floats
    slopes: Floats
    pressures: Floats
    dofs: Ints
    normals: Floats | None = None
    fibre: Floats | None = None

    def part(self, chosen: slice) -> "Points":
        """The points in the ``chosen`` cells."""
        return replace(self, **{name: entry[chosen] for name, entry in vars(self).items() if entry is not None})

    @property
    def rates(self) -> Floats:
        """The derivatives (m, q, 13, 3 k + l) of the variables at each point with respect to the unknowns of the cell."""
        m, q, k = self.values.shape
        rates = np.zeros((m, q, VARIABLES, 3 * k + self.pressures.shape[2]))
        for i in range(3):
            rates[:, :, 3 * i : 3 * i + 3, i : 3 * k : 3] = self.slopes
            rates[:, :, 9 + i, i : 3 * k : 3] = self.values
        rates[:, :, PRESSURE, 3 * k :] = self.pressures
        return rates

    def variables(self, unknowns: Floats) -> Floats:
        """The 13 variables (m, q, 13) at each point."""
        m, q, k = self.values.shape
        inside = unknowns[self.dofs]
        nodal = inside[:, : 3 * k].reshape(m, 1, k, 3)
        gradient = np.swapaxes(self.slopes @ nodal, 2, 3).reshape(m, q, 9)
        displacement = (self.values[:, :, None] @ nodal)[:, :, 0]
        pressure = self.pressures @ inside[:, 3 * k :, None]
        return np.asarray(_REST + np.concatenate([gradient, displacement, pressure], axis=2))


class Space:
    """The finite element space of an ``element``, named as in ``ELEMENTS``, on ``cells``."""

    def __init__(self, cells: Cells, element: str, degree: int) -> None:
        """``degree``: the degree of the polynomials that are integrated exactly on a straight cell."""
        kind, displacement, pressure = ELEMENTS[element]
        self.cells, self.degree = cells, degree
        self.nodal = _ELEMENTS[kind][displacement]()
        self.order = cdist(self.nodal.doflocs, reference_nodes(kind, displacement)).argmin(axis=1)
        here = cells.cells[:, self.order[: cells.cells.shape[1]]]
        self.corners = here[:, : self.nodal.refdom.nnodes]
        self.mesh = _MESHES[kind][cells.degree - 1](cells.points.T.copy(), here.T.astype(np.int32))
        rule = get_quadrature(self.nodal.refdom, degree)
        self.basis = skfem.Basis(self.mesh, self.nodal, quadrature=rule)
        self.rest: Floats = np.asarray(self.basis.doflocs.T)  # (N, 3) [mm], the nodes of the displacement
        self.nodes: Ints = np.empty(len(cells.points), np.int64)  # the index in ``rest`` of each node of the mesh
        self.nodes[here] = self.basis.element_dofs[: here.shape[1]].T
        self.pressure = None
        if pressure is not None:
            element = _ELEMENTS[kind][pressure]()
            self.pressure = skfem.Basis(self.mesh, element, quadrature=rule, disable_doflocs=True)
        self.size = self.rest.size + (0 if self.pressure is None else self.pressure.N)

    @cached_property
    def inside(self) -> Points:
        """The quadrature points of all cells."""
        return self._points(skfem.Basis, get_quadrature(self.nodal.refdom, self.degree))

    @cached_property
    def vertices(self) -> Points:
        """The corners of all cells as points whose weights have no meaning."""
        corners = self.nodal.refdom.p
        return self._points(skfem.Basis, (corners, np.ones(corners.shape[1])))

    def facets(self, region: str) -> Ints:
        """The indices of the facets in ``region``, in scikit-fem's mesh. Raises InputError unless each belongs to a single cell."""
        wanted = np.unique(np.sort(self.cells.facets[region], axis=1), axis=0)
        found = []
        for side, facets in zip(self.nodal.refdom.facets, self.mesh.t2f, strict=True):
            own = np.sort(self.corners[:, side], axis=1)
            _, number = np.unique(np.concatenate([wanted, own]), axis=0, return_inverse=True)
            found.append(facets[np.isin(number[len(wanted) :], number[: len(wanted)])])
        if sum(map(len, found)) != len(wanted):
            raise InputError(f"facets.{region}", "facets of no cell or of two cells", "facets of the surface")
        return np.concatenate(found)

    def nodes_on(self, region: str) -> Ints:
        """The indices of the displacement nodes on ``region``, each once."""
        return np.unique(self.basis.get_dofs(self.facets(region)).all())

    def surface(self, region: str) -> Points:
        """The quadrature points of the facets in ``region``."""
        rule = get_quadrature(self.nodal.refdom.brefdom, self.degree)
        return self._points(skfem.FacetBasis, rule, facets=self.facets(region))

    def _points(self, kind: Any, rule: tuple[Floats, Floats], **where: Ints) -> Points:
        """The points of a quadrature ``rule`` for a ``kind`` of basis; ``where`` contains ``facets`` for a basis on facets."""
        own, *others = (
            kind(self.mesh, basis.elem, quadrature=rule, dofs=basis.dofs, disable_doflocs=True, **where)
            for basis in (self.basis, self.pressure)
            if basis is not None
        )
        shape = own.dx.shape
        values = [np.broadcast_to(np.asarray(function[0]), shape) for function in own.basis]
        slopes = [np.broadcast_to(function[0].grad, (3, *shape)) for function in own.basis]
        dofs = (3 * own.element_dofs.T[:, :, None] + np.arange(3)).reshape(shape[0], -1)
        pressures = np.zeros((*shape, 0))
        for pressure in others:
            entries = [np.broadcast_to(np.asarray(entry[0]), shape) for entry in pressure.basis]
            pressures = np.stack(entries, axis=-1)
            dofs = np.concatenate([dofs, self.rest.size + pressure.element_dofs.T], axis=1)
        return Points(
            cells=np.asarray(own.tind if own.tind is not None else np.arange(shape[0])),
            places=np.moveaxis(np.asarray(own.global_coordinates()), 0, -1),
            weights=np.asarray(own.dx),
            values=np.stack(values, axis=-1),
            slopes=np.moveaxis(np.stack(slopes), (0, 1), (3, 2)),
            pressures=pressures,
            dofs=dofs.astype(np.int64),
            normals=np.moveaxis(np.asarray(own.normals), 0, -1) if "facets" in where else None,
        )
