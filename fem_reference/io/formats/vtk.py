"""The formats of VTK, legacy and XML, read with numpy and written by pyvista."""

import errno
import os
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from fem_reference.foundations.mesh import Floats, Ints, Polylines
from fem_reference.io.formats import Format, _vtk_legacy, _vtk_xml
from fem_reference.io.soup import DataSet, Soup, check_lengths, joined, only_triangles

_TRIANGLE = 5  # VTK's number for triangles
_NO_ROOM = 20007  # VTK's error code for a full disk; other system errors keep their numbers
LINES = (".vtk", ".vtp")  # the suffixes of the formats that have polylines
_WRITERS = {".vtk": "PolyDataWriter", ".vtp": "XMLPolyDataWriter", ".vtu": "XMLUnstructuredGridWriter"}


@dataclass(frozen=True, eq=False)
class DataBlock:
    """A block of data: ``cells``, which are triangles (m, 3), tetrahedra (m, 4) or lines, between ``points`` (n, 3) [mm].
    ``of_points`` and ``of_cells``: arrays by name, (n, ...) and (m, ...). ``numbers``: by name, values for the entire block.
    """

    points: Floats
    cells: Ints | Polylines
    of_points: dict[str, Floats] = field(default_factory=dict)
    of_cells: dict[str, Floats] = field(default_factory=dict)
    numbers: dict[str, float] = field(default_factory=dict)


type Tree = Mapping[str, "DataBlock | Tree"]


def _read(path: Path) -> Soup:
    """The polygons of VTK polydata, or the cells of an unstructured grid. Vertices and lines of polydata are skipped."""
    data = data_set(path)
    if data.kind == "UnstructuredGrid" and (other := set(data.types.tolist()) - {_TRIANGLE}):
        raise ValueError(f"cells of VTK type {', '.join(map(str, sorted(other)))}")
    if "Strips" in data.cells and len(data.cells["Strips"].corners):
        raise ValueError(f"{data.kind} with cells other than triangles")
    cells = data.cells.get("Cells" if data.kind == "UnstructuredGrid" else "Polys")
    if cells is None or len(cells.corners) == 0:
        return np.empty((0, 3)), np.empty((0, 3))
    only_triangles({*cells.sizes.tolist()})
    return data.points, cells.corners.reshape(-1, 3)


def read_lines(path: Path, *, moved: bool) -> tuple[Floats, list[list[int]]]:
    """The points (n, 3) in the file, and the point numbers of each line. Raises ValueError for a line of one point and, unless
    ``moved``, for a point that is not finite or a line without length.
    """
    data = data_set(path)
    found = data.cells.get("Lines")
    if data.kind != "PolyData" or found is None or len(found.corners) == 0:
        raise ValueError("no lines")
    cells = [cell.tolist() for cell in np.split(found.corners, np.cumsum(found.sizes)[:-1])]
    for number, cell in enumerate(cells):
        if len(cell) < 2:
            raise ValueError(f"line {number} of fewer than two points")
    points, lines = np.asarray(data.points, np.float64), joined(cells)
    if not moved:
        check_lengths(points, lines)
    return points, lines


def data_set(path: Path) -> DataSet:
    """The points and cells in a VTK file."""
    read = _vtk_legacy.read if path.suffix.lower() == ".vtk" else _vtk_xml.read
    return read(path.read_bytes())


def save(path: Path, points: Floats, cells: Ints | Polylines, displacement: Floats) -> None:
    """Write ``cells`` with point data ``displacement`` (n, 3) [mm], in VTU as an unstructured grid. OSError if that fails."""
    data, suffix = _data_set(DataBlock(points, cells)), path.suffix.lower()
    data.point_data.set_vectors(displacement, "displacement")
    _finish(_WRITERS[suffix], path, data.cast_to_unstructured_grid() if suffix == ".vtu" else data)


def _finish(kind: str, path: Path, data: Any) -> None:
    """Write ``data`` with VTK's writer ``kind``, without its messages. Raises OSError if that fails."""
    import pyvista

    with pyvista.vtk_verbosity("off"), pyvista.VtkErrorCatcher(send_to_logging=False):
        writer = getattr(pyvista, kind)(path, data)
        if path.suffix.lower() == ".vtk":
            writer.writer.SetFileTypeToBinary()
        else:  # written in other modes, a displacement that is not finite cannot be read back by VTK
            writer.writer.SetDataModeToAppended()
        writer.write()
    if code := writer.writer.GetErrorCode():
        number = errno.ENOSPC if code == _NO_ROOM else int(code)
        raise OSError(number, os.strerror(number) if number in errno.errorcode else f"VTK error {code}")


def write_blocks(path: Path, blocks: Tree) -> None:
    """Write a VTM file of ``blocks`` by name, and their files into a folder next to it. If writing fails, it raises OSError, and
    some files may have been written.
    """
    _finish("XMLMultiBlockDataWriter", path, _collection(blocks))


def _collection(blocks: Tree) -> Any:
    import pyvista

    made = {name: _data_set(one) if isinstance(one, DataBlock) else _collection(one) for name, one in blocks.items()}
    return pyvista.MultiBlock(made)


def _data_set(block: DataBlock) -> Any:
    """The points, cells and arrays of a ``block`` as a pyvista data set."""
    import pyvista

    points = np.array(block.points, np.float64)
    if isinstance(block.cells, Polylines):
        cells = pyvista.CellArray.from_arrays(block.cells.offsets, np.arange(len(points)), deep=True)
        data: Any = pyvista.PolyData(points, lines=cells)
    elif block.cells.shape[1] == 4:
        data = pyvista.UnstructuredGrid({pyvista.CellType.TETRA: block.cells}, points)
    else:
        data = pyvista.PolyData.from_regular_faces(points, block.cells, deep=True)
    for name, values in block.of_points.items():
        data.point_data[name] = values
    for name, values in block.of_cells.items():
        data.cell_data[name] = values
    for name, value in block.numbers.items():
        data.field_data[name] = [value]
    return data


FORMAT = Format(
    (".vtk", ".vtp", ".vtu"), _read, lambda path, surface, moves: save(path, surface.points, surface.triangles, moves)
)
