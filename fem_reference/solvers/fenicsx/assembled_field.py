"""Scalar fields, assembled and solved in the FEniCSx process."""

import time
from typing import Any

import numpy as np

from fem_reference.effects import FieldState, Place
from fem_reference.foundations.formula import FUNCTIONS, evaluate
from fem_reference.foundations.mesh import Floats, Ints
from fem_reference.foundations.subprocesses import forget_peak_memory, peak_memory
from fem_reference.problems.scalar import FieldProblem
from fem_reference.runs.store import Outcome
from fem_reference.solvers.fenicsx.dolfinx_door import PETSc

import basix  # isort: skip - after dolfinx_door
import basix.ufl  # isort: skip
import ufl  # isort: skip
from dolfinx import fem, mesh  # isort: skip
from dolfinx.fem.petsc import apply_lifting, assemble_matrix, assemble_vector, set_bc  # isort: skip
from mpi4py import MPI  # isort: skip
from fem_reference.solvers.fenicsx import compiling, meshes  # isort: skip

QUADRATURE_DEGREE = 8  # as in scikit_fem
FACET_DEGREE = 5  # as in scikit_fem, whose rule on the boundary has 3 points


def equations(problem: FieldProblem) -> tuple[Any, Any, Any, Ints]:
    """The compiled bilinear form, the compiled linear form, the function space, and the problem's node (N,) at each unknown."""
    msh = distribute(problem)
    space = fem.functionspace(msh, ("Lagrange", problem.order))
    psi, test = _state(ufl.TrialFunction(space)), _state(ufl.TestFunction(space))
    functions = {name: getattr(ufl, name) for name in FUNCTIONS}
    place = Place(tuple(ufl.SpatialCoordinate(msh)), functions, _by_cell(msh, problem.upper))
    weak = sum(effect.weak(psi, test, place) for effect in problem.effects)
    if problem.tau is not None and problem.advection is not None:
        strong = sum(effect.strong(psi, place) for effect in problem.effects)
        weak += _by_cell(msh, problem.tau) * problem.advection.along(test) * strong
    dx = ufl.Measure("dx", domain=msh, metadata={"quadrature_degree": QUADRATURE_DEGREE})
    # The zero term gives the residual a right-hand side even without sources.
    residual = weak * dx - fem.Constant(msh, 0.0) * test.value * dx
    ds = meshes.facet_measure(msh, meshes.local_facets(msh, [flux.facets for flux in problem.fluxes]), FACET_DEGREE)
    for i, flux in enumerate(problem.fluxes):
        residual -= problem.diffusion * evaluate(flux.slope, place.position, functions) * test.value * ds(i)
    left, right = ufl.system(residual)
    return compiling.form(left), compiling.form(right), space, nodes(space, problem)


def distribute(problem: FieldProblem) -> mesh.Mesh:
    """The problem's mesh in DOLFINx: intervals on a line, or triangles in the plane or in space."""
    points, cells = problem.mesh.points, problem.mesh.cells
    shape = "interval" if cells.shape[1] == 2 else "triangle"
    element = basix.ufl.element("Lagrange", shape, 1, shape=(points.shape[1],))
    return mesh.create_mesh(MPI.COMM_SELF, cells=np.array(cells), e=element, x=np.array(points))


def nodes(space: Any, problem: FieldProblem) -> Ints:
    """The problem's node (N,) at each unknown of the ``space``."""
    msh, layout, count = space.mesh, space.dofmap.dof_layout, len(problem.mesh.points)
    corners = np.asarray(msh.geometry.input_global_indices)[msh.geometry.dofmap]
    found = np.empty(space.dofmap.index_map.size_local, np.int64)
    for i in range(corners.shape[1]):
        found[space.dofmap.list[:, layout.entity_dofs(0, i)[0]]] = corners[:, i]
    if problem.order == 2:
        for i, ends in enumerate(basix.topology(msh.basix_cell())[1]):
            middles = count + problem.mesh.edge_numbers(corners[:, ends])
            found[space.dofmap.list[:, layout.entity_dofs(1, i)[0]]] = middles
    return found


def solve(problem: FieldProblem) -> tuple[Floats, Outcome]:
    """The nodal values (N,) in the order of the problem's nodes (NaN after a failure), and the outcome."""
    begin = time.perf_counter()
    forget_peak_memory()
    left, right, space, node = equations(problem)
    set_up = time.perf_counter()
    A, b = _assembled(left, right, space, problem.fixed[node])
    assembled = time.perf_counter()
    found, failure = _solved(A, b)
    cost = {"seconds_set_up": set_up - begin, "seconds_assembly": assembled - set_up}
    cost |= {"seconds_solve": time.perf_counter() - assembled, "peak_memory_mb": peak_memory()}
    cost["unknowns"] = float(np.isnan(problem.fixed).sum())
    values = np.full(len(node), np.nan)
    if failure is not None:
        return values, Outcome("diverged", failure, cost)
    values[node] = found
    return values, Outcome("converged", f"{len(node)} nodes", cost)


def _state(function: Any) -> FieldState:
    gradient = ufl.grad(function)
    return FieldState(function, tuple(gradient[i] for i in range(len(gradient))), ufl.div(gradient))


def _by_cell(msh: mesh.Mesh, values: Floats) -> fem.Function:
    """The piecewise constant function that takes the ``values`` (m,) on the problem's cells."""
    function = fem.Function(fem.functionspace(msh, ("Discontinuous Lagrange", 0)))
    function.x.array[function.function_space.dofmap.list[:, 0]] = values[msh.topology.original_cell_index]
    return function


def _assembled(left: Any, right: Any, space: Any, fixed: Floats) -> tuple[Any, Any]:
    """The matrix and the right-hand side. Each unknown whose entry in ``fixed`` (N,) is not NaN is set to that value."""
    values = fem.Function(space)
    values.x.array[:] = np.nan_to_num(fixed)
    conditions = [fem.dirichletbc(values, np.flatnonzero(~np.isnan(fixed)).astype(np.int32))]
    A = assemble_matrix(left, bcs=conditions)
    A.assemble()
    b = assemble_vector(right)
    apply_lifting(b, [left], bcs=[conditions])
    set_bc(b, conditions)
    return A, b


def _solved(A: Any, b: Any) -> tuple[Floats, str | None]:
    """The solution (N,) of ``A x = b`` by MUMPS's sparse LU factorisation, and None or the reason why there is no solution."""
    x = A.createVecRight()
    if not np.isfinite(A.norm() + b.norm()):
        return x.array, "the equations contain a number that is not finite; a formula may have no value somewhere"
    solver = PETSc.KSP().create(A.comm)
    solver.setOperators(A)
    solver.setType("preonly")
    preconditioner = solver.getPC()
    preconditioner.setType("lu")
    preconditioner.setFactorSolverType("mumps")
    preconditioner.setFactorSetUpSolverType()
    factors = preconditioner.getFactorMatrix()
    factors.setMumpsIcntl(24, 1)  # detect null pivots instead of dividing by rounding errors
    solver.solve(b, x)
    error, null_pivots = factors.getMumpsInfog(1), factors.getMumpsInfog(28)
    if null_pivots:
        return x.array, f"the equations have no unique solution (null pivots in their factorisation: {null_pivots})"
    if error < 0 or not np.isfinite(x.array).all():
        return x.array, f"the factorisation failed (INFOG(1) of MUMPS is {error})"
    return np.array(x.array), None
