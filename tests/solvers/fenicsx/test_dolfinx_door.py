"""The door to DOLFINx: where it is loaded, numba's part of FFCx is left out and can still be imported."""

import subprocess
import sys

import pytest

from fem_reference.solvers.fenicsx.processes import installed

PROGRAM = """
import sys
from fem_reference.solvers.fenicsx.dolfinx_door import PETSc, dolfinx
assert "numba" not in sys.modules
import numba
assert PETSc.ScalarType is PETSc.RealType
print(dolfinx.__version__)
"""


@pytest.mark.slow
@pytest.mark.skipif(not installed(), reason="FEniCSx is not installed")
def test_numba_is_not_loaded_for_it_and_is_there_afterwards() -> None:
    done = subprocess.run([sys.executable, "-c", PROGRAM], capture_output=True, text=True, check=True)
    assert tuple(int(part) for part in done.stdout.split(".")[:2]) >= (0, 10)
