"""Single precision that does not resolve the softest direction of a matrix is replaced by double precision."""

import numpy as np
import pytest

pytest.importorskip("fem_reference.solvers.fenicsx.dolfinx_door", reason="FEniCSx is not installed")

from petsc4py import PETSc

from fem_reference.solvers.fenicsx.linear import Factorised
from fem_reference.solvers.fenicsx.spent import Spent

pytestmark = [pytest.mark.slow, pytest.mark.filterwarnings("ignore:(cmap|dofmap) is deprecated")]


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize(("softest", "negative"), [(-1e-10, 1), (1e-10, 0), (-1e-2, 1)])
def test_signs_that_single_precision_cannot_tell_are_told_by_double(softest: float, negative: int, seed: int) -> None:
    """Eigenvalues from 1 to 2 and one of 1e-10 of that, below the 6e-8 that single precision rounds by; one of 1e-2 it resolves."""
    turned, _ = np.linalg.qr(np.random.default_rng(seed).normal(size=(30, 30)))
    values = turned @ np.diag([softest, *np.linspace(1, 2, 29)]) @ turned.T
    matrix = PETSc.Mat().createAIJ((30, 30), comm=PETSc.COMM_SELF)
    matrix.setUp()
    matrix.setValues(range(30), range(30), (values + values.T) / 2)
    matrix.assemble()
    linear = Factorised(matrix, symmetric=True, lagged=True, precision="single", spent=Spent())
    assert linear.negative_pivots() == negative
    assert not PETSc.Options().getAll(), "no option is left that PETSc would warn of, as nothing reads it"
    assert linear.precision == ("double" if abs(softest) < 6e-8 else "single")
