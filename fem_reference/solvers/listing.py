"""The report's Octave listings 4.1 (an interval) and 4.5 (triangles), with their results even where these contradict the text.

Listings 4.1, 4.2, 4.4 and 4.5 are transcribed. Vertices are numbered from 0 here and from 1 in the listings. The argument
``bounds`` (2, m) is the list of Dirichlet conditions in the listings: a row of vertices and a row of values. Listing 4.5 uses only
the directions of edges, so lengths may have any unit. validation/octave contains the listings as they were run, their
results, and the interpretation of each misprint.
"""

import time
from typing import Any

import numpy as np
from pydantic import Field
from scipy import sparse
from scipy.sparse.linalg import spsolve

from fem_reference.foundations.errors import InputError
from fem_reference.foundations.mesh import Floats, Ints
from fem_reference.foundations.records import Record, join
from fem_reference.problems.scalar import FieldProblem, at
from fem_reference.runs.store import Frame, Outcome, Sink
from fem_reference.solvers.common.protocol import FieldSolver

# The factors of A A, A and the identity matrix in line 18 of listing 4.5.
SQUARE, LINEAR, CONSTANT = 26.0, 2.0, 0.05


class ListingSettings(Record):
    """Settings of the report's listings.

    ``peclet``: the Peclet number, which is the argument of listing 4.1, by default 1 as in its header. Listing 4.5 has no argument.
    """

    peclet: float | None = Field(default=None, gt=0)


def solve(problem: FieldProblem, settings: ListingSettings, sink: Sink) -> Outcome:
    """Run the listing for the domain of the problem: 4.1 for an interval, 4.5 for triangles.

    The mesh is that of the problem, and so are the fixed values of listing 4.5; the listing defines the equation and the slopes.
    Listing 4.5 plots minus the norm of its vector unknown. This plotted value is the field, and ``components`` is the vector.
    """
    begin = time.perf_counter()
    mesh = problem.mesh
    check(settings, problem, "listing")
    if mesh.cells.shape[1] == 2:
        values, components = fem1d(mesh.points[:, 0], settings.peclet or 1.0), None
    else:
        fixed = np.flatnonzero(~np.isnan(problem.fixed[: len(mesh.points)]))
        bounds = np.array([fixed, problem.fixed[fixed]])
        norms, components = fem2d(mesh.cells, mesh.points, bounds)
        values = 0.0 - norms
    if problem.order == 2:  # the listings are linear between vertices
        values = np.concatenate([values, values[mesh.edges].mean(axis=1)])
    unknowns = len(mesh.points) if components is None else components.size
    cost = {"seconds_solve": time.perf_counter() - begin, "unknowns": float(unknowns)}
    sink(Frame.of_field(problem, values, "as in the report's listing", components))
    return Outcome("converged", "computed as in the report's listing", cost)


def check(settings: ListingSettings, problem: FieldProblem, place: str) -> None:
    """Raise InputError, with a key inside ``place``, if the listing does not have the boundary conditions or settings requested.

    Listing 4.1 has value 0 at the first node and slope -1 at the last. Listing 4.5 has fixed values, but no slope or Peclet number.
    """
    points, fixed = problem.mesh.points, problem.fixed[: len(problem.mesh.points)]
    if problem.mesh.cells.shape[1] == 2:
        slopes = [(point, at(flux.slope, points[[point]])[0]) for flux in problem.fluxes for point in flux.facets[:, 0]]
        if not (fixed[0] == 0 and np.isnan(fixed[1:]).all() and slopes == [(len(points) - 1, -1.0)]):
            want = "value 0 on the left and slope -1 on the right, as listing 4.1 has"
            raise InputError(join(place, "boundary"), "other conditions", want)
    elif settings.peclet is not None:
        raise InputError(join(place, "peclet"), settings.peclet, "no peclet: listing 4.5 has none")
    elif problem.fluxes:
        raise InputError(join(place, "boundary"), "a slope", "values only: listing 4.5 has no slopes")


def fem1d(nodes: Floats, peclet: float) -> Floats:
    """The solution (n,) of listing 4.1 at increasing ``nodes`` (n,): 0 at the first node, with the slope -1 / peclet at the last.

    ``diff_op`` is ``-peclet K``, where K is the stiffness matrix of linear elements, and the source 1 is divided by ``peclet``.
    Therefore the listing solves ``peclet psi'' = 1 / peclet`` with ``peclet psi'(1) = -1``, without advection. On (0, 1) the values
    are exact at any nodes: ``psi = x^2 / (2 peclet^2) - x (1 / peclet + 1 / peclet^2)``, which is eq. 4.10 if ``peclet`` is 1.
    Raises InputError if the nodes do not increase or ``peclet`` is not positive.
    """
    steps = np.diff(nodes)
    if len(steps) == 0 or not (steps > 0).all():
        raise InputError("nodes", "nodes that do not increase", "two or more, in increasing order")
    if not peclet > 0:
        raise InputError("peclet", peclet, "more than zero")
    idel = peclet / steps
    left, right = np.append(idel, 0), np.append(0, idel)
    diff_op = sparse.diags_array([idel, -left - right, idel], offsets=[-1, 0, 1], format="csr")
    right_side = np.append(0.5 / idel, 0) + np.append(0, 0.5 / idel)
    right_side[-1] -= -1
    diff_op, right_side = dirichlet(diff_op, right_side, 1, np.zeros((2, 1)))
    return np.asarray(spsolve(diff_op.tocsc(), right_side))


def first_derivative(triangles: Ints, points: Floats) -> Any:
    """The sparse matrix A (n dim, n dim) of listing 4.2, for ``triangles`` (m, 3) of ``points`` (n, dim).

    A has a block (dim, dim) for each pair of points. For each edge of each triangle, with the unit vector d along the edge,
    ``d d^T`` is added to the diagonal blocks of both ends and subtracted from the two blocks that couple the ends. A is not a
    differential operator: ``u^T A u = sum over edges of w (d . (u_s - u_t))^2`` is twice the energy of springs along the edges.
    Their stiffness w does not depend on the length: it is 2 for an interior edge and 1 for a boundary edge.
    """
    dim = points.shape[1]
    s, t = triangles.ravel(), np.roll(triangles, -1, axis=1).ravel()
    d = points[s] - points[t]
    lengths = np.linalg.norm(d, axis=1)
    if not (lengths > 0).all():
        edge = int(np.argmin(lengths > 0))
        got = f"vertices {s[edge]} and {t[edge]} of one edge at the same place"
        raise InputError("points", got, "edges with a direction")
    d /= lengths[:, None]
    dj = d[:, :, None] * d[:, None, :]
    rows, columns = np.concatenate([s, t, s, t]), np.concatenate([t, s, s, t])
    blocks = np.concatenate([-dj, -dj, dj, dj])
    axes = np.arange(dim)
    i = np.broadcast_to(rows[:, None, None] * dim + axes[:, None], blocks.shape).ravel()
    j = np.broadcast_to(columns[:, None, None] * dim + axes, blocks.shape).ravel()
    return sparse.coo_array((blocks.ravel(), (i, j)), shape=(points.size, points.size)).tocsr()


def dirichlet(A: Any, b: Floats, dim: int, bounds: Floats) -> tuple[Any, Floats]:
    """Apply Dirichlet conditions as in listing 4.4. Returns A (n dim, n dim) and b (n dim,).

    Each component of each vertex in ``bounds`` (2, m) is set to the value of the vertex. The columns of these unknowns are moved to
    the right-hand side, and their rows and columns are replaced by those of the identity matrix. Raises InputError if a vertex
    is listed twice: the listing would use its first value for its neighbours and its last value for the vertex itself.
    """
    vertices = bounds[0].astype(np.int64)
    if len(np.unique(vertices)) < len(vertices):
        raise InputError("bounds", "a vertex named twice", "one value for each vertex")
    fixed = (vertices[:, None] * dim + np.arange(dim)).ravel()
    values = np.zeros(len(b))
    values[fixed] = np.repeat(bounds[1], dim)
    free = np.ones(len(b))
    free[fixed] = 0
    keep = sparse.diags_array(free)
    return keep @ A @ keep + sparse.diags_array(1 - free), np.where(free > 0, b - A @ values, values)


def right_side(points: Floats) -> Floats:
    """The right-hand side (n dim,) in line 17 of listing 4.5: 1 for all components of ``points`` (n, dim) above the mean y, else 0.

    The sum for the mean goes from the first point to the last, as in Octave, so that a point at the mean is on the same side.
    """
    y = points[:, 1]
    return np.repeat((y > np.cumsum(y)[-1] / len(y)).astype(np.float64), points.shape[1])


def fem2d(triangles: Ints, points: Floats, bounds: Floats) -> tuple[Floats, Floats]:
    """The results x (n,) and u (n, dim) of listing 4.5 on ``triangles`` (m, 3) of ``points`` (n, 2 or 3).

    The listing solves ``(26 A A + 2 A + 0.05) u = b``; x is the norm of u at each point, and the listing plots -x. A, from listing
    4.2, is positive semidefinite and so has the sign of a negative second derivative. Therefore the three terms correspond to
    derivatives of order 4, 2 and 0, whereas the text's ``26 psi'' + 2 psi' + 0.05 psi = f`` has the orders 2, 1 and 0.
    """
    dim = points.shape[1]
    A = first_derivative(triangles, points)
    operator = SQUARE * A @ A + LINEAR * A + CONSTANT * sparse.eye_array(points.size)
    operator, b = dirichlet(operator, right_side(points), dim, bounds)
    unknown = np.reshape(spsolve(operator.tocsc(), b), points.shape)
    return np.linalg.norm(unknown, axis=1), unknown


SOLVES = (FieldSolver(settings=ListingSettings, solve=solve, check_problem=check, example={}),)
