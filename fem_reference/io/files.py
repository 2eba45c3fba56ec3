"""The door to file formats: surfaces, polylines and tetrahedra in, whole files or none out.

A reader keeps the points of its file as they are: their order, their number, and float64 where the file has it.
"""

import csv
import io
import os
import re
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, redirect_stderr
from pathlib import Path
from typing import Any
from xml.etree import ElementTree
from xml.sax.saxutils import quoteattr

import numpy as np

from fem_reference.foundations.errors import InputError
from fem_reference.foundations.mesh import Floats, Ints, Polylines, Surface, TetMesh
from fem_reference.io import formats
from fem_reference.io.formats import Soup, only_triangles, read_obj, read_off, read_ply, read_stl


def read_surface(path: Path, unit: float) -> Surface:
    """The triangles of a file whose coordinates are in units of ``unit`` mm; ``place`` is the path.

    An STL file has no shared points: its surface has three points a triangle. InputError where the file cannot be read
    whole or has other polygons than triangles.
    """
    want = f"a triangle surface, whole, as {' '.join(SURFACE_SUFFIXES)}"
    reader = _READERS.get(path.suffix.lower())
    if reader is None:
        raise InputError(path, f'the suffix "{path.suffix}"', want)
    points, triangles = _attempt(lambda file: formats.arrays(reader(file)), path, want)
    return Surface(points * unit, triangles, str(path))


def read_polylines(path: Path, unit: float) -> Polylines:
    """The lines of a VTK or VTP file in units of ``unit`` mm; cells that go on where another ends are one line.

    InputError where it cannot be read whole, a point is not finite or a line has no length.
    """

    def read(file: Path) -> tuple[Floats, list[list[int]]]:
        points, lines = _vtk_lines(file)
        formats.check_lengths(points, lines)
        return points, lines

    return _polylines(read, path, unit)


def read_moved_polylines(path: Path, unit: float) -> Polylines:
    """As ``read_polylines``, of what a solver made of the lines: points not finite and lines of no length as well."""
    return _polylines(_vtk_lines, path, unit)


def _polylines(read: Callable[[Path], tuple[Floats, list[list[int]]]], path: Path, unit: float) -> Polylines:
    want = "polylines, whole, as .vtk or .vtp"
    if path.suffix.lower() not in (".vtk", ".vtp"):
        raise InputError(path, f'the suffix "{path.suffix}"', want)
    points, lines = _attempt(read, path, want)
    offsets = np.cumsum([0, *(len(line) for line in lines)])
    return Polylines(points[np.concatenate(lines)] * unit, offsets)


def read_xdmf(path: Path, unit: float) -> list[tuple[float, Surface]]:
    """Time and surface of each step of a temporal collection, in units of ``unit`` mm.

    The points are moved by the point data ``displacement``, or ``u`` where that is its name.
    """
    want = "an XDMF time series of one triangle mesh with its displacement"
    steps = _attempt(_meshio_steps, path, want)
    return [(time, Surface(points * unit, triangles, f"{path}: time {time:g}")) for time, points, triangles in steps]


def read_pvd(path: Path) -> list[tuple[float, Path]]:
    """Time and file of each entry of a PVD index."""
    want = "a PVD index with a timestep and a file for each DataSet"

    def read(index: Path) -> list[tuple[float, Path]]:
        entries = ElementTree.parse(index).getroot().iter("DataSet")
        return [(float(entry.attrib["timestep"]), index.parent / entry.attrib["file"]) for entry in entries]

    return _attempt(read, path, want)


def read_rows(path: Path) -> list[list[str]]:
    """The rows of a comma separated file, cells stripped, without empty lines and lines that begin with ``#``."""

    def read(table: Path) -> list[list[str]]:
        lines = table.read_text(encoding="utf-8-sig").splitlines()
        table_lines = (line for line in lines if line.strip() and not line.lstrip().startswith("#"))
        rows = csv.reader(table_lines, skipinitialspace=True)
        return [[cell.strip() for cell in row] for row in rows]

    return _attempt(read, path, "a comma separated table in UTF-8")


def write_surface(path: Path, surface: Surface, positions: Floats) -> None:
    """VTP of the surface with its points at ``positions`` (n, 3) [mm] and point data ``displacement`` [mm], float64."""
    import pyvista

    data = pyvista.PolyData.from_regular_faces(np.array(positions, np.float64), surface.triangles, deep=True)
    _save(path, data, positions - surface.points)


def write_polylines(path: Path, polylines: Polylines, positions: Floats) -> None:
    """VTP of the lines with their points at ``positions`` (n, 3) [mm] and point data ``displacement`` [mm], float64."""
    import pyvista

    cells = pyvista.CellArray.from_arrays(polylines.offsets, np.arange(len(polylines.points)), deep=True)
    _save(path, pyvista.PolyData(np.array(positions, np.float64), lines=cells), positions - polylines.points)


def write_tets(path: Path, mesh: TetMesh, positions: Floats) -> None:
    """VTU of the tets with their points at ``positions`` (n, 3) [mm] and point data ``displacement`` [mm], float64."""
    import pyvista

    data = pyvista.UnstructuredGrid({pyvista.CellType.TETRA: mesh.tets}, np.array(positions, np.float64))
    _save(path, data, positions - mesh.points)


def write_field(
    path: Path, points: Floats, cells: Ints, data: dict[str, Floats], cell_data: dict[str, Floats] | None = None
) -> None:
    """VTU or gmsh's MSH of ``cells`` (m, 2 to 4) between ``points`` (n, 1 to 3) with ``data`` (n, ...) and (m, ...) by name."""
    import meshio

    space = np.pad(points, ((0, 0), (0, 3 - points.shape[1])))
    kind = {2: "line", 3: "triangle", 4: "tetra"}[cells.shape[1]]
    of_cells = {name: [values] for name, values in (cell_data or {}).items()}
    with whole(path) as part:
        meshio.Mesh(space, [(kind, cells)], data, of_cells).write(part, "gmsh" if path.suffix == ".msh" else None)


def write_pvd(path: Path, frames: Sequence[tuple[int, str]]) -> None:
    """PVD index: the frame number is the time of each file, which is named relative to the index."""
    entries = "".join(f'<DataSet timestep="{number}" file={quoteattr(name)}/>\n' for number, name in frames)
    write_text(
        path, f'<?xml version="1.0"?>\n<VTKFile type="Collection"><Collection>\n{entries}</Collection></VTKFile>\n'
    )


def write_text(path: Path, text: str) -> None:
    """The text in UTF-8; into ``path`` itself where that is a pipe or a device."""
    if path.exists() and not path.is_file():
        path.write_text(text, encoding="utf-8")
        return
    with whole(path) as part:
        part.write_text(text, encoding="utf-8")


@contextmanager
def whole(path: Path) -> Iterator[Path]:
    """A name beside ``path`` to write to, which takes its place when all went well and is gone otherwise."""
    part = path.with_name(f".{path.stem}-{os.getpid()}{path.suffix}")
    try:
        yield part
        part.replace(path)
    finally:
        part.unlink(missing_ok=True)


def _attempt[T](read: Callable[[Path], T], path: Path, want: str) -> T:
    """What ``read`` makes of the file; whatever a reader raises over a damaged file becomes an InputError."""
    if not path.is_file():
        raise InputError(path, "no file", want)
    try:
        return read(path)
    except Exception as error:  # the readers of foreign packages raise whatever occurs to them
        raise InputError(path, str(error) or type(error).__name__, want) from error


def _read_msh(path: Path) -> Soup:
    import meshio

    with redirect_stderr(io.StringIO()):  # meshio prints what it skips
        return _meshio_triangles(meshio.gmsh.read(path))


def _meshio_triangles(mesh: Any) -> Soup:
    """Points and triangles of a meshio mesh (points and line cells passed over)."""
    blocks = [block for block in mesh.cells if block.type not in ("vertex", "line")]
    if other := {block.type for block in blocks} - {"triangle"}:
        raise ValueError(f"cells of type {', '.join(sorted(other))}")
    return mesh.points, np.concatenate([np.empty((0, 3), np.int64), *(block.data for block in blocks)])


def _meshio_steps(path: Path) -> list[tuple[float, Floats, Ints]]:
    import meshio

    with meshio.xdmf.TimeSeriesReader(path) as series:
        points, triangles = formats.arrays(_meshio_triangles(meshio.Mesh(*series.read_points_cells())))
        steps = [series.read_data(step)[:2] for step in range(series.num_steps)]
    return [(time, points + formats.displacement(data, points), triangles) for time, data in steps]


def _read_vtk(path: Path) -> Soup:
    """Polygons of VTK polydata, or the cells of an unstructured grid (points and lines of polydata passed over)."""
    import pyvista

    data = _vtk_data(path)
    if data.n_cells == 0:
        return np.empty((0, 3)), np.empty((0, 3))
    if isinstance(data, pyvista.UnstructuredGrid):
        cells = data.GetCells()
        if other := set(data.celltypes.tolist()) - {pyvista.CellType.TRIANGLE}:
            raise ValueError(f"cells of VTK type {', '.join(map(str, sorted(other)))}")
    elif isinstance(data, pyvista.PolyData) and data.n_strips == 0:
        cells = data.GetPolys()
    else:
        raise ValueError(f"{type(data).__name__} that is not made of triangles")
    offsets, corners = _vtk_cells(cells)
    only_triangles(set(np.diff(offsets).tolist()))
    return data.points, corners.reshape(-1, 3)


def _vtk_lines(path: Path) -> tuple[Floats, list[list[int]]]:
    """Points (n, 3) of the file, and the points of each line; ValueError where one is not usable."""
    import pyvista

    data = _vtk_data(path)
    if not isinstance(data, pyvista.PolyData) or data.n_lines == 0:
        raise ValueError("no lines")
    offsets, connectivity = _vtk_cells(data.GetLines())
    cells = [cell.tolist() for cell in np.split(connectivity, offsets[1:-1])]
    points = np.asarray(data.points, np.float64)
    formats.check_lines(points, cells)
    return points, formats.joined(cells)


def _vtk_cells(cells: Any) -> tuple[Ints, Ints]:
    """Where each of VTK's cells begins in the list of their points, and that list."""
    import pyvista

    return pyvista.convert_array(cells.GetOffsetsArray()), pyvista.convert_array(cells.GetConnectivityArray())


def _vtk_data(path: Path) -> Any:
    """The data set of a VTK file; ValueError with VTK's own words where it complains."""
    import pyvista

    with _vtk_errors() as errors:
        reader = pyvista.get_reader(path)
        reader.reader.Update()  # the reader's own read() only logs errors and warns of them
    if errors:
        raise ValueError(re.sub(r"^.*: In .*\n| for file: .*", "", errors[0]).splitlines()[0])
    return pyvista.wrap(reader.reader.GetOutputDataObject(0))


@contextmanager
def _vtk_errors() -> Iterator[list[str]]:
    """What VTK complains of meanwhile, known at the end of it, instead of on stderr; some errors it calls warnings."""
    import pyvista

    found: list[str] = []
    with pyvista.vtk_verbosity("off"), pyvista.VtkErrorCatcher(send_to_logging=False) as caught:
        yield found
    found += [event.alert for event in caught.events if "error" in str(event).lower()]


def _save(path: Path, data: Any, displacement: Floats) -> None:
    """Write ``data`` with its ``displacement`` (n, 3) [mm]; OSError where that fails."""
    import pyvista

    data.point_data.set_vectors(displacement, "displacement")
    kind = pyvista.XMLPolyDataWriter if path.suffix == ".vtp" else pyvista.XMLUnstructuredGridWriter
    with whole(path) as part, _vtk_errors():
        writer = kind(part, data)
        writer.writer.SetDataModeToAppended()  # in the other modes a displacement that is not finite cannot be read again
        writer.write()
        if code := writer.writer.GetErrorCode():
            raise OSError(f"{path}: VTK could not write it (its error {code})")


_READERS: dict[str, Callable[[Path], Soup]] = {
    ".ply": read_ply,
    ".obj": read_obj,
    ".stl": read_stl,
    ".off": read_off,
    ".msh": _read_msh,
    **dict.fromkeys((".vtk", ".vtp", ".vtu"), _read_vtk),
}
SURFACE_SUFFIXES = tuple(_READERS)
