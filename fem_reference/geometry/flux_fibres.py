"""Fibres by area: streamlines of a potential flow that enters a muscle evenly over one attachment and leaves evenly over the other.

The flux per area of an attachment is constant, so lines that start evenly over one attachment end evenly over the other, and both
areas are covered. In contrast, the gradient of a potential that is constant on each attachment is concentrated at the rims; in a
sheet with a fully attached face, nearly all lines would start at the edge next to the other attachment.
"""

from dataclasses import dataclass

import numpy as np
from scipy.sparse import coo_array, csc_array
from scipy.sparse.linalg import splu
from scipy.spatial import cKDTree

from fem_reference.foundations.errors import InputError
from fem_reference.foundations.mesh import (
    TET_FACES,
    Floats,
    Ints,
    Polylines,
    TetMesh,
    edge_vectors,
    tet_volumes,
    triangle_areas,
)
from fem_reference.foundations.rows import distinct
from fem_reference.geometry.fibres import POINTS, FibreField, averaged, resample, spread

MOST = 1000  # the maximum number of fibres
_LINES, _LINES_EACH = 1000, 8  # the minimum numbers of lines, in total and per fibre, from which fibres are chosen
_ROUNDS = 50  # the maximum number of iterations of Lloyd's algorithm, which converges in fewer
_PLASTIC = 1.324717957244746  # root of x^3 = x + 1; its powers spread points evenly (Roberts 2018, the R2 sequence)


@dataclass(frozen=True, eq=False)
class Flow:
    """A divergence-free flow through the tetrahedra of a ``mesh``, with a total flux of 1 from the facets ``start`` (m, 3) to
    ``end``. Each tetrahedron has the constant flow ``slopes`` (k, 3) [1/mm2], the indices ``faces`` (k, 4) of the triangles
    opposite its corners, and the gradients ``rises`` (k, 4, 3) [1/mm] of its barycentric coordinates.
    """

    mesh: TetMesh
    start: Ints
    end: Ints
    faces: Ints
    rises: Floats
    slopes: Floats

    @property
    def field(self) -> FibreField:
        """Directions of the flow as a continuous field: at a mesh point, the volume-weighted mean over the tetrahedra around it."""
        no_values = np.full(len(self.mesh.points), np.nan)  # the potential is not constant on attachments
        return FibreField(self.mesh, no_values, averaged(self.mesh, self.slopes), self.start, self.end)


def area_flux(mesh: TetMesh, start: str, end: str) -> Flow:
    """Compute the flow from facets ``start`` of a ``mesh`` to facets ``end``, uniform over the area of both and 0 through the
    rest of the boundary. It is the gradient of a potential u with ``-laplace u = 0`` and ``du/dn = -1/A_start``, ``1/A_end`` or 0.

    The elements are of the Crouzeix-Raviart type. Their gradients are lowest-order Raviart-Thomas fields, so the flux out of a
    tetrahedron exactly equals the flux into the next (Marini 1985, SIAM J. Numer. Anal. 22:493).
    """
    triangles = _triangles(mesh)
    _, first, numbers, _ = distinct(triangles)
    faces, count = numbers.reshape(-1, 4), len(first)
    inverse = np.linalg.inv(edge_vectors(mesh.points[mesh.tets]))
    rises = np.concatenate([-inverse.sum(axis=1, keepdims=True), inverse], axis=1)
    volumes = tet_volumes(mesh.points, mesh.tets)
    stiffness = 9 * volumes[:, None, None] * np.einsum("kia,kja->kij", rises, rises)
    rows, columns = np.broadcast_arrays(faces[:, :, None], faces[:, None, :])
    matrix = csc_array(coo_array((stiffness.ravel(), (rows.ravel(), columns.ravel())), shape=(count, count)))
    through = np.zeros(count)
    for facets, sign in ((mesh.facets[start], -1.0), (mesh.facets[end], 1.0)):
        areas = triangle_areas(mesh.points, facets)
        through[_numbers(triangles[first], facets)] += sign * areas / areas.sum()
    potential = np.zeros(count)  # defined up to a constant; the first face has the value 0
    potential[1:] = splu(matrix[1:, 1:]).solve(through[1:])
    slopes = -3 * np.einsum("ki,kia->ka", potential[faces], rises)
    return Flow(mesh, mesh.facets[start], mesh.facets[end], faces, rises, slopes)


def streamlines(flux: Flow, count: int) -> Polylines:
    """Compute ``count`` lines of 40 points along ``flux``, spread evenly over both attachments; InputError if too many.

    More lines than ``count`` are started evenly over the area and grouped so that the groups are compact at both ends (Lloyd 1982),
    with distances in units of the size of each attachment. The central line of each group is returned.
    """
    if count > MOST:
        raise InputError("fibres.traced.count", count, f'at most {MOST} with flux = "area"')
    lines = _followed(flux, *_starts(flux, max(_LINES, _LINES_EACH * count)))
    sizes = [np.sqrt(triangle_areas(flux.mesh.points, facets).sum()) for facets in (flux.start, flux.end)]
    ends = np.array([[line[0] / sizes[0], line[-1] / sizes[1]] for line in lines]).reshape(-1, 6)
    kept = _middles(ends, count) if len(lines) >= count else np.arange(len(lines))
    if len(kept) < count:
        raise InputError("fibres.traced.count", count, f"at most {len(kept)}, the number that could be traced")
    return Polylines(np.concatenate([resample(lines[i]) for i in kept]), np.arange(count + 1) * POINTS)


def _triangles(mesh: TetMesh) -> Ints:
    """Corners (4 k, 3) of the four triangles of each tetrahedron, sorted within each triangle."""
    return np.asarray(np.sort(mesh.tets[:, TET_FACES].reshape(-1, 3), axis=1))


def _numbers(triangles: Ints, facets: Ints) -> Ints:
    """Index (m,) of each of ``facets`` (m, 3) among the distinct ``triangles`` (n, 3), whose corners are sorted."""
    return distinct(np.concatenate([triangles, np.sort(facets, axis=1)])).which[len(triangles) :]


def _starts(flux: Flow, count: int) -> tuple[Ints, Floats]:
    """Spread ``count`` points evenly over the area where the flow begins; returns their tetrahedra (n,) and the points (n, 3)."""
    mesh, facets = flux.mesh, flux.start
    shares = np.cumsum(triangle_areas(mesh.points, facets))
    facet = np.searchsorted(shares / shares[-1], (np.arange(count) + 1 / _PLASTIC) / count)  # never on a facet's rim
    square = (0.5 + np.arange(1, count + 1)[:, None] / _PLASTIC ** np.array([1, 2])) % 1
    beyond = square.sum(axis=1) > 1
    square[beyond] = 1 - square[beyond]  # points in the other half of the square are mirrored into the triangle
    weights = np.column_stack([1 - square.sum(axis=1), square])
    triangles = _triangles(mesh)
    on = {tuple(corners): number // 4 for number, corners in enumerate(triangles.tolist())}
    tets = np.array([on[tuple(corners)] for corners in np.sort(facets, axis=1).tolist()])
    return tets[facet], np.einsum("ni,nia->na", weights, mesh.points[facets[facet]])


def _followed(flux: Flow, tets: Ints, points: Floats) -> list[Floats]:
    """Lines (n, 3) from ``points`` (k, 3) in ``tets`` (k,), straight in each tet; only those that reach the end of the flow."""
    beyond, going, met = _neighbours(flux.faces), np.arange(len(points)), np.full(len(points), -1)
    passed, arrives, ends = [(going, points)], np.zeros(len(points), bool), _numbers(_triangles(flux.mesh), flux.end)
    for _ in range(len(flux.mesh.tets)):  # a line passes through each tetrahedron at most once
        local = np.einsum("nia,na->ni", flux.rises[tets], points - flux.mesh.points[flux.mesh.tets[tets, 0]])
        rates = np.einsum("nia,na->ni", flux.rises[tets], flux.slopes[tets])
        local[:, 0] += 1
        out = (rates < 0) & (flux.faces[tets] != met[:, None])
        times = np.where(out, np.maximum(local, 0) / np.where(out, -rates, 1.0), np.inf)
        side = np.argmin(times, axis=1)
        time, after, met = np.min(times, axis=1), beyond[tets, side], flux.faces[tets, side]
        points = points + np.where(np.isfinite(time), time, 0.0)[:, None] * flux.slopes[tets]
        passed.append((going, points))
        arrives[going[np.isin(met, ends) & np.isfinite(time)]] = True
        on = (after >= 0) & np.isfinite(time)
        going, points, tets, met = going[on], points[on], after[on], met[on]
        if len(going) == 0:
            break
    numbers, places = (np.concatenate(parts) for parts in zip(*passed, strict=True))
    order = np.argsort(numbers, kind="stable")
    lines = np.split(places[order], np.cumsum(np.bincount(numbers))[:-1])
    return [line for line, one in zip(lines, arrives, strict=True) if one]


def _neighbours(faces: Ints) -> Ints:
    """Index (k, 4) of the tetrahedron on the other side of each of the ``faces`` (k, 4) of tetrahedra, -1 on the boundary."""
    order = np.argsort(faces.ravel(), kind="stable")
    twice = np.flatnonzero(np.diff(faces.ravel()[order]) == 0)
    one, other = order[twice], order[twice + 1]
    beyond = np.full(faces.size, -1)
    beyond[one], beyond[other] = other // 4, one // 4
    return beyond.reshape(-1, 4)


def _middles(points: Floats, count: int) -> Ints:
    """Indices of at most ``count`` of ``points`` (n, d): the point nearest to the mean of each group found by Lloyd's algorithm."""
    middles = spread(points, count)
    for _ in range(_ROUNDS):
        _, group = cKDTree(middles).query(points)
        sizes = np.maximum(np.bincount(group, minlength=count), 1)
        middles = np.stack([np.bincount(group, weights=axis, minlength=count) / sizes for axis in points.T], axis=1)
    off, group = cKDTree(middles).query(points)
    order = np.lexsort((off, group))
    return np.asarray(order[np.unique(group[order], return_index=True)[1]])
