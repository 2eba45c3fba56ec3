"""Who solves the problem of ``peer_problem``: one file each, found by this folder; ``fenicsx`` is the reference of this project.

Contract (tests/studies/benchmark/test_peers.py): ``PACKAGES`` are the distributions that it needs, ``TUNED`` says in words how it
was made fast, ``OMITTED`` by element why it does not solve in that; ``opened()`` is a context that has all imported and started
that is not the work itself, and gives ``Solve``.
"""

import importlib
import importlib.metadata
import pkgutil
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from fem_reference.foundations.mesh import Floats
from fem_reference.studies.benchmark.peer_problem import Muscle


@dataclass(frozen=True, eq=False)
class Solved:
    """How a peer came through: ``converged`` or a ``message``, Newton ``iterations`` of all load steps, ``unknowns`` of its linear
    systems, and the final positions (n, 3) [mm] of the corners of the mesh's cells.
    """

    converged: bool
    message: str
    iterations: int
    unknowns: int
    positions: Floats


Solve = Callable[[Muscle], Solved]
OURS = "fenicsx"


def names() -> list[str]:
    """All peers, the reference of this project first."""
    return sorted((module.name for module in pkgutil.iter_modules(__path__)), key=lambda name: (name != OURS, name))


def find(name: str) -> Any:
    """The module of a peer, which imports its packages when it is opened."""
    return importlib.import_module(f"{__name__}.{name}")


def missing(name: str) -> str | None:
    """What has to be installed for a peer; None where it is there."""
    lacking = [package for package, version in versions(name).items() if version is None]
    return f"{', '.join(lacking)} not installed" if lacking else None


def versions(name: str) -> dict[str, str | None]:
    """The versions of the distributions that a peer needs, None of those that are not installed."""
    found: dict[str, str | None] = {}
    for package in find(name).PACKAGES:
        try:
            found[package] = importlib.metadata.version(package)
        except importlib.metadata.PackageNotFoundError:
            found[package] = None
    return found
