"""Fields on disk: they read back with every node, and a damaged file is named."""

from pathlib import Path

import numpy as np
import pytest

from fem_reference.foundations.errors import InputError
from fem_reference.geometry.field_mesh import FieldMesh
from fem_reference.io import files
from fem_reference.runs import fields
from fem_reference.runs.fields import NodalField
from fem_reference.runs.states import write_arrays

SQUARE = FieldMesh(np.array([[0.0, 0], [1, 0], [1, 1], [0, 1]]), np.array([[0, 1, 2], [0, 2, 3]]), "a square")
WHOLE = {"points": SQUARE.points, "cells": SQUARE.cells, "psi": np.arange(4.0)}


@pytest.mark.parametrize("nodes", [4, 9])
def test_what_is_written_reads_back(nodes: int, tmp_path: Path) -> None:
    """On vertices alone, or on the middles of the five edges too; ParaView is shown the vertices."""
    for number in (0, 5):
        values = {"psi": np.arange(nodes) + 1.0 * number, "velocity": np.full((4, 2), number)}
        path = tmp_path / fields.FOLDER / f"frame_{number:04d}.vtu"
        path.parent.mkdir(exist_ok=True)
        fields.write(path, NodalField(SQUARE, values, "galerkin"))
    mesh, arrays = fields.read(tmp_path, (0, 5))
    assert np.array_equal(mesh.points, SQUARE.points)
    assert np.array_equal(mesh.cells, SQUARE.cells)
    assert np.array_equal(arrays["psi"], [np.arange(nodes), np.arange(nodes) + 5.0])
    assert arrays["velocity"].shape == (2, 4, 2)
    assert np.array_equal(files.read_points(tmp_path / fields.FOLDER / "frame_0005.vtu")[:, :2], SQUARE.points)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"psi": None}, r"frame_0005\.npz: got points, cells, want the arrays points, cells and psi"),
        ({"psi": np.zeros(5)}, r"frame_0005\.npz: got .*, want points \(n, d\), cells .* as in the other frames"),
        ({"cells": SQUARE.cells + 1}, r"frame_0005\.npz: got .*, want points \(n, d\), cells"),
        ({"cells": SQUARE.cells - 1}, r"frame_0005\.npz: got .*, want points \(n, d\), cells"),
        ({"psi": np.array(["a"] * 4)}, r"frame_0005\.npz: got .*, want points \(n, d\), cells"),
        ({"psi": np.zeros((4, 1))}, r"frame_0005\.npz: got .*, want points \(n, d\), cells"),
    ],
)
def test_a_damaged_frame_is_named(changes: dict[str, object], message: str, tmp_path: Path) -> None:
    (tmp_path / fields.FOLDER).mkdir()
    damaged = {name: array for name, array in (WHOLE | changes).items() if array is not None}
    write_arrays(tmp_path / fields.FOLDER / "frame_0000.npz", WHOLE)
    write_arrays(tmp_path / fields.FOLDER / "frame_0005.npz", damaged)
    with pytest.raises(InputError, match=message):
        fields.read(tmp_path, (0, 5))


def test_there_is_one_value_a_node(tmp_path: Path) -> None:
    """A square of two triangles has 4 vertices and 5 edges."""
    (tmp_path / fields.FOLDER).mkdir()
    write_arrays(tmp_path / fields.FOLDER / "frame_0000.npz", WHOLE | {"psi": np.zeros(7)})
    with pytest.raises(InputError, match=r"frame_0000\.npz: got 7 values, want 4 or 9, one a node"):
        fields.read(tmp_path, (0,))
