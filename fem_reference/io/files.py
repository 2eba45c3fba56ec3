"""Reading and writing of surfaces, polylines and tetrahedra in common mesh formats; files are written whole or not at all.

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

_TRIANGLE, _TETRA = 5, 10  # VTK's numbers of cell types


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
    from vtkmodules.vtkCommonDataModel import vtkPolyData
    from vtkmodules.vtkIOXML import vtkXMLPolyDataWriter

    data = vtkPolyData()
    offsets = 3 * np.arange(len(surface.triangles) + 1)
    data.SetPolys(_vtk_cells(offsets, surface.triangles.ravel()))
    _vtk_write(path, vtkXMLPolyDataWriter(), data, surface.points, positions)


def write_polylines(path: Path, polylines: Polylines, positions: Floats) -> None:
    """VTP of the lines with their points at ``positions`` (n, 3) [mm] and point data ``displacement`` [mm], float64."""
    from vtkmodules.vtkCommonDataModel import vtkPolyData
    from vtkmodules.vtkIOXML import vtkXMLPolyDataWriter

    data = vtkPolyData()
    data.SetLines(_vtk_cells(polylines.offsets, np.arange(len(polylines.points))))
    _vtk_write(path, vtkXMLPolyDataWriter(), data, polylines.points, positions)


def write_tets(path: Path, mesh: TetMesh, positions: Floats) -> None:
    """VTU of the tets with their points at ``positions`` (n, 3) [mm] and point data ``displacement`` [mm], float64."""
    from vtkmodules.vtkCommonDataModel import vtkUnstructuredGrid
    from vtkmodules.vtkIOXML import vtkXMLUnstructuredGridWriter

    data = vtkUnstructuredGrid()
    data.SetCells(_TETRA, _vtk_cells(4 * np.arange(len(mesh.tets) + 1), mesh.tets.ravel()))
    _vtk_write(path, vtkXMLUnstructuredGridWriter(), data, mesh.points, positions)


def write_field(
    path: Path, points: Floats, cells: Ints, data: dict[str, Floats], cell_data: dict[str, Floats] | None = None
) -> None:
    """VTU or gmsh's MSH of ``cells`` (m, 2 to 4) between ``points`` (n, 1 to 3), with arrays by name: (n, ...) and (m, ...)."""
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
    from vtkmodules.util.numpy_support import vtk_to_numpy

    data = _vtk_data(path)
    if data.IsA("vtkUnstructuredGrid"):
        cells, types = data.GetCells(), {data.GetCellType(cell) for cell in range(data.GetNumberOfCells())}
        if other := types - {_TRIANGLE}:
            raise ValueError(f"cells of VTK type {', '.join(map(str, sorted(other)))}")
    elif data.IsA("vtkPolyData") and data.GetNumberOfStrips() == 0:
        cells = data.GetPolys()
    else:
        raise ValueError(f"{data.GetClassName()} that is not made of triangles")
    if cells is None or cells.GetNumberOfCells() == 0:
        return np.empty((0, 3)), np.empty((0, 3))
    only_triangles(set(np.diff(vtk_to_numpy(cells.GetOffsetsArray())).tolist()))
    return vtk_to_numpy(data.GetPoints().GetData()), vtk_to_numpy(cells.GetConnectivityArray()).reshape(-1, 3)


def _vtk_lines(path: Path) -> tuple[Floats, list[list[int]]]:
    """Points (n, 3) of the file, and the points of each line; ValueError where one is not usable."""
    from vtkmodules.util.numpy_support import vtk_to_numpy

    data = _vtk_data(path)
    if not data.IsA("vtkPolyData") or data.GetNumberOfLines() == 0:
        raise ValueError("no lines")
    lines = data.GetLines()
    offsets = vtk_to_numpy(lines.GetOffsetsArray())
    cells = [cell.tolist() for cell in np.split(vtk_to_numpy(lines.GetConnectivityArray()), offsets[1:-1])]
    points = np.asarray(vtk_to_numpy(data.GetPoints().GetData()), np.float64)
    formats.check_lines(points, cells)
    return points, formats.joined(cells)


def _vtk_data(path: Path) -> Any:
    """The data set of a VTK file; ValueError with VTK's own words where it complains."""
    from vtkmodules.vtkIOLegacy import vtkDataSetReader
    from vtkmodules.vtkIOXML import vtkXMLPolyDataReader, vtkXMLUnstructuredGridReader

    readers = {".vtk": vtkDataSetReader, ".vtp": vtkXMLPolyDataReader, ".vtu": vtkXMLUnstructuredGridReader}
    reader: Any = readers[path.suffix.lower()]()
    reader.SetFileName(str(path))
    with _vtk_messages() as messages:
        reader.Update()
    printed = messages.GetOutput()
    if "error" in printed.lower():
        words = re.sub(r"^.*: In .*\n|^vtk\w+ \(0x\w+\): | for file: .*", "", printed, flags=re.MULTILINE)
        raise ValueError(words.split("\n")[0])
    return reader.GetOutput()


@contextmanager
def _vtk_messages() -> Iterator[Any]:
    """What VTK has to say meanwhile, instead of on stderr."""
    from vtkmodules.vtkCommonCore import vtkLogger, vtkOutputWindow, vtkStringOutputWindow

    window, before = vtkStringOutputWindow(), vtkOutputWindow.GetInstance()
    verbosity = vtkLogger.GetCurrentVerbosityCutoff()
    vtkOutputWindow.SetInstance(window)
    vtkLogger.SetStderrVerbosity(vtkLogger.VERBOSITY_OFF)
    try:
        yield window
    finally:
        vtkOutputWindow.SetInstance(before)
        vtkLogger.SetStderrVerbosity(verbosity)


def _vtk_cells(offsets: Ints, connectivity: Ints) -> Any:
    from vtkmodules.util.numpy_support import numpy_to_vtkIdTypeArray
    from vtkmodules.vtkCommonDataModel import vtkCellArray

    cells = vtkCellArray()
    cells.SetData(*(numpy_to_vtkIdTypeArray(np.array(ids, np.int64), deep=True) for ids in (offsets, connectivity)))
    return cells


def _vtk_write(path: Path, writer: Any, data: Any, rest: Floats, positions: Floats) -> None:
    """Give ``data`` its points and their displacement from ``rest``, and write it."""
    from vtkmodules.util.numpy_support import numpy_to_vtk
    from vtkmodules.vtkCommonCore import vtkPoints

    points = vtkPoints()
    points.SetData(numpy_to_vtk(np.array(positions, np.float64), deep=True))
    data.SetPoints(points)
    displacement = numpy_to_vtk(positions - rest, deep=True)
    displacement.SetName("displacement")
    data.GetPointData().SetVectors(displacement)
    writer.SetInputData(data)
    with whole(path) as part, _vtk_messages() as messages:
        writer.SetFileName(str(part))
        if not writer.Write() or writer.GetErrorCode():
            raise OSError(f"{path}: {messages.GetOutput()}")


_READERS: dict[str, Callable[[Path], Soup]] = {
    ".ply": read_ply,
    ".obj": read_obj,
    ".stl": read_stl,
    ".off": read_off,
    ".msh": _read_msh,
    **dict.fromkeys((".vtk", ".vtp", ".vtu"), _read_vtk),
}
SURFACE_SUFFIXES = tuple(_READERS)
