"""The import of DOLFINx: the PyPI wheel if it is there, else whatever build is installed (conda, Debian)."""

import contextlib

with contextlib.suppress(ImportError):
    import dolfinx_solver  # noqa: F401 - makes the wheel's own dolfinx importable

import dolfinx
from petsc4py import PETSc

from fem_reference.foundations.errors import MissingSoftware

__all__ = ["PETSc", "dolfinx"]

_VERSION = tuple(int(part) for part in dolfinx.__version__.split(".")[:2])
if _VERSION < (0, 10):
    raise MissingSoftware(f"DOLFINx {dolfinx.__version__} is installed, want 0.10 or newer")
if PETSc.ScalarType is not PETSc.RealType:
    raise MissingSoftware("DOLFINx is built for complex numbers, want a build for real numbers")
