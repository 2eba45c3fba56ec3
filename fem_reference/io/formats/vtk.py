"""VTK's own formats, legacy and XML: read with numpy, written by pyvista."""

import errno
import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np

from fem_reference.foundations.mesh import Floats, Polylines, Surface, TetMesh
from fem_reference.io.blocks import Block, Tree
from fem_reference.io.formats import Format, _vtk_legacy, _vtk_xml
from fem_reference.io.formats._vtk_cells import DataSet
from fem_reference.io.soup import Lines, Soup, check_lines, joined, only_triangles

_TRIANGLE = 5  # of VTK's cell types


def _read(path: Path) -> Soup:
    """Polygons of VTK polydata, or the cells of an unstructured grid (points and lines of polydata passed over)."""
    data = _data(path)
    if data.kind == "UnstructuredGrid" and (other := set(data.types.tolist()) - {_TRIANGLE}):
        raise ValueError(f"cells of VTK type {', '.join(map(str, sorted(other)))}")
    if "Strips" in data.cells and len(data.cells["Strips"].corners):
        raise ValueError(f"{data.kind} that is not made of triangles")
    cells = data.cells.get("Cells" if data.kind == "UnstructuredGrid" else "Polys")
    if cells is None or len(cells.corners) == 0:
        return np.empty((0, 3)), np.empty((0, 3))
    only_triangles(cells.sizes)
    return data.points, cells.corners.reshape(-1, 3)


def _read_lines(path: Path) -> Lines:
    """Points (n, 3) of the file, and the points of each line; ValueError where one is not usable."""
    data = _data(path)
    if data.kind != "PolyData" or "Lines" not in data.cells or len(data.cells["Lines"].corners) == 0:
        raise ValueError("no lines")
    cells = [cell.tolist() for cell in np.split(data.cells["Lines"].corners, data.cells["Lines"].offsets[1:-1])]
    points = np.asarray(data.points, np.float64)
    check_lines(points, cells)
    return points, joined(cells)


def read_points(path: Path) -> Any:
    """The points (n, 3) of a file."""
    return _data(path).points


def _data(path: Path) -> DataSet:
    """The data set of a VTK file."""
    data = path.read_bytes()
    return _vtk_legacy.read(data) if path.suffix.lower() == ".vtk" else _vtk_xml.read(data)


@contextmanager
def _errors() -> Iterator[list[str]]:
    """What VTK complains of meanwhile, known at the end of it, instead of on stderr; some errors it calls warnings."""
    import pyvista

    found: list[str] = []
    with pyvista.vtk_verbosity("off"), pyvista.VtkErrorCatcher(send_to_logging=False) as caught:
        yield found
    found += [event.alert for event in caught.events if "error" in str(event).lower()]


def _write(path: Path, surface: Surface, displacement: Floats) -> None:
    """The surface with point data ``displacement`` [mm], float64; as an unstructured grid in VTU."""
    import pyvista

    data = pyvista.PolyData.from_regular_faces(np.array(surface.points, np.float64), surface.triangles, deep=True)
    _save(path, data.cast_to_unstructured_grid() if path.suffix.lower() == ".vtu" else data, displacement)


def _write_lines(path: Path, lines: Polylines, displacement: Floats) -> None:
    """The lines with point data ``displacement`` [mm], float64."""
    import pyvista

    cells = pyvista.CellArray.from_arrays(lines.offsets, np.arange(len(lines.points)), deep=True)
    _save(path, pyvista.PolyData(np.array(lines.points, np.float64), lines=cells), displacement)


def write_tets(path: Path, mesh: TetMesh, displacement: Floats) -> None:
    """VTU of the tets with point data ``displacement`` [mm], float64."""
    import pyvista

    data = pyvista.UnstructuredGrid({pyvista.CellType.TETRA: mesh.tets}, np.array(mesh.points, np.float64))
    _save(path, data, displacement)


_NO_ROOM = 20007  # what VTK calls a disk that is full; other errors of the system have the system's numbers


def _save(path: Path, data: Any, displacement: Floats) -> None:
    """Write ``data`` with its ``displacement`` (n, 3) [mm]; OSError where that fails."""
    import pyvista

    data.point_data.set_vectors(displacement, "displacement")
    kinds = {
        ".vtk": pyvista.PolyDataWriter,
        ".vtp": pyvista.XMLPolyDataWriter,
        ".vtu": pyvista.XMLUnstructuredGridWriter,
    }
    with _errors():
        writer = kinds[path.suffix.lower()](path, data)
        if path.suffix.lower() == ".vtk":
            writer.writer.SetFileTypeToBinary()
        else:  # in the other modes a displacement that is not finite cannot be read again
            writer.writer.SetDataModeToAppended()
        _finish(writer)


def _finish(writer: Any) -> None:
    """Write; OSError where that fails."""
    writer.write()
    if code := writer.writer.GetErrorCode():
        number = errno.ENOSPC if code == _NO_ROOM else int(code)
        raise OSError(number, os.strerror(number) if number in errno.errorcode else f"error {code} of VTK")


def write_blocks(path: Path, blocks: Tree) -> None:
    """VTM of ``blocks`` by name, with their own files in a folder beside it of the same name; OSError where that fails."""
    import pyvista

    with _errors():
        writer = pyvista.XMLMultiBlockDataWriter(path, _collection(blocks))
        writer.writer.SetDataModeToAppended()
        _finish(writer)


def _collection(blocks: Tree) -> Any:
    import pyvista

    made = {name: _data_set(one) if isinstance(one, Block) else _collection(one) for name, one in blocks.items()}
    return pyvista.MultiBlock(made)


def _data_set(block: Block) -> Any:
    """The points and cells of a block as VTK has them, with its arrays."""
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


FORMAT = Format((".vtk", ".vtp", ".vtu"), _read, _write, _read_lines, _write_lines, lines=(".vtk", ".vtp"))
