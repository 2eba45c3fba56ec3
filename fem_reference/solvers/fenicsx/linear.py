"""Linear systems solved with a sparse factorisation (MUMPS), which is reused as long as it is a good preconditioner."""

from itertools import count

import numpy as np
from petsc4py import PETSc

from fem_reference.solvers.fenicsx.spent import Spent

# Indices in MUMPS's INFOG: the error, and the number of negative pivots. Indices in its ICNTL: factorising the last front on one
# process, as its pivots are otherwise not counted; and the memory beyond the estimate, in per cent.
_ERROR, _NEGATIVE, _ROOT_BY_ONE, _MORE_MEMORY = 1, 12, 13, 14
_FLOPS, _ENTRIES = 3, 29  # index in RINFOG of the operations of a factorisation, in INFOG of the entries of its factors
# Above this number of unknowns the factors are compressed by blocks (BLR: ICNTL(35)), up to an error of 1e-5 (CNTL(7)). Compression
# halves the time of a factorisation at 170 000 unknowns and gains nothing at 16 000.
_COMPRESSED_FROM, _COMPRESSION, _DROPPED = 80_000, 35, 7
# The cost of a back-substitution per entry of the factors, in operations of a factorisation (measured at 16 000 and 200 000
# unknowns).
_OPERATIONS = 22.0
_LEAST, _MOST = 12, 80  # bounds of the number of Krylov iterations for which an old factorisation is reused
_INVERSE_ITERATIONS, _RESOLVED = 4, 0.1  # for the test of single precision
_EXACT = 1e-10  # the relative residual of an exact solution, with which Newton's method converges quadratically
_number = count()


class LinearSolveError(ArithmeticError):
    """The tangent is singular, or memory does not suffice to factorise it."""


def fgmres(matrix: PETSc.Mat, most: int) -> PETSc.KSP:
    """FGMRES for a ``matrix``, with at most ``most`` iterations; the caller sets the preconditioner."""
    krylov = PETSc.KSP().create(matrix.comm)
    krylov.setType("fgmres")
    krylov.setGMRESRestart(most)
    krylov.setOperators(matrix, matrix)
    return krylov


def iterate(krylov: PETSc.KSP, b: PETSc.Vec, x: PETSc.Vec, tolerance: float, most: int, spent: Spent) -> bool:
    """Solve for ``x`` in at most ``most`` iterations; True if the residual falls to ``tolerance`` times the norm of ``b``."""
    with spent.on("krylov"):
        krylov.setTolerances(rtol=tolerance, atol=0.0, max_it=most)
        krylov.solve(b, x)
    spent.counts["krylov_iterations"] += krylov.getIterationNumber()
    return bool(krylov.is_converged)


class Factorised:
    """Solves with the current ``matrix``. If ``lagged``, FGMRES is preconditioned with an older factorisation, which is replaced
    once the iterations, for one system or for all systems since it was made, have taken longer than a new factorisation. The
    factors are LDL^T if the matrix is symmetric, otherwise LU.
    """

    def __init__(self, matrix: PETSc.Mat, symmetric: bool, lagged: bool, precision: str, spent: Spent) -> None:
        self.matrix, self.symmetric, self.spent = matrix, symmetric, spent
        self.lagged = lagged
        self._choose(precision)
        self.factorised: int | None = None  # PETSc's count of changes of the matrix when it was last factorised
        self.limit = _LEAST
        self.since = 0  # Krylov iterations with a changed matrix since the last factorisation

    def _choose(self, precision: str) -> None:
        self.precision, self.entries = precision, self.matrix.getInfo()["nz_used"]
        self.matrix.setOption(PETSc.Mat.Option.SYMMETRIC, self.symmetric)  # type: ignore[arg-type]  # a number in the stubs
        self.krylov = fgmres(self.matrix, _MOST)
        self.krylov.setOptionsPrefix(f"fem_reference_{next(_number)}_")
        self.preconditioner = self.krylov.getPC()
        self.preconditioner.setType("cholesky" if self.symmetric else "lu")  # MUMPS's "cholesky" is LDL^T
        self.preconditioner.setFactorSolverType("mumps")
        self.krylov.setFromOptions()
        self.preconditioner.setFactorSetUpSolverType()
        self.factors = self.preconditioner.getFactorMatrix()
        self.factors.setMumpsIcntl(_ROOT_BY_ONE, 1)
        self.factors.setMumpsIcntl(_MORE_MEMORY, 50)
        if precision == "single" and self.matrix.getSize()[0] > _COMPRESSED_FROM:
            self.factors.setMumpsIcntl(_COMPRESSION, 2)
            self.factors.setMumpsCntl(_DROPPED, 1e-5)

    @property
    def fresh(self) -> bool:
        """True if the factors belong to the current matrix."""
        return self.factorised == self.matrix.stateGet()

    def solve_exactly(self) -> bool:
        """Factorise every matrix from now on, in double precision. Returns True if this is a change."""
        if not self.lagged:
            return False
        self.lagged, self.factorised = False, None
        if self.precision == "single":
            self._choose("double")
        return True

    def factorise(self) -> None:
        """Factorise the current matrix. Raises ``LinearSolveError`` if this fails."""
        if self.entries != self.matrix.getInfo()["nz_used"]:  # a matrix that has grown needs new factors
            self._choose(self.precision)
        options = PETSc.Options(self.krylov.getOptionsPrefix())
        with self.spent.on("factorisation"):
            self.preconditioner.setReusePreconditioner(False)
            self.krylov.setOperators(self.matrix, self.matrix)
            # Only this ``setUp`` reads the option; when PETSc ends, it would warn of an option that is set but not read.
            options.setValue("pc_precision", self.precision)
            self.preconditioner.setUp()
            options.delValue("pc_precision")
            self.preconditioner.setReusePreconditioner(True)
        self.spent.counts["factorisations"] += 1
        if self.factors.getMumpsInfog(_ERROR) < 0:
            self.factorised = None
            raise LinearSolveError(f"MUMPS reports {self.factors.getMumpsInfog(_ERROR)}")
        self.factorised, self.since = self.matrix.stateGet(), 0
        operations = self.factors.getMumpsRinfog(_FLOPS)
        self.spent.counts["factorisation_flops"] += operations
        counted = self.factors.getMumpsInfog(_ENTRIES)
        entries = counted if counted > 0 else -1e6 * counted  # a negative number counts millions
        self.limit = int(min(max(operations / entries / _OPERATIONS, _LEAST), _MOST))

    def solve(self, b: PETSc.Vec, x: PETSc.Vec, tolerance: float) -> None:
        """Solve for ``x`` to ``tolerance`` times the norm of ``b``, or exactly if not ``lagged``. Raises ``LinearSolveError``."""
        if not self.lagged:
            tolerance = _EXACT
        # A factorisation is replaced once its iterations have taken as long as a new one, so the time is at most twice the minimum.
        serves = self.fresh or (self.lagged and self.since < self.limit)
        if self.factorised is not None and serves and self._iterate(b, x, tolerance, self.limit):
            return
        self.factorise()
        if not self._iterate(b, x, tolerance, _MOST):
            raise LinearSolveError("FGMRES does not converge with the factorisation of the matrix itself")

    def _iterate(self, b: PETSc.Vec, x: PETSc.Vec, tolerance: float, most: int) -> bool:
        converged = iterate(self.krylov, b, x, tolerance, most, self.spent)
        self.since += 0 if self.fresh else self.krylov.getIterationNumber()
        return converged

    def negative_pivots(self) -> int:
        """The number of negative pivots of the current matrix, which is factorised if necessary. If single precision does not
        resolve the softest directions, double precision is used from then on. Raises ``LinearSolveError`` on failure.
        """
        if not self.fresh:
            self.factorise()
        if self.precision == "single" and not self._resolved():
            self._choose("double")
            self.factorise()
        return int(self.factors.getMumpsInfog(_NEGATIVE))

    def _resolved(self) -> bool:
        """True if the factorisation M matches the matrix A even in the softest directions.

        For a vector v that inverse iteration has turned towards these directions, M^-1 A v must equal v to within a tenth. M and A
        then cannot differ in sign along any of them.
        """
        random = np.random.default_rng(self.matrix.comm.rank)
        image = self.matrix.createVecLeft()
        vector = image.duplicate()
        image.array[:] = random.normal(size=image.local_size)
        for _ in range(_INVERSE_ITERATIONS):
            self.preconditioner.apply(image, vector)
            vector.normalize()
            vector.copy(image)
        self.matrix.mult(vector, image)
        again = vector.duplicate()
        self.preconditioner.apply(image, again)
        again.axpy(-1.0, vector)
        deviation = again.norm()
        assert isinstance(deviation, float)
        return deviation < _RESOLVED
