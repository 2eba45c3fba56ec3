"""MSH of gmsh, by meshio."""

import io
from contextlib import redirect_stderr
from pathlib import Path

from fem_reference.foundations.mesh import Floats, Surface
from fem_reference.io.formats import Format
from fem_reference.io.soup import Soup, of_meshio


def _read(path: Path) -> Soup:
    """The triangles of a mesh; points and line cells are passed over."""
    import meshio

    with redirect_stderr(io.StringIO()):  # meshio prints what it skips
        return of_meshio(meshio.gmsh.read(path))


def _write(path: Path, surface: Surface, displacement: Floats) -> None:
    """MSH 4.1, binary."""
    import meshio

    mesh = meshio.Mesh(surface.points, [("triangle", surface.triangles)], {"displacement": displacement})
    mesh.write(path, "gmsh")


FORMAT = Format((".msh",), _read, _write)
