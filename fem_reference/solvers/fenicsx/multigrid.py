"""Linear systems too large for a factorisation: FGMRES with two levels of elements, P2 and P1.

The preconditioner is block triangular (Murphy, Golub and Wathen 2000, doi 10.1137/S1064827599355153). Displacement block: one cycle
between the quadratic and the linear element on the same cells, with Chebyshev smoothing and a factorised coarse level. Pressure
block: the mass matrix divided by local stiffness, which is spectrally equivalent to the Schur complement (Wathen and Silvester
1993, doi 10.1137/0730031).
"""

from typing import Any

import numpy as np
from dolfinx import fem
from dolfinx.fem.petsc import interpolation_matrix
from petsc4py import PETSc
from scipy.sparse import csr_array

from fem_reference.foundations.mesh import Ints
from fem_reference.solvers.fenicsx.linear import Factorised, LinearSolveError, fgmres, iterate
from fem_reference.solvers.fenicsx.system import System

_SMOOTHING = 2  # the degree of the Chebyshev polynomial
_MOST = 200  # the maximum number of iterations
_STALE = 15  # iterations up to which a preconditioner is never stale


class Multigrid:
    """Solves with the matrix of a ``system`` on one rank. The element must be quadratic and have a pressure."""

    def __init__(self, system: System) -> None:
        self.system, self.matrix, self.spent = system, system.matrix, system.spent
        cells = system.cells
        displaced = np.unique(cells.unknowns[:, : 3 * cells.nodes])
        pressures = np.unique(cells.unknowns[:, 3 * cells.nodes :])
        self.sets = [PETSc.IS().createGeneral(names.tolist()) for names in (displaced, pressures)]
        self.number = np.zeros(system.size, np.int64)  # the number of each unknown within its block
        self.number[displaced], self.number[pressures] = np.arange(len(displaced)), np.arange(len(pressures))
        self.coarse, self.fixed = self._interpolation(displaced.astype(np.int64))
        self.krylov = fgmres(self.matrix, _MOST)
        self.stale, self.first = True, 0

    def solve(self, b: PETSc.Vec, x: PETSc.Vec, tolerance: float) -> None:
        """Solve for ``x``, to ``tolerance`` times the norm of ``b``. Raises ``LinearSolveError`` if this fails."""
        fresh = self.stale
        if fresh:
            self._renew()
        if iterate(self.krylov, b, x, tolerance, _MOST, self.spent):
            iterations = self.krylov.getIterationNumber()
            per_digit = iterations / -np.log10(tolerance)
            self.first = per_digit if fresh else self.first
            self.stale = per_digit > 1.5 * self.first and iterations > _STALE
            return
        if not fresh:
            self._renew()
        if fresh or not iterate(self.krylov, b, x, tolerance, _MOST, self.spent):
            raise LinearSolveError(f"multigrid does not converge in {_MOST} iterations")

    def solve_exactly(self) -> bool:
        """Return False: memory does not suffice for a factorisation."""
        return False

    def _renew(self) -> None:
        """Build the preconditioner. It solves for the pressure first, then for the displacement from the remaining forces."""
        with self.spent.on("factorisation"):
            kinds: Any = PETSc.PC  # the stubs declare its members as numbers
            blocks = PETSc.PC().create(self.matrix.comm)
            blocks.setOperators(self.matrix, self.matrix)
            blocks.setType("fieldsplit")
            blocks.setFieldSplitIS(("displacement", self.sets[0]), ("pressure", self.sets[1]))
            blocks.setFieldSplitType(kinds.CompositeType.SCHUR)
            blocks.setFieldSplitSchurFactType(kinds.FieldSplitSchurFactType.UPPER)
            blocks.setFieldSplitSchurPreType(kinds.FieldSplitSchurPreType.USER, self._schur())
            blocks.setUp()
            blocks.setReusePreconditioner(True)  # until it is stale
            moves, pressures = blocks.getFieldSplitSchurGetSubKSP()
            moves.setType("preonly")
            moves.setPC(self._cycle(moves.getOperators()[0]))
            pressures.setType("preonly")
            pressures.getPC().setType("cholesky")
            pressures.getPC().setFactorSolverType("mumps")
            self.krylov.setPC(blocks)
        self.spent.counts["factorisations"] += 1
        self.stale = False

    def _cycle(self, stiff: PETSc.Mat) -> PETSc.PC:
        """The preconditioner of one cycle between the two elements."""
        coarse = stiff.ptap(self.coarse)
        coarse.zeroRowsColumns(self.fixed.tolist(), diag=1.0)
        stiff.setBlockSizes(3, 3)  # the components of a node are neighbours
        stiff = stiff.convert(PETSc.Mat.Type.BAIJ)
        cycle = PETSc.PC().create(stiff.comm)
        cycle.setOperators(stiff, stiff)
        cycle.setType("mg")
        cycle.setMGLevels(2)
        cycle.setMGInterpolation(1, self.coarse)
        below = cycle.getMGCoarseSolve()
        below.setOperators(coarse, coarse)
        below.setType("preonly")
        below.getPC().setType("lu")
        below.getPC().setFactorSolverType("mumps")
        smoother = cycle.getMGSmoother(1)
        smoother.setOperators(stiff, stiff)
        smoother.setType("chebyshev")
        smoother.setTolerances(max_it=_SMOOTHING)
        smoother.getPC().setType("pbjacobi")
        cycle.setUp()
        return cycle

    def _interpolation(self, displaced: Ints) -> tuple[PETSc.Mat, Ints]:
        """The interpolation from the linear to the quadratic element on the same cells, 0 for prescribed unknowns; and the fixed
        unknowns of the linear element, at the corners where the quadratic element has a fixed unknown.
        """
        space, parents = self.system.unknowns.function_space.sub(0).collapse()
        corners = interpolation_matrix(fem.functionspace(space.mesh, ("Lagrange", 1, (3,))), space)
        corners.assemble()
        starts, columns, shares = corners.getValuesCSR()
        order = np.argsort(self.number[np.ravel(parents)])
        found = csr_array((shares, columns, starts), shape=corners.getSize())[order].tocoo()
        prescribed = self.system.fixed[displaced][found.row]
        fixed = np.unique(found.col[(found.data > 1 - 1e-12) & prescribed])
        found.data[prescribed | np.isin(found.col, fixed) | (np.abs(found.data) < 1e-12)] = 0.0
        return self._matrix(csr_array(found)), fixed

    def _schur(self) -> PETSc.Mat:
        """Minus the mass matrix of the pressure divided by the local stiffness; it replaces the Schur complement."""
        system, cells = self.system, self.system.cells
        blocks = cells.softness() * system.tangent.unit**2
        names = self.number[cells.unknowns[:, 3 * cells.nodes :]]
        rows, columns = np.repeat(names, names.shape[1], axis=1), np.tile(names, (1, names.shape[1]))
        size = self.sets[1].getSize()
        return self._matrix(csr_array((-blocks.ravel(), (rows.ravel(), columns.ravel())), shape=(size, size)))

    def _matrix(self, found: csr_array) -> PETSc.Mat:
        found.sum_duplicates()
        csr = (found.indptr.astype(np.int32), found.indices.astype(np.int32), found.data)
        return PETSc.Mat().createAIJ(found.shape, csr=csr, comm=self.matrix.comm)


LinearSolver = Factorised | Multigrid
