"""Formats of surface meshes: one module for each, found automatically in this folder.

Each module defines ``FORMAT``. Contract (tests/contracts/test_every_format.py): a surface that is written is read back bit for bit,
and a truncated file is rejected.
"""

import importlib
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from pathlib import Path

from fem_reference.foundations import modules
from fem_reference.foundations.mesh import Floats, Surface
from fem_reference.io.soup import Soup


@dataclass(frozen=True)
class Format:
    """A mesh format, recognised by the ``suffixes`` of its files, which are in lower case and include the dot.

    ``read``: returns points and triangles as they are in the file, and raises an exception of any type if the file is incomplete.
    ``write``: writes the surface and, if the format has point data, its displacement (n, 3) [mm]; None if the format can only be
    read. ``shares_points``: True if triangles refer to a common list of points, whose order is kept; False if each triangle has
    three points of its own. ``states_size``: True if a file states its size; otherwise truncation between two lines is not noticed.
    """

    suffixes: tuple[str, ...]
    read: Callable[[Path], Soup]
    write: Callable[[Path, Surface, Floats], None] | None = None
    shares_points: bool = True
    states_size: bool = True


@cache
def formats() -> dict[str, Format]:
    """All formats by the suffix of their files. Raises TypeError if a module defines no format, or a suffix already taken."""
    found: dict[str, Format] = {}
    for name in (name for name in modules.names(__path__) if not name.startswith("_")):
        one = vars(importlib.import_module(f"{__name__}.{name}")).get("FORMAT")
        if not isinstance(one, Format) or not one.suffixes:
            raise TypeError(f"io/formats/{name}: FORMAT is {one!r}, want a Format with a suffix")
        if taken := found.keys() & set(one.suffixes):
            raise TypeError(f"io/formats/{name}: {', '.join(sorted(taken))}, which another format has")
        found |= dict.fromkeys(one.suffixes, one)
    return found
