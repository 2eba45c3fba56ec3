"""Tetrahedra that were made before are read, as they were made; whatever they depend on makes others."""

import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import shapes

from fem_reference.foundations import mesh, rows
from fem_reference.foundations.mesh import Surface, TetMesh
from fem_reference.geometry import kept_meshes
from fem_reference.geometry.kept_meshes import cached, kept

_TEXT: Any = {"check": True, "capture_output": True, "text": True}
BOX = shapes.skin(shapes.box((2, 2, 2), (10, 10, 10)))
SHARES = {"top": np.ones((len(BOX.triangles), 3))}


class Mesher:
    """Counts what it is asked for."""

    def __init__(self) -> None:
        self.count = 0

    def __call__(self, _: Surface, size: float, shares: dict) -> TetMesh:
        self.count += 1
        tets = shapes.box((1, 1, 1), (size, size, size))
        return TetMesh(tets.points, tets.tets, {name: np.array([[0, 1, 2]]) for name in shares}, "gmsh")


def test_what_was_made_is_read_bit_by_bit(tmp_path: Path) -> None:
    mesher = Mesher()
    made, read = (cached(mesher, BOX, 3.0, SHARES, tmp_path / "kept") for _ in range(2))
    assert mesher.count == 1
    assert np.array_equal(read.points, made.points)
    assert np.array_equal(read.tets, made.tets)
    assert read.maker == made.maker
    assert list(read.facets) == ["top"]
    assert np.array_equal(read.facets["top"], made.facets["top"])
    assert [path.suffix for path in (tmp_path / "kept").iterdir()] == [".npz"]


def test_another_surface_size_attachment_or_code_is_another_mesh(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    mesher, half = Mesher(), {"top": SHARES["top"] / 2}
    moved = Surface(BOX.points + 1e-9, BOX.triangles, "")
    for surface, size, shares in (
        (BOX, 3.0, SHARES),
        (moved, 3.0, SHARES),
        (BOX, 3.1, SHARES),
        (BOX, 3.0, half),
        (BOX, 3.0, {"bottom": SHARES["top"]}),
    ):
        cached(mesher, surface, size, shares, tmp_path)
    assert mesher.count == 5
    monkeypatch.setattr(kept_meshes, "code", lambda: "another")
    cached(mesher, BOX, 3.0, SHARES, tmp_path)
    assert mesher.count == 6
    assert cached(mesher, BOX, 3.0, SHARES, None).maker == "gmsh"
    assert mesher.count == 7


def test_a_damaged_file_is_made_anew_and_a_folder_that_cannot_be_is_no_reason_to_fail(tmp_path: Path, caplog) -> None:
    mesher = Mesher()
    cached(mesher, BOX, 3.0, SHARES, tmp_path)
    (path,) = tmp_path.iterdir()
    path.write_bytes(path.read_bytes()[:100])
    assert cached(mesher, BOX, 3.0, SHARES, tmp_path).maker == "gmsh"
    assert mesher.count == 2
    assert "damaged and are computed again" in caplog.text
    (tmp_path / "file").write_text("")
    assert cached(mesher, BOX, 3.0, SHARES, tmp_path / "file" / "kept").maker == "gmsh"
    assert "were not stored" in caplog.text


VALUES = np.array([1 / 3, -0.0, 1e-320, np.inf])


@pytest.fixture
def asked() -> tuple[list[int], Callable[[Path], np.ndarray]]:
    """Each time that the values are made, and a call for them."""
    made: list[int] = []

    def make() -> np.ndarray:
        made.append(len(made))
        return VALUES

    return made, lambda path: kept(path, make, lambda values: {"values": values}, lambda arrays: arrays["values"])


def test_arrays_are_made_once_and_come_back_bit_by_bit(asked, tmp_path: Path) -> None:
    made, call = asked
    for _ in range(3):
        assert call(tmp_path / "a" / "b.npz").tobytes() == VALUES.tobytes()
    assert made == [0]
    assert [path.name for path in (tmp_path / "a").iterdir()] == ["b.npz"]


@pytest.mark.parametrize("data", ["cut", b"", b"no arrays at all"])
def test_a_damaged_file_is_made_anew(data, asked, tmp_path: Path, caplog) -> None:
    made, call = asked
    path = tmp_path / "b.npz"
    call(path)
    path.write_bytes(path.read_bytes()[:50] if data == "cut" else data)
    assert call(path).tobytes() == VALUES.tobytes()
    assert call(path).tobytes() == VALUES.tobytes()
    assert made == [0, 1]
    assert f"{path}: the stored arrays are damaged and are computed again" in caplog.text


def test_arrays_that_are_programs_are_not_run(asked, tmp_path: Path, caplog) -> None:
    made, call = asked
    np.savez(tmp_path / "b.npz", values=np.array([print], object))
    assert call(tmp_path / "b.npz").tobytes() == VALUES.tobytes()
    assert made == [0]
    assert "Object arrays cannot be loaded" in caplog.text


def test_a_place_that_cannot_be_written_is_no_reason_to_fail(asked, tmp_path: Path, caplog) -> None:
    made, call = asked
    (tmp_path / "file").write_text("")
    assert call(tmp_path / "file" / "b.npz") is VALUES
    assert made == [0]
    assert "were not stored" in caplog.text


def test_all_code_that_makes_meshes_and_distances_is_part_of_their_keys() -> None:
    """Every module of ours that a module of geometry loads, itself or by another: only that which writes files is left out."""
    code = "import pkgutil, importlib, sys, fem_reference.geometry as g; "
    code += "[importlib.import_module(f'{g.__name__}.{one.name}') for one in pkgutil.iter_modules(g.__path__)]; "
    code += "print(*(m.__file__ for n, m in sys.modules.items() if n.startswith('fem_reference.') and m.__file__), sep='\\n')"
    loaded = {Path(line) for line in subprocess.run([sys.executable, "-c", code], **_TEXT).stdout.split()}
    missing = {str(path.relative_to(Path(mesh.__file__).parents[1])) for path in loaded - set(kept_meshes.sources())}
    assert {name for name in missing if not name.startswith("io/")} == set()
    assert {Path(mesh.__file__), Path(rows.__file__), Path(kept_meshes.__file__)} <= loaded
