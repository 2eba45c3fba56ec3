"""The import of DOLFINx: the PyPI wheel if it is installed, else any other build (conda, Debian)."""

import contextlib
import sys
from collections.abc import Iterator

from fem_reference.foundations.errors import MissingSoftware

__all__ = ["PETSc", "dolfinx"]


@contextlib.contextmanager
def _without(name: str) -> Iterator[bool]:
    """Meanwhile a module that was not loaded yet is as if it were not installed; whether it was not."""
    hidden = name not in sys.modules
    if hidden:
        sys.modules[name] = None  # type: ignore[assignment]
    try:
        yield hidden
    finally:
        if hidden:
            del sys.modules[name]


# FFCx imports numba where it is installed, for kernels that are not used here: a quarter of a process's start-up time.
with _without("numba") as nowhere:
    with contextlib.suppress(ImportError):
        import dolfinx_solver  # noqa: F401 - makes the wheel's own dolfinx importable
    import dolfinx
    from petsc4py import PETSc

    # Where numba is loaded, this would make libraries of the wheel global, and h5py take its HDF5 for its own.
    if nowhere:
        import dolfinx.fem.petsc

_VERSION = tuple(int(part) for part in dolfinx.__version__.split(".")[:2])
if _VERSION < (0, 10):
    raise MissingSoftware(f"DOLFINx {dolfinx.__version__} is installed, want 0.10 or newer")
if PETSc.ScalarType is not PETSc.RealType:
    raise MissingSoftware("DOLFINx is built for complex numbers, want a build for real numbers")
