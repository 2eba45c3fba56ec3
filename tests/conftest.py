"""Fixtures that several test files share."""

import importlib.util
import os
from pathlib import Path

import pytest

collect_ignore = ["foreign_solver.py"]  # a program: it runs where it is imported


def pytest_configure() -> None:
    """Each of the processes that share the tests keeps to a core of its own, and so do the solvers that it starts."""
    worker = os.environ.get("PYTEST_XDIST_WORKER")  # gw0, gw1, ...
    if worker is not None:
        cores = sorted(os.sched_getaffinity(0))
        os.sched_setaffinity(0, {cores[int(worker.removeprefix("gw")) % len(cores)]})


@pytest.fixture(scope="session")
def data() -> Path:
    """The folder of the report's own data, which is licensed apart from this project."""
    folder = os.environ.get("FEM_REFERENCE_DATA")
    if not folder:
        pytest.skip("the report's data is not here: FEM_REFERENCE_DATA is not set")
    return Path(folder)


@pytest.fixture(scope="session")
def fem_lab():
    """Where entries of the catalogue are measured."""
    if not any(importlib.util.find_spec(name) for name in ("dolfinx_solver", "dolfinx")):
        pytest.skip("FEniCSx is not installed")
    from fem_reference.verification.lab import lab

    with lab() as opened:
        yield opened
