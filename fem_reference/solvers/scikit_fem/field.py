"""Scalar fields: Lagrange elements, assembled by scikit-fem, with equations solved by scipy's sparse LU factorisation.

Each triangle of a surface in space is mapped to a plane before assembly. The map preserves lengths and areas within the surface,
which suffices for the equations; gradients are rotated back into space.
"""

import time
from dataclasses import dataclass, replace
from functools import partial
from typing import Any, Literal

import numpy as np
import skfem
from scipy.sparse.linalg import LinearOperator, norm, onenormest, splu
from skfem.helpers import grad
from skfem.mesh import MeshTri1DG

from fem_reference.effects import FieldState, Place
from fem_reference.foundations.mesh import Floats
from fem_reference.foundations.records import Record
from fem_reference.geometry.field_mesh import FieldMesh
from fem_reference.problems.scalar import FieldProblem, at
from fem_reference.runs.store import Frame, Outcome, Sink

QUADRATURE_DEGREE = 8
_SINGULAR = 1e15  # with a larger condition number, no digit of the solution is correct
# The elements of order 1 and 2, by the number of corners of a cell.
_ELEMENTS = {2: (skfem.ElementLineP1, skfem.ElementLineP2), 3: (skfem.ElementTriP1, skfem.ElementTriP2)}


class ScikitFieldSettings(Record):
    """Settings for scalar fields.

    ``form``: the weak form, either that of the ``scene`` or, to show the effect of stabilisation, plain ``galerkin`` in any scene.
    """

    form: Literal["scene", "galerkin"] = "scene"


@dataclass(frozen=True, eq=False)
class Flat:
    """A ``mesh`` of scikit-fem. ``frames`` (m, d, t) and ``origins`` (m, d) map the flat coordinates (t,) in each cell to
    coordinates (d,) in the domain.
    """

    mesh: Any
    frames: Floats
    origins: Floats


def flat(mesh: FieldMesh) -> Flat:
    """The mesh of scikit-fem for ``mesh``. If this is a surface in space, each cell is mapped to a plane."""
    d = mesh.points.shape[1]
    if d < 3:
        kind = skfem.MeshLine if d == 1 else skfem.MeshTri
        frames = np.broadcast_to(np.eye(d), (len(mesh.cells), d, d))
        return Flat(kind(mesh.points.T.copy(), mesh.cells.T.copy()), frames, np.zeros((len(mesh.cells), d)))
    corners = mesh.points[mesh.cells]
    frames, sides = np.linalg.qr((corners[:, 1:] - corners[:, :1]).transpose(0, 2, 1))
    points = np.concatenate([np.zeros((len(corners), 2, 1)), sides], axis=2).transpose(0, 2, 1)
    return Flat(MeshTri1DG(points.reshape(-1, 2).T.copy(), mesh.cells.T.copy()), frames, corners[:, 0])


def space(problem: FieldProblem) -> tuple[Any, Flat]:
    """The basis of the elements of a problem, and the flat mesh."""
    laid = flat(problem.mesh)
    element = _ELEMENTS[problem.mesh.cells.shape[1]][problem.order - 1]()
    return skfem.Basis(laid.mesh, element, intorder=QUADRATURE_DEGREE), laid


def assemble(problem: FieldProblem) -> tuple[Any, Floats]:
    """The matrix (N, N) and right-hand side (N,) of the weak form, without fixed values, with nodes in the order of the problem."""
    basis, laid = space(problem)
    slope_of = _slope_weights(basis)
    position = np.einsum("mda,amq->dmq", laid.frames, np.asarray(basis.global_coordinates()))
    place = Place(tuple(position + laid.origins.T[:, :, None]), vars(np), problem.upper[:, None])

    def state(function: Any) -> FieldState:
        gradient = np.einsum("mda,amq->dmq", laid.frames, grad(function))
        laplacian = np.einsum("maq,amq->m", slope_of, grad(function))[:, None]
        return FieldState(np.asarray(function), tuple(gradient), laplacian)

    nothing = FieldState(0.0, (0.0,) * problem.mesh.points.shape[1])

    def residual(psi: FieldState, test: FieldState) -> Any:
        weak = sum(effect.weak(psi, test, place) for effect in problem.effects)
        if problem.tau is None or problem.advection is None:
            return weak
        strong = sum(effect.strong(psi, place) for effect in problem.effects)
        return weak + problem.tau[:, None] * problem.advection.along(test) * strong

    matrix = skfem.BilinearForm(lambda u, v, _: residual(state(u), state(v)) - residual(nothing, state(v)))
    vector = skfem.LinearForm(lambda v, _: -residual(nothing, state(v)) + 0 * np.asarray(v))
    order = order_of(problem, basis)
    A, b = matrix.assemble(basis)[order][:, order], vector.assemble(basis)[order]
    return A, b + _fluxes(problem)


def solve(problem: FieldProblem, settings: ScikitFieldSettings, sink: Sink) -> Outcome:
    """Assemble and solve the equations of a problem, and pass the field to ``sink``."""
    if settings.form == "galerkin":
        problem = replace(problem, tau=None)
    values, outcome = _solved(problem)
    sink(Frame.of_field(problem, values, problem.form))
    return outcome


def _solved(problem: FieldProblem) -> tuple[Floats, Outcome]:
    """The values (N,) at the nodes, which are NaN after a failure, and the outcome."""
    begin = time.perf_counter()
    A, b = assemble(problem)
    assembled = time.perf_counter()
    free = np.isnan(problem.fixed)
    values = np.where(free, 0.0, problem.fixed)
    if not (np.isfinite(A.data).all() and np.isfinite(b).all()):
        return _failed(len(b), "a coefficient or source is not finite at some point")
    if free.any():
        inner = A[free][:, free].tocsc()
        try:
            factors = splu(inner)
        except RuntimeError:  # raised by SuperLU if a pivot is zero
            return _failed(len(b), "the equations have no unique solution")
        solve, transposed = factors.solve, partial(factors.solve, trans="T")
        inverse = LinearOperator(inner.shape, solve, transposed, solve, dtype=inner.dtype)
        condition = onenormest(inverse) * norm(inner, 1)
        if not condition < _SINGULAR:
            return _failed(len(b), f"the equations have no unique solution (condition number {condition:.1e})")
        values[free] = factors.solve(b[free] - A[free][:, ~free] @ values[~free])
    cost = {"seconds_assembly": assembled - begin, "seconds_solve": time.perf_counter() - assembled}
    return values, Outcome("converged", f"{len(b)} nodes", cost | {"unknowns": float(free.sum())})


def _failed(count: int, why: str) -> tuple[Floats, Outcome]:
    return np.full(count, np.nan), Outcome("diverged", why)


def _slope_weights(basis: Any) -> Floats:
    """The weights (m, t, q) by which the values of a linear function at the q quadrature points of a cell give its derivatives.

    The gradient of a quadratic function is linear, so the weights give its Laplacian, which scikit-fem does not offer.
    """
    at_points = np.asarray(basis.global_coordinates()).transpose(1, 0, 2)
    return np.asarray(np.linalg.pinv(at_points - at_points.mean(axis=2, keepdims=True)).transpose(0, 2, 1))


def order_of(problem: FieldProblem, basis: Any) -> Any:
    """The index (N,) of scikit-fem's unknown at each node of the problem."""
    vertices = basis.nodal_dofs[0]
    if problem.order == 1:
        return vertices
    mesh = problem.mesh
    if mesh.cells.shape[1] == 2:
        ends, middles = mesh.cells, basis.interior_dofs[0]
    else:
        ends, middles = basis.mesh.facets.T, basis.facet_dofs[0]
    place = mesh.edge_numbers(ends)
    return np.concatenate([vertices, middles[np.argsort(place)]])


def _fluxes(problem: FieldProblem) -> Floats:
    """The integral (N,) over the boundary of ``k * slope`` times each shape function, by the 3-point Gauss rule on edges."""
    b = np.zeros(len(problem.fixed))
    for flux in problem.fluxes:
        ends = problem.mesh.points[flux.facets]
        if flux.facets.shape[1] == 1:
            np.add.at(b, flux.facets[:, 0], problem.diffusion * at(flux.slope, ends[:, 0]))
            continue
        edges = np.sort(flux.facets, axis=1)
        ends = problem.mesh.points[edges]
        middles = len(problem.mesh.points) + problem.mesh.edge_numbers(edges)
        lengths = np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1)
        for s, weight in zip(*_GAUSS, strict=True):
            flow = weight * lengths * problem.diffusion * at(flux.slope, (1 - s) * ends[:, 0] + s * ends[:, 1])
            hats = (1 - s, s) if problem.order == 1 else ((1 - s) * (1 - 2 * s), s * (2 * s - 1), 4 * s * (1 - s))
            for nodes, hat in zip((*edges.T, middles), hats, strict=False):  # order 1 has no mid-edge nodes
                np.add.at(b, nodes, hat * flow)
    return b


_GAUSS = (np.array([0.5 - np.sqrt(0.15), 0.5, 0.5 + np.sqrt(0.15)]), np.array([5.0, 8.0, 5.0]) / 18)
