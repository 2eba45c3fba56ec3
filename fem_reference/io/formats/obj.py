"""The Wavefront OBJ format, with numpy alone."""

from pathlib import Path

from fem_reference.io.formats import Format
from fem_reference.io.soup import Soup, only_triangles, positions


def _read(path: Path) -> Soup:
    """The positions and faces in an OBJ file. Corners are counted from 1, or, if negative, backwards from the last position."""
    points: list[list[float]] = []
    triangles = []
    for line in path.read_text(encoding="utf-8", errors="replace").splitlines():
        word, *values = line.split() or [""]
        if word == "v":
            points.append([float(value) for value in values[:3]])
        elif word == "f":
            only_triangles({len(values)})
            corners = (int(value.split("/")[0]) for value in values)
            triangles.append([corner - 1 if corner > 0 else len(points) + corner for corner in corners])
    return positions(points), triangles


FORMAT = Format((".obj",), _read, states_size=False)
