"""States and fields on disk: kept by default where they are small, read back with every node, and a damaged file is named."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import shapes
import small

import fem_reference as fr
from fem_reference.foundations.errors import InputError
from fem_reference.geometry.field_mesh import FieldMesh
from fem_reference.io import files
from fem_reference.problems.body import ELEMENTS, Cells
from fem_reference.runs import states
from fem_reference.runs.states import NodalField, NodalState, write_arrays
from fem_reference.solvers import fenicsx
from fem_reference.solvers.fenicsx import resources


@pytest.mark.parametrize("element", [name for name, (kind, _, _) in ELEMENTS.items() if kind == "tetrahedron"])
def test_the_size_of_states_is_that_of_their_files(element: str, tmp_path: Path) -> None:
    mesh = shapes.box((2, 2, 4), (10, 10, 40))
    cells = Cells(mesh.points, mesh.tets, "tetrahedron", 1, {})
    _, degree, pressure = ELEMENTS[element]
    nodes, pressures = (10 if degree == 2 else 4), {None: 0, 0: 1, 1: 4}[pressure]
    state = NodalState(np.zeros((96, nodes, 3)), np.zeros((96, pressures)), np.zeros((0, 0, 3)))
    states.write(tmp_path, 0, state)
    written = (tmp_path / states.FOLDER / "frame_0000.npz").stat().st_size
    # Beside the arrays a file has four headers of 128 bytes, their names and a directory.
    assert written == pytest.approx(resources.state(cells, element, steps=False), abs=1500)
    states.write(tmp_path, 1, replace(state, before=state.displacement))
    written = (tmp_path / states.FOLDER / "frame_0001.npz").stat().st_size
    assert written == pytest.approx(resources.state(cells, element, steps=True), abs=1500)


@pytest.mark.slow
def test_small_states_are_kept_by_default_and_large_ones_are_not(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    case = fr.load_case(small.write(tmp_path / "bar"), {"frames.last": 5, "bone[1].motion.keyframes": KEYFRAMES})
    run = fr.solve(case, store=tmp_path / "runs")
    assert states.are_kept(run.folder, run.numbers)
    size = sum(path.stat().st_size for path in (run.folder / states.FOLDER).glob("frame_*"))
    assert size < resources.MOST_STATES
    monkeypatch.setattr(resources, "MOST_STATES", size / 2)
    run = fr.solve(case, store=tmp_path / "others")
    assert not (run.folder / states.FOLDER).exists()
    # Asked for, they are kept whatever their size; the same run serves both, with what was stored beside it.
    (run.folder / "error_bar.json").write_text(json.dumps({"kept": True}))
    asked = fr.load_case(
        tmp_path / "bar", {"frames.last": 5, "bone[1].motion.keyframes": KEYFRAMES, "reference.store_state": True}
    )
    again = fr.solve(asked, store=tmp_path / "others")
    assert again.folder == run.folder
    assert states.are_kept(again.folder, again.numbers)
    assert np.array_equal(again.positions, run.positions)
    assert json.loads((again.folder / "error_bar.json").read_text()) == {"kept": True}


def test_states_are_kept_only_where_those_of_all_frames_are(tmp_path: Path) -> None:
    mesh = shapes.box((1, 1, 1), (10, 10, 10))
    state = NodalState(np.zeros((6, 4, 3)), np.zeros((6, 1)), np.zeros((0, 0, 3)))
    states.write(tmp_path, 0, state)
    assert not states.are_kept(tmp_path, (0,))  # of which mesh nobody knows
    states.write_rest(tmp_path, mesh, None)
    assert states.are_kept(tmp_path, (0,))
    assert not states.are_kept(tmp_path, (0, 5))
    states.write(tmp_path, 5, state)
    assert states.are_kept(tmp_path, (0, 5))


KEYFRAMES = [{"frame": 0, "angle": "0 rad"}, {"frame": 5, "angle": "0.1 rad"}]


def test_bodies_carry_no_states_by_default() -> None:
    assert not fenicsx.BodySettings().store_state


SQUARE = FieldMesh(np.array([[0.0, 0], [1, 0], [1, 1], [0, 1]]), np.array([[0, 1, 2], [0, 2, 3]]), "a square")
WHOLE = {"points": SQUARE.points, "cells": SQUARE.cells, "psi": np.arange(4.0)}


@pytest.mark.parametrize("nodes", [4, 9])
def test_what_is_written_reads_back(nodes: int, tmp_path: Path) -> None:
    """On vertices alone, or on the middles of the five edges too; ParaView is shown the vertices."""
    for number in (0, 5):
        values = {"psi": np.arange(nodes) + 1.0 * number, "velocity": np.full((4, 2), number)}
        path = tmp_path / states.FIELD / f"frame_{number:04d}.vtu"
        path.parent.mkdir(exist_ok=True)
        states.write_field(path, NodalField(SQUARE, values, "galerkin"))
    mesh, arrays = states.read_field(tmp_path, (0, 5))
    assert np.array_equal(mesh.points, SQUARE.points)
    assert np.array_equal(mesh.cells, SQUARE.cells)
    assert np.array_equal(arrays["psi"], [np.arange(nodes), np.arange(nodes) + 5.0])
    assert arrays["velocity"].shape == (2, 4, 2)
    assert np.array_equal(files.read_points(tmp_path / states.FIELD / "frame_0005.vtu")[:, :2], SQUARE.points)


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
    (tmp_path / states.FIELD).mkdir()
    damaged = {name: array for name, array in (WHOLE | changes).items() if array is not None}
    write_arrays(tmp_path / states.FIELD / "frame_0000.npz", WHOLE)
    write_arrays(tmp_path / states.FIELD / "frame_0005.npz", damaged)
    with pytest.raises(InputError, match=message):
        states.read_field(tmp_path, (0, 5))


def test_there_is_one_value_a_node(tmp_path: Path) -> None:
    """A square of two triangles has 4 vertices and 5 edges."""
    (tmp_path / states.FIELD).mkdir()
    write_arrays(tmp_path / states.FIELD / "frame_0000.npz", WHOLE | {"psi": np.zeros(7)})
    with pytest.raises(InputError, match=r"frame_0000\.npz: got 7 values, want 4 or 9, one for each node"):
        states.read_field(tmp_path, (0,))
