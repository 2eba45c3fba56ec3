"""VTK's XML files of several pieces: points and cells of each piece count from its own first point."""

from pathlib import Path

import numpy as np
import pytest

from fem_reference.io import files

PIECE = """<Piece NumberOfPoints="{points}" NumberOf{name}="{cells}"><Points><DataArray type="Float64" NumberOfComponents="3"
format="ascii">{at}</DataArray></Points><{tag}><DataArray type="Int64" Name="connectivity" format="ascii">{corners}</DataArray>
<DataArray type="Int64" Name="offsets" format="ascii">{ends}</DataArray>{types}</{tag}></Piece>"""
TYPES = '<DataArray type="UInt8" Name="types" format="ascii">{0}</DataArray>'
# A tetrahedron, four triangles, as three pieces: two triangles, one and one, each with points of its own.
CORNERS = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]])
PARTS = [([0, 2, 1, 3], [[0, 1, 2], [0, 2, 3]]), ([0, 3, 2], [[0, 1, 2]]), ([1, 2, 3], [[0, 1, 2]])]


def written(path: Path, kind: str, name: str, tag: str) -> Path:
    pieces = ""
    for used, cells in PARTS:
        at = " ".join(map(str, CORNERS[used].ravel()))
        types = TYPES.format(" ".join(["5"] * len(cells))) if kind == "UnstructuredGrid" else ""
        corners, ends = " ".join(map(str, np.ravel(cells))), " ".join(str(3 * i + 3) for i in range(len(cells)))
        numbers = {"points": len(used), "cells": len(cells), "name": name, "tag": tag}
        pieces += PIECE.format(at=at, corners=corners, ends=ends, types=types, **numbers)
    path.write_text(
        f'<?xml version="1.0"?><VTKFile type="{kind}" version="0.1" byte_order="LittleEndian"><{kind}>{pieces}</{kind}></VTKFile>'
    )
    return path


@pytest.mark.parametrize(
    ("suffix", "kind", "name", "tag"),
    [("vtp", "PolyData", "Polys", "Polys"), ("vtu", "UnstructuredGrid", "Cells", "Cells")],
)
def test_triangles_of_all_pieces_are_where_each_piece_says(
    suffix: str, kind: str, name: str, tag: str, tmp_path: Path
) -> None:
    surface = files.read_surface(written(tmp_path / f"a.{suffix}", kind, name, tag), 1.0)
    found = {tuple(sorted(map(tuple, triangle))) for triangle in surface.points[surface.triangles].tolist()}
    wanted = [[0, 1, 2], [0, 1, 3], [0, 2, 3], [1, 2, 3]]
    assert len(surface.triangles) == 4
    assert found == {tuple(sorted(map(tuple, CORNERS[one].tolist()))) for one in wanted}
