"""Peers of the reference, one file each: who else solves the muscle of ``problem``; ``fenicsx`` is the reference of this project.

A peer states ``PACKAGES``, the distributions that it needs, ``TUNED``, how it was made fast, and ``OMITTED``, by element why it has
no solution in that. Its ``opened()`` is a context in which all is imported and started that is not the work itself; it gives
``Solve``.
"""

import importlib
import importlib.metadata
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from benchmarks.peers.problem import Muscle
from fem_reference.foundations.mesh import Floats

OURS = "fenicsx"
NAMES = (OURS, "felupe", "sfepy")


@dataclass(frozen=True, eq=False)
class Solved:
    """The end of a solution: ``converged`` or a ``message``, Newton ``iterations`` of all load steps, ``unknowns`` of its linear
    systems, and the final positions (n, 3) [mm] of the corners of the mesh's cells.
    """

    converged: bool
    message: str
    iterations: int
    unknowns: int
    positions: Floats


Solve = Callable[[Muscle], Solved]


def find(name: str) -> Any:
    """The module of a peer, which imports its packages when it is opened."""
    return importlib.import_module(f"{__name__}.{name}")


def missing(name: str) -> str | None:
    """The packages that have to be installed for a peer, in a sentence; None where they are."""
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
