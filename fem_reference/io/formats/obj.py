"""Wavefront OBJ with numpy alone."""

from pathlib import Path

from fem_reference.foundations.mesh import Floats, Surface
from fem_reference.io.formats import Format
from fem_reference.io.soup import Soup, only_triangles, positions, rows


def _read(path: Path) -> Soup:
    """Wavefront OBJ: the positions and faces, corners counted from 1, or back from the last."""
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


def _write(path: Path, surface: Surface, displacement: Floats) -> None:  # noqa: ARG001 - it has no room for it
    """OBJ, coordinates in full."""
    points = (f"v {row}" for row in rows(surface.points))
    faces = (f"f {a} {b} {c}" for a, b, c in (surface.triangles + 1).tolist())
    path.write_text("\n".join([*points, *faces, ""]), encoding="utf-8")


FORMAT = Format((".obj",), _read, _write, states_size=False)
