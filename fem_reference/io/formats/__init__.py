"""Formats of surface meshes: one file each, found by their folder.

A file has one ``FORMAT``. Contract (tests/contracts/test_every_format.py): a surface that is written comes back bit by bit, and a
file that was cut off is refused.
"""

import importlib
import pkgutil
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from pathlib import Path

from fem_reference.foundations.mesh import Floats, Surface
from fem_reference.io.soup import Soup


@dataclass(frozen=True)
class Format:
    """A mesh format, known by the ``suffixes`` of its files, lower case, with their dots.

    ``read``: points and triangles as in the file; raises any exception where the file is not whole. ``write``: the surface
    as it is, with its displacement (n, 3) [mm] where the format has room for it; None where the format is only read.
    ``shares_points``: whether triangles have points in common, in their order; else each has three of its own.
    ``states_size``: whether a file says how much of it there is; else a cut between two of its lines is not seen.
    """

    suffixes: tuple[str, ...]
    read: Callable[[Path], Soup]
    write: Callable[[Path, Surface, Floats], None] | None = None
    shares_points: bool = True
    states_size: bool = True


@cache
def formats() -> dict[str, Format]:
    """Every format there is by the suffix of its files; TypeError where a file has none, or one that another has."""
    found: dict[str, Format] = {}
    for name in sorted(module.name for module in pkgutil.iter_modules(__path__) if not module.name.startswith("_")):
        one = vars(importlib.import_module(f"{__name__}.{name}")).get("FORMAT")
        if not isinstance(one, Format) or not one.suffixes:
            raise TypeError(f"io/formats/{name}: FORMAT is {one!r}, want a Format with a suffix")
        if taken := found.keys() & set(one.suffixes):
            raise TypeError(f"io/formats/{name}: {', '.join(sorted(taken))}, which another format has")
        found |= dict.fromkeys(one.suffixes, one)
    return found
