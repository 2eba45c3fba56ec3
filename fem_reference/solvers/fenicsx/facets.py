"""Facets of a deforming surface: polynomials through their nodes, points on facets, and nearest points on facets."""

from dataclasses import dataclass, fields, replace
from functools import cached_property
from typing import Any

import basix
import numpy as np

from fem_reference.foundations.mesh import Floats, Ints
from fem_reference.problems.body import Cells
from fem_reference.solvers.fenicsx.meshes import Displacement, lagrange

_NINE = np.asarray(lagrange("quadrilateral", 2).points)  # nine points that determine a function of every element
_ITERATIONS, _ROUGH = 12, 2  # iterations of Newton's method for the nearest point, and for points far beyond the edges
_LONGEST, _SMALL = 0.5, 1e-14  # the longest step, and the step at which to stop, in reference coordinates
# The smallest sine of the angle between a line and a facet in a step, and the distance [mm] within which a line meets a point.
_FLAT, _OFF = 0.01, 1e-9
# The largest offset of a point from the normal at its nearest point, as a fraction of the size of the facet; and reference
# coordinates far beyond the edges.
_ASIDE, _NOWHERE = 1e-6, 9.0
_BALL = 1.25  # the radius of a ball around a facet, as a multiple of the largest distance of its nodes from their mean


@dataclass(frozen=True, eq=False)
class FacetPlaces:
    """Points on n facets. ``at`` (n, 2): reference coordinates; ``basis`` (n, k) and ``slopes`` (n, 2, k): the values and
    derivatives of the nodes' basis functions; ``point`` (n, 3) [mm]: positions; ``tangents`` (n, 2, 3) [mm]: derivatives of the
    positions; ``normal`` (n, 3): outward unit normals; ``bend`` (n, 2, 2) [mm]: second derivatives along the normals.
    """

    at: Floats
    basis: Floats
    slopes: Floats
    point: Floats
    tangents: Floats
    normal: Floats
    bend: Floats

    @property
    def metric(self) -> Floats:
        """The scalar products (n, 2, 2) [mm2] of the tangents."""
        return self.tangents @ np.swapaxes(self.tangents, 1, 2)

    def __getitem__(self, some: Ints) -> "FacetPlaces":
        return FacetPlaces(*(getattr(self, column.name)[some] for column in fields(self)))


@dataclass(frozen=True, eq=False)
class Facets:
    """The m facets of a part of the surface, with k nodes each. ``dofs`` (m, k, 3): the unknowns of the nodes; ``rest`` (m, k, 3)
    [mm]: their rest positions; ``outward`` (m,): the sign that turns the cross product of the tangents outward; ``element``: the
    element of the basis functions.
    """

    dofs: Ints
    rest: Floats
    outward: Floats
    element: Any

    def __getitem__(self, some: Ints) -> "Facets":
        return replace(self, dofs=self.dofs[some], rest=self.rest[some], outward=self.outward[some])

    def nodes(self, unknowns: Floats) -> Floats:
        """The current positions (m, k, 3) [mm] of the nodes."""
        return np.asarray(self.rest + unknowns[self.dofs])

    def rule(self, degree: int) -> tuple[Floats, Floats]:
        """The points (q, 2) and weights (q,) of a quadrature rule of ``degree`` on the reference facet."""
        points, weights = basix.make_quadrature(self.element.cell_type, degree)
        return np.asarray(points), np.asarray(weights)

    @cached_property
    def coefficients(self) -> Floats:
        """The coefficients (9, 6, k), all integers, of the ``_powers`` in the k basis functions and their derivatives."""
        return np.rint(np.tensordot(np.linalg.inv(_powers(_NINE)), self.element.tabulate(2, _NINE)[..., 0], (1, 1)))

    def places(self, nodes: Floats, which: Ints, at: Floats) -> FacetPlaces:
        """The points ``at`` (n, 2) on the facets ``which`` (n,). ``nodes`` (m, k, 3) [mm]: the positions of all nodes."""
        tables = np.tensordot(_powers(at), self.coefficients, 1)
        point, u, v, uu, uv, vv = np.moveaxis(tables @ nodes[which], 1, 0)
        across = np.cross(u, v) * self.outward[which, None]
        normal = across / np.linalg.norm(across, axis=1)[:, None]
        bend = np.stack([np.vecdot(second, normal) for second in (uu, uv, uv, vv)], axis=1).reshape(-1, 2, 2)
        return FacetPlaces(at, tables[:, 0], tables[:, 1:3], point, np.stack([u, v], axis=1), normal, bend)

    def nearest(self, nodes: Floats, which: Ints, points: Floats) -> FacetPlaces:
        """The points on the facets ``which`` (n,) that are nearest to ``points`` (n, 3) [mm], by Newton's method from the centres
        of the facets.

        Facets are continued beyond their edges; nearest points far beyond the edges are only approximate. Where the method does not
        converge, ``at`` is set far beyond the edges, so that a distant facet does not seem to be near the point.
        """
        at, going = self._middles(which)
        for i in range(_ITERATIONS):
            if not len(going):
                break
            place = self.places(nodes, which[going], at[going])
            away = points[going] - place.point
            gap = np.einsum("ni,ni->n", away, place.normal)
            curved = place.metric - gap[:, None, None] * place.bend
            convex = (np.linalg.det(curved) > 0) & (np.trace(curved, axis1=1, axis2=2) > 0)
            matrix = np.where(convex[:, None, None], curved, place.metric)
            step = np.linalg.solve(matrix, place.tangents @ away[:, :, None])[:, :, 0]
            going = self._moved(at, going, step, i)
        found = self.places(nodes, which, at)
        away = points - found.point
        aside = np.linalg.norm(away - np.vecdot(away, found.normal)[:, None] * found.normal, axis=1)
        lost = (aside > _ASIDE * np.sqrt(np.trace(found.metric, axis1=1, axis2=2))) & (self.beyond(at) < _LONGEST)
        return replace(found, at=np.where(lost[:, None], _NOWHERE, at))

    def along(self, nodes: Floats, which: Ints, points: Floats, normals: Floats) -> tuple[FacetPlaces, Floats]:
        """The points where lines through ``points`` (n, 3) [mm] along ``normals`` (n, 3) meet the facets ``which`` (n,), and the
        distances (n,) [mm] along the lines, NaN where they miss. Facets are continued beyond their edges, and Newton's method is
        used as in ``nearest``.
        """
        at, going = self._middles(which)
        for i in range(_ITERATIONS):
            if not len(going):
                break
            place, normal = self.places(nodes, which[going], at[going]), normals[going]
            (u, v), away = np.moveaxis(place.tangents, 1, 0), points[going] - place.point
            size, across = np.linalg.norm(np.cross(u, v), axis=1), np.vecdot(np.cross(u, v), normal)
            across = np.where(across < 0, -1, 1) * np.maximum(np.abs(across), _FLAT * size)
            moved = [np.vecdot(np.cross(*pair), normal) / across for pair in ((away, v), (u, away))]
            going = self._moved(at, going, np.stack(moved, axis=1), i)
        found = self.places(nodes, which, at)
        gap = np.vecdot(found.point - points, normals)
        off = np.linalg.norm(found.point - points - gap[:, None] * normals, axis=1)
        return found, np.where(off < _OFF, gap, np.nan)

    def _middles(self, which: Ints) -> tuple[Floats, Ints]:
        """The reference coordinates (n, 2) of the centres of the facets ``which`` (n,), and the indices 0 to n - 1."""
        return np.tile(self.element.points.mean(axis=0), (len(which), 1)), np.arange(len(which))

    def _moved(self, at: Floats, going: Ints, step: Floats, iteration: int) -> Ints:
        """Move the entries ``going`` (k,) of ``at`` (n, 2) by a ``step`` (k, 2), shortened if long; return the unfinished ones."""
        longest = np.abs(step).max(axis=1)
        at[going] += step * (_LONGEST / np.maximum(longest, _LONGEST))[:, None]
        return going[(longest > _SMALL) & ((iteration < _ROUGH) | (self.beyond(at[going]) < _LONGEST))]

    def beyond(self, at: Floats) -> Floats:
        """The distance (n,) of the reference coordinates ``at`` (n, 2) from the reference facet; 0 inside the facet."""
        return self.leaving(at)[0]

    def leaving(self, at: Floats) -> tuple[Floats, Floats]:
        """The distance (n,) as in ``beyond``, and its derivative (n, 2)."""
        (u, v), triangle = at.T, self.element.cell_type == basix.CellType.triangle
        far = [0 * u, -u, -v, *([u + v - 1] if triangle else [u - 1, v - 1])]
        slopes = np.array([(0, 0), (-1, 0), (0, -1), *([(1, 1)] if triangle else [(1, 0), (0, 1)])], float)
        return np.max(far, axis=0), slopes[np.argmax(far, axis=0)]

    @staticmethod
    def balls(nodes: Floats) -> tuple[Floats, Floats]:
        """The centres (m, 3) and radii (m,) [mm] of balls around facets with ``nodes`` (m, k, 3)."""
        middles = nodes.mean(axis=1)
        return middles, _BALL * np.linalg.norm(nodes - middles[:, None], axis=2).max(axis=1)


def _powers(at: Floats) -> Floats:
    """The products (n, 9) of powers 0 to 2 of both reference coordinates ``at`` (n, 2). The basis functions of every element are
    linear combinations of them.
    """
    powers = np.stack([1 + 0 * at, at, at * at], axis=2)
    return np.asarray((powers[:, 0, :, None] * powers[:, 1, None]).reshape(len(at), 9))


def facets_of(displacement: Displacement, mesh: Cells, facets: Ints) -> Facets:
    """The ``facets`` of a ``mesh`` on one rank, in the given order."""
    space, msh = displacement.space, displacement.space.mesh
    cells, back = msh.topology.connectivity(2, 3), msh.topology.connectivity(3, 2)
    beside = np.array([cells.links(facet)[0] for facet in facets], np.int64)
    numbers = [int(np.flatnonzero(back.links(cell) == facet)[0]) for cell, facet in zip(beside, facets, strict=True)]
    whole: Any = space.element.basix_element
    element = lagrange("triangle" if mesh.kind == "tetrahedron" else "quadrilateral", whole.degree)
    corners, topology = basix.geometry(basix.CellType[mesh.kind]), basix.topology(basix.CellType[mesh.kind])[2]
    local = np.empty((len(topology), element.dim), np.int64)  # the nodes of each side of a cell
    for number, vertices in enumerate(topology):
        first, *others = corners[vertices[:3]]
        places = first + element.points @ np.stack([other - first for other in others])
        local[number] = [int(np.argmin(np.linalg.norm(whole.points - place, axis=1))) for place in places]
    nodes, places = space.dofmap.list[beside], space.tabulate_dof_coordinates()
    own = np.take_along_axis(nodes, local[numbers], axis=1)
    found = Facets(displacement.dofs[own], places[own], np.ones(len(own)), element)
    middle = found.places(found.rest, np.arange(len(own)), np.full((len(own), 2), 1 / 3))
    outward = np.einsum("ni,ni->n", middle.point - places[nodes].mean(axis=1), middle.normal)
    return replace(found, outward=np.sign(outward))
