"""Reading and writing of surfaces, polylines and tetrahedra in common mesh formats. Files are written completely or not at all.

A reader keeps the order and the number of the points and, if the file has double precision, their precision.
"""

import csv
import glob
import os
import shutil
import time
from collections.abc import Callable, Collection, Iterator, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from xml.sax.saxutils import quoteattr

import numpy as np

from fem_reference.foundations.errors import NO_ROOM, InputError
from fem_reference.foundations.mesh import Floats, Ints, Polylines, Surface, TetMesh, boundary
from fem_reference.foundations.subprocesses import lives
from fem_reference.io import soup, xdmf
from fem_reference.io.formats import Format, formats, vtk
from fem_reference.io.formats.msh import read_mesh
from fem_reference.io.texts import beside, check_size, is_file, parsed_xml

# The maximum size in bytes of a mesh, table or index file. A million triangles fit, more than our meshers and solvers can use.
# The values of a text file need up to thirty times as much memory as the file.
MOST_BYTES = 2**26
# A half-written file that is older than this [s] is removed unless its process is still running on this machine. A newer file may
# be in use by a process on another machine.
_SETTLED = 10.0


def shares_points(place: str) -> bool:
    """True if triangles read from ``place`` share points, in the order of the file; False if each has three points of its own."""
    found = formats().get(Path(place).suffix.lower())
    return found is None or found.shares_points


def _format(path: Path, want: str, known: Collection[str]) -> Format:
    """The format of a file by its suffix. Raises InputError with ``want`` if the suffix is not one of ``known``."""
    suffix = path.suffix.lower()
    if suffix not in known:
        raise InputError(path, f'the suffix "{path.suffix}"', want)
    return formats()[suffix]


def read_surface(path: Path, unit: float) -> Surface:
    """The triangles in a file, with the path as the ``place`` of the surface. ``unit``: the unit of the coordinates in the file, in
    mm.

    A surface from an STL file has three points for each triangle, because the file has no shared points. Raises InputError if the
    file cannot be read completely, or has polygons other than triangles.
    """
    want = f"a complete triangle surface as {' '.join(formats())}"
    read = _format(path, want, formats()).read
    points, triangles = _attempt(lambda file: soup.arrays(read(file)), path, want)
    return Surface(points * unit, triangles, str(path))


def read_labelled(path: Path, unit: float, array: str, labels: Collection[int]) -> Surface:
    """The boundary of those tetrahedra in a VTU or MSH file whose value in an ``array`` of the cells is one of ``labels``.

    In files from gmsh the array is ``gmsh:physical``. ``unit``: the unit of the coordinates in the file, in mm. Raises InputError
    if the file lacks the array, or has none of the labels.
    """
    want = (
        f'tetrahedra with an array "{array}" of integers, some of them {", ".join(map(str, labels))}, as .vtu or .msh'
    )

    def read(file: Path) -> tuple[Floats, Ints]:
        from meshio import vtu

        mesh = read_mesh(file) if file.suffix.lower() == ".msh" else vtu.read(file)
        if array not in mesh.cell_data:
            raise ValueError(f"cell arrays: {', '.join(mesh.cell_data) or 'none'}")
        blocks = zip(mesh.cells, mesh.cell_data[array], strict=True)
        found = [cells.data[np.isin(values, list(labels))] for cells, values in blocks if cells.type == "tetra"]
        if not sum(map(len, found)):
            raise ValueError("no tetrahedra with these labels")
        used, corners = np.unique(boundary(np.concatenate(found).astype(np.int64))[0], return_inverse=True)
        return soup.arrays((np.asarray(mesh.points)[used], corners.reshape(-1, 3)))

    _format(path, want, (".vtu", ".msh"))
    points, triangles = _attempt(read, path, want)
    return Surface(points * unit, triangles, str(path))


def read_polylines(path: Path, unit: float, *, moved: bool = False) -> Polylines:
    """The lines in a VTK or VTP file. Cells that begin at the end of another cell are joined to it.

    ``unit``: the unit of the coordinates in the file, in mm. ``moved``: True for lines of a moved state. In a state at rest, points
    that are not finite and lines without length are errors too. Raises InputError if the file cannot be read completely.
    """
    want = f"complete polylines as {' or '.join(vtk.LINES)}"
    _format(path, want, vtk.LINES)
    points, lines = _attempt(lambda file: vtk.read_lines(file, moved=moved), path, want)
    offsets = np.cumsum([0, *(len(line) for line in lines)])
    return Polylines(points[np.concatenate(lines)] * unit, offsets)


def read_points(path: Path) -> Floats:
    """The points (n, 3) in a VTK file with cells of any kind."""
    return np.asarray(_attempt(vtk.data_set, path, "a complete VTK file").points, float)


def read_xdmf(path: Path, unit: float) -> list[tuple[float, Surface]]:
    """The time and the surface of each step of a temporal collection. ``unit``: the unit of the coordinates in the file, in mm. The
    points are moved by the point data named ``displacement`` or ``u``.
    """
    want = "an XDMF time series of one triangle mesh with its displacement"
    steps = _attempt(xdmf.read, path, want)
    return [(time, Surface(points * unit, triangles, f"{path}: time {time:g}")) for time, points, triangles in steps]


def read_pvd(path: Path) -> list[tuple[float, Path]]:
    """The time and the file of each entry in a PVD index."""
    want = "a PVD index with a timestep and a file for each DataSet"

    def read(index: Path) -> list[tuple[float, Path]]:
        entries = parsed_xml(index).iter("DataSet")
        return [(float(entry.attrib["timestep"]), beside(index, entry.attrib["file"])) for entry in entries]

    return _attempt(read, path, want)


def read_rows(path: Path) -> list[list[str]]:
    """The rows of a comma-separated file, without empty lines and lines that begin with ``#``, and without spaces around cells."""

    def read(table: Path) -> list[list[str]]:
        lines = table.read_text(encoding="utf-8-sig").splitlines()
        table_lines = (line for line in lines if line.strip() and not line.lstrip().startswith("#"))
        rows = csv.reader(table_lines, skipinitialspace=True)
        return [[cell.strip() for cell in row] for row in rows]

    return _attempt(read, path, "a comma-separated table in UTF-8")


def write_surface(path: Path, surface: Surface, positions: Floats) -> None:
    """Write a surface with its points at ``positions`` (n, 3) [mm]; VTK files have float64 point data ``displacement`` [mm]."""
    written = [suffix for suffix, one in formats().items() if one.write]
    write = _format(path, f"one of {' '.join(written)}", written).write
    assert write is not None  # the suffix is one of the written formats
    with whole(path) as part:
        write(part, surface.moved_to(positions), positions - surface.points)


def write_polylines(path: Path, polylines: Polylines, positions: Floats) -> None:
    """Write lines as VTP or VTK, with points at ``positions`` (n, 3) [mm] and float64 point data ``displacement`` [mm]."""
    _format(path, f"one of {' '.join(vtk.LINES)}", vtk.LINES)
    with whole(path) as part:
        vtk.save(part, positions, polylines, positions - polylines.points)


def write_tets(path: Path, mesh: TetMesh, positions: Floats) -> None:
    """Write tetrahedra as VTU, with points at ``positions`` (n, 3) [mm] and float64 point data ``displacement`` [mm]."""
    with whole(path) as part:
        vtk.save(part, positions, mesh.tets, positions - mesh.points)


def write_field(
    path: Path, points: Floats, cells: Ints, data: dict[str, Floats], cell_data: dict[str, Floats] | None = None
) -> None:
    """Write ``cells`` (m, 2 to 4) between ``points`` (n, 1 to 3) as VTU or MSH. ``data`` and ``cell_data``: arrays by name at the
    points (n, ...) and on the cells (m, ...).
    """
    import meshio

    space = np.pad(points, ((0, 0), (0, 3 - points.shape[1])))
    kind = {2: "line", 3: "triangle", 4: "tetra"}[cells.shape[1]]
    of_cells = {name: [values] for name, values in (cell_data or {}).items()}
    with whole(path) as part:
        meshio.Mesh(space, [(kind, cells)], data, of_cells).write(part, "gmsh" if path.suffix == ".msh" else None)


def write_pvd(path: Path, frames: Sequence[tuple[float, str]]) -> None:
    """Write a PVD index. ``frames``: for each file its time (the frame number) and its path relative to the index."""
    entries = "".join(f'<DataSet timestep="{time}" file={quoteattr(name)}/>\n' for time, name in frames)
    collection = f'<VTKFile type="Collection"><Collection>\n{entries}</Collection></VTKFile>\n'
    write_text(path, f'<?xml version="1.0"?>\n{collection}')


def write_text(path: Path, text: str) -> None:
    """Write ``text`` in UTF-8. If ``path`` is a pipe or a device, the text is written directly into it."""
    if path.exists() and not path.is_file():
        try:
            path.write_text(text, encoding="utf-8")
        except OSError as error:
            raise OSError(error.errno, error.strerror, str(path)) from error
        return
    with whole(path) as part:
        part.write_text(text, encoding="utf-8")


@contextmanager
def whole(path: Path) -> Iterator[Path]:
    """A temporary file, which replaces ``path`` on success. An OSError names ``path`` and, on a full disk, the free space."""
    part = path.with_name(f".{path.stem}-{os.getpid()}{path.suffix}")
    clear(path)
    try:
        yield part
        part.replace(path)
    except OSError as error:
        raise _unwritten(path, error) from error
    finally:
        with suppress(OSError):
            part.unlink(missing_ok=True)


def make_folder(path: Path) -> None:
    """Create the folder ``path`` and missing parent folders. An OSError names ``path`` and the reason."""
    try:
        path.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise _unwritten(path, error) from error


def _unwritten(path: Path, error: OSError) -> OSError:
    """The error for a file or folder ``path`` that could not be written, with the reason as a sentence."""
    why = error.strerror or str(error)
    if error.errno in (None, *NO_ROOM):  # errors of numpy have no number
        free = shutil.disk_usage(path.parent).free
        why += f"; {free / 2**20:.3g} MB are free there. Existing files are unchanged; finished work is kept and can be continued"
    found = OSError(f"{path}: cannot be written: {why}")
    found.errno = error.errno
    return found


def clear(path: Path) -> None:
    """Remove half-written copies of the file or folder ``path`` that killed processes have left behind."""
    for part in path.parent.glob(f".{glob.escape(path.stem)}-*{glob.escape(path.suffix)}"):
        process = part.name.removeprefix(f".{path.stem}-").removesuffix(path.suffix)
        with suppress(OSError):
            if process.isdecimal() and not lives(int(process)) and time.time() - part.stat().st_mtime > _SETTLED:
                shutil.rmtree(part) if part.is_dir() else part.unlink()


def _attempt[T](read: Callable[[Path], T], path: Path, want: str) -> T:
    """The result of ``read`` for a file. Any error that a damaged file causes becomes an InputError."""
    if not is_file(path):
        raise InputError(path, "no file", want)
    check_size(path, MOST_BYTES, want)
    try:
        return read(path)
    except MemoryError as error:
        raise InputError(path, "more than fits into memory", want) from error
    except Exception as error:  # the readers of other packages raise errors of any type
        raise InputError(path, str(error) or type(error).__name__, want) from error
