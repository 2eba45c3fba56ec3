"""The import of DOLFINx: the PyPI wheel if it is installed, otherwise any other build (conda, Debian)."""

import contextlib
import sys

from fem_reference.foundations.errors import MissingSoftware

__all__ = ["PETSc", "dolfinx"]


# FFCx imports numba if it is installed, for kernels that are not used here; this takes a quarter of a process's start-up time. So
# numba is hidden during the import unless it is already loaded.
_HIDDEN = "numba" not in sys.modules
if _HIDDEN:
    sys.modules["numba"] = None  # type: ignore[assignment]
try:
    with contextlib.suppress(ImportError):
        import dolfinx_solver  # noqa: F401 - makes the wheel's own dolfinx importable
    import dolfinx
    from petsc4py import PETSc

    # If numba is loaded, this import makes the wheel's libraries global, and h5py would use the wheel's HDF5 instead of its own.
    if _HIDDEN:
        import dolfinx.fem.petsc
finally:
    if _HIDDEN:
        del sys.modules["numba"]

_VERSION = tuple(int(part) for part in dolfinx.__version__.split(".")[:2])
if _VERSION < (0, 10):
    raise MissingSoftware(f"DOLFINx {dolfinx.__version__} is installed, want 0.10 or newer")
if PETSc.ScalarType is not PETSc.RealType:
    raise MissingSoftware("DOLFINx is built for complex numbers, want a build for real numbers")
