"""VTK's files, and gmsh's: those that say more than they have are refused, and every way in which VTK writes is read."""

import base64
import re
import struct
import zlib
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import pyvista
import shapes

from fem_reference.foundations.errors import InputError
from fem_reference.io import files

BALL = shapes.sphere(1, 30.0)

VTU = """<?xml version="1.0"?><VTKFile type="UnstructuredGrid" version="0.1" byte_order="LittleEndian"{compressor}>
<UnstructuredGrid><Piece NumberOfPoints="{points}" NumberOfCells="{cells}"><Points>
<DataArray type="Float64" NumberOfComponents="{components}" format="{form}">{data}</DataArray></Points><Cells>
<DataArray type="Int64" Name="connectivity" format="ascii">0 1 2</DataArray>
<DataArray type="Int64" Name="offsets" format="ascii">3</DataArray>
<DataArray type="UInt8" Name="types" format="ascii">5</DataArray></Cells></Piece></UnstructuredGrid></VTKFile>"""
VALUES = {"compressor": "", "points": 3, "cells": 1, "components": 3, "form": "ascii", "data": "0 0 0 1 0 0 0 1 0"}
ZLIB = ' compressor="vtkZLibDataCompressor"'


def _packed(blocks: int, block: int, data: bytes) -> str:
    packed = zlib.compress(data)
    head = struct.pack("<3I", blocks, block, 0) + struct.pack("<I", len(packed)) * min(blocks, 1000)
    return (base64.b64encode(head) + base64.b64encode(packed * min(blocks, 1000))).decode()


@pytest.mark.parametrize(
    ("changes", "got"),
    [
        ({"points": 10**9}, "3 points instead of 1000000000"),
        ({"points": "4294967295 0"}, 'NumberOfPoints of "4294967295 0"'),
        ({"cells": 2**40}, "1 offsets instead of"),
        ({"form": "binary", "data": base64.b64encode(struct.pack("<I", 2**32 - 8)).decode()}, "8 bytes instead of"),
        ({"form": "binary", "data": _packed(1000, 2**20, b""), "compressor": ZLIB}, "an array of 1048576000 bytes"),
        (
            {"form": "binary", "data": _packed(1, 24, bytes(2**20)), "compressor": ZLIB},
            "a block of 25 bytes in place of 24",
        ),
        ({"compressor": ' compressor="vtkBestDataCompressor"'}, "compressed by vtkBestDataCompressor"),
    ],
)
def test_a_vtu_that_says_more_than_it_has_is_refused(changes: dict[str, Any], got: str, tmp_path: Path) -> None:
    path = tmp_path / "a.vtu"
    path.write_text(VTU.format(**VALUES))
    assert len(files.read_surface(path, 1.0).points) == 3
    path.write_text(VTU.format(**VALUES | {"components": 4294967295}))  # which nothing depends on
    assert len(files.read_surface(path, 1.0).points) == 3
    path.write_text(VTU.format(**VALUES | changes))
    with pytest.raises(InputError, match=rf"a\.vtu: got .*{re.escape(got)}"):
        files.read_surface(path, 1.0)


HEAD = "# vtk DataFile Version 3.0\nx\nASCII\nDATASET POLYDATA\n"


@pytest.mark.parametrize(
    ("text", "got"),
    [
        ("POINTS 99999999999 double\n0 0 0\n", "numbers declared in"),
        ("POINTS -1 double\n0 0 0\n", 'a count of "-1"'),
        ("POINTS 1 double\n0 0 0\nPOLYGONS 1 4\n3 0 0 7\n", "cell 0 with a point outside 0 to 0"),
        ("POINTS 1 double\n0 0 0\nPOLYGONS 1 4\n99 0 0 0\n", "do not add up to 3 corners"),
        ("POINTS 1 string\n0 0 0\n", 'numbers of type "string"'),
        ("NONSENSE 1 2\n", 'a section "NONSENSE"'),
    ],
)
def test_a_legacy_file_that_says_more_than_it_has_is_refused(text: str, got: str, tmp_path: Path) -> None:
    (tmp_path / "a.vtk").write_text(HEAD + text)
    with pytest.raises(InputError, match=rf"a\.vtk: got .*{re.escape(got)}"):
        files.read_surface(tmp_path / "a.vtk", 1.0)


@pytest.mark.parametrize("mode", ["ascii", "binary", "appended", "raw"])
@pytest.mark.parametrize("packed", ["none", "zlib", "lz4", "lzma"])
@pytest.mark.parametrize("wide", [False, True])
@pytest.mark.parametrize("suffix", [".vtp", ".vtu"])
def test_what_vtk_writes_is_read_as_vtk_reads_it(
    mode: str, packed: str, suffix: str, tmp_path: Path, *, wide: bool
) -> None:
    """Every way in which VTK writes its XML, of many blocks, with data that is passed over."""
    ball = shapes.sphere(3, 30.0)
    data: Any = pyvista.PolyData.from_regular_faces(ball.points, ball.triangles)
    data.point_data["name of \u00fc"] = np.arange(len(ball.points))
    data.cell_data["tensor"] = np.ones((len(ball.triangles), 9))
    kinds = {".vtp": pyvista.XMLPolyDataWriter, ".vtu": pyvista.XMLUnstructuredGridWriter}
    writer = kinds[suffix](
        tmp_path / f"a{suffix}", data.cast_to_unstructured_grid() if suffix == ".vtu" else data
    ).writer
    {"ascii": writer.SetDataModeToAscii, "binary": writer.SetDataModeToBinary}.get(mode, writer.SetDataModeToAppended)()
    writer.SetEncodeAppendedData(mode == "appended")
    writer.SetCompressorType({"none": 0, "zlib": 1, "lz4": 2, "lzma": 3}[packed])
    writer.SetBlockSize(4096)
    (writer.SetHeaderTypeToUInt64 if wide else writer.SetHeaderTypeToUInt32)()
    writer.SetByteOrder(0 if wide else 1)
    assert writer.Write()
    back = files.read_surface(tmp_path / f"a{suffix}", 1.0)
    assert np.abs(back.points - ball.points).max() <= (1e-9 if mode == "ascii" else 0)
    assert np.array_equal(back.triangles, ball.triangles)


@pytest.mark.parametrize("binary", [False, True])
@pytest.mark.parametrize("version", [42, 51])
@pytest.mark.parametrize("grid", [False, True])
def test_what_vtk_writes_in_its_old_format_is_read(version: int, tmp_path: Path, *, binary: bool, grid: bool) -> None:
    """With attributes of every kind, which are passed over."""
    data: Any = pyvista.PolyData.from_regular_faces(BALL.points, BALL.triangles)
    n, m = len(BALL.points), len(BALL.triangles)
    for kind in (np.uint8, np.int8, np.int16, np.uint32, np.int64, np.float32, np.float64):
        data.point_data[f"as {kind.__name__}"] = np.arange(2 * n).reshape(n, 2).astype(kind)
        data.cell_data[f"of {kind.__name__}"] = np.arange(m).astype(kind)
    data.point_data.active_normals = BALL.points
    data.point_data.set_vectors(BALL.points, "displacement")
    data.point_data.active_texture_coordinates = BALL.points[:, :2]
    data.cell_data.set_scalars(np.arange(m), "one")
    writer = (pyvista.UnstructuredGridWriter if grid else pyvista.PolyDataWriter)(
        tmp_path / "a.vtk", data.cast_to_unstructured_grid() if grid else data
    ).writer
    writer.SetFileVersion(version)
    (writer.SetFileTypeToBinary if binary else writer.SetFileTypeToASCII)()
    assert writer.Write()
    back = files.read_surface(tmp_path / "a.vtk", 1.0)
    assert np.abs(back.points - BALL.points).max() <= (0 if binary else 1e-4)  # six digits
    assert np.array_equal(back.triangles, BALL.triangles)


def test_pieces_of_a_file_are_one_surface(tmp_path: Path) -> None:
    piece = VTU.format(**VALUES)
    start, end = piece.index("<Piece"), piece.index("</UnstructuredGrid>")
    (tmp_path / "a.vtu").write_text(piece[:end] + piece[start:end] + piece[end:])
    assert files.read_surface(tmp_path / "a.vtu", 1.0).triangles.tolist() == [[0, 1, 2], [3, 4, 5]]
