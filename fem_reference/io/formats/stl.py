"""The STL format, with numpy alone."""

import re
from pathlib import Path

import numpy as np

from fem_reference.io.formats import Format
from fem_reference.io.soup import Soup

_FACET = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])


def _read(path: Path) -> Soup:
    """The triangles in an STL file, text or binary, with three points for each triangle, in the order of the file."""
    data = path.read_bytes()
    count = int.from_bytes(data[80:84], "little")
    if len(data) >= 84 and len(data) == 84 + 50 * count:
        points = np.frombuffer(data, _FACET, count, 84)["corners"].reshape(-1, 3)
    elif re.match(rb"\s*solid\b.*\bendsolid\b[^\n]*\s*$", data, re.DOTALL):
        lines = [line.split()[1:] for line in data.splitlines() if line.lstrip().startswith(b"vertex")]
        points = np.array(lines).astype(np.float64)
    else:
        raise ValueError(f"{len(data)} bytes that are not a complete STL file")
    return points, np.arange(len(points)).reshape(-1, 3)


FORMAT = Format((".stl",), _read, shares_points=False)
