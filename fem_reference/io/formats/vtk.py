"""VTK's own formats, legacy and XML, by pyvista."""

import re
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np

from fem_reference.foundations.mesh import Floats, Ints, Polylines, Surface, TetMesh
from fem_reference.io.formats import Format
from fem_reference.io.formats._vtk_sizes import check_sizes
from fem_reference.io.soup import Lines, Soup, check_lines, joined, only_triangles


def _read(path: Path) -> Soup:
    """Polygons of VTK polydata, or the cells of an unstructured grid (points and lines of polydata passed over)."""
    import pyvista

    data = _data(path)
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
    offsets, corners = _cells(cells)
    only_triangles(set(np.diff(offsets).tolist()))
    return data.points, corners.reshape(-1, 3)


def _read_lines(path: Path) -> Lines:
    """Points (n, 3) of the file, and the points of each line; ValueError where one is not usable."""
    import pyvista

    data = _data(path)
    if not isinstance(data, pyvista.PolyData) or data.n_lines == 0:
        raise ValueError("no lines")
    offsets, connectivity = _cells(data.GetLines())
    cells = [cell.tolist() for cell in np.split(connectivity, offsets[1:-1])]
    points = np.asarray(data.points, np.float64)
    check_lines(points, cells)
    return points, joined(cells)


def _cells(cells: Any) -> tuple[Ints, Ints]:
    """Where each of VTK's cells begins in the list of their points, and that list."""
    import pyvista

    return pyvista.convert_array(cells.GetOffsetsArray()), pyvista.convert_array(cells.GetConnectivityArray())


def _data(path: Path) -> Any:
    """The data set of a VTK file; ValueError with VTK's own words where it complains."""
    import pyvista

    check_sizes(path.read_bytes(), xml=path.suffix.lower() != ".vtk")
    with _errors() as errors:
        reader = pyvista.get_reader(path)
        reader.reader.Update()  # the reader's own read() only logs errors and warns of them
    if errors:
        raise ValueError(re.sub(r"^.*: In .*\n| for file: .*", "", errors[0]).splitlines()[0])
    return pyvista.wrap(reader.reader.GetOutputDataObject(0))


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
        writer.write()
        if code := writer.writer.GetErrorCode():
            raise OSError(f"VTK could not write it (its error {code})")


FORMAT = Format((".vtk", ".vtp", ".vtu"), _read, _write, _read_lines, _write_lines, lines=(".vtk", ".vtp"))
