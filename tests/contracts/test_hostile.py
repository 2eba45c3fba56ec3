"""What bad input is refused for, and how: before memory is taken, by a sentence that names the place, and never as a verdict."""

import base64
import json
import os
import re
import struct
import zipfile
import zlib
from pathlib import Path
from typing import Any

import h5py
import hostile
import meshio
import numpy as np
import pytest
import pyvista
import shapes

from fem_reference import cli
from fem_reference.assessment import baseline
from fem_reference.foundations.errors import InputError
from fem_reference.foundations.mesh import Surface, check_finite
from fem_reference.foundations.records import FileName, Name, Record, parse
from fem_reference.foundations.units import positive, quantity
from fem_reference.geometry.patches import draped, fan
from fem_reference.io import files, texts
from fem_reference.problems import muscle
from fem_reference.runs import states, store
from fem_reference.scenes import casefile
from fem_reference.scenes.case import ALLOWED_SETTING, HOME
from fem_reference.scenes.made import make_case
from fem_reference.solvers import fenicsx, recorded

SCENE = (HOME / "cases" / "box_squeeze" / "case.toml").read_text(encoding="utf-8")
BALL = hostile.BALL


def scene(folder: Path, old: str = "", new: str = "", before: str = "") -> Path:
    """The folder of the box, its text changed."""
    assert old in SCENE
    folder.mkdir(exist_ok=True)
    (folder / "case.toml").write_text(before + SCENE.replace(old, new, 1) if old else before + SCENE, encoding="utf-8")
    return folder


# Texts

DEEP = {
    "lists": "x = " + "[" * 5000 + "]" * 5000,
    "tables": "x = " + "{a=" * 5000 + "1" + "}" * 5000,
    "a dotted key": ".".join(["a"] * 5000) + " = 1",
    "a dotted key of quoted parts": ".".join(['"a"'] * 5000) + " = 1",
    "many digits": "x = " + "9" * 5000,
}


@pytest.mark.parametrize("text", DEEP.values(), ids=DEEP)
def test_a_text_without_end_is_refused(text: str, tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"case\.toml: got .*want a TOML file"):
        casefile.read(scene(tmp_path / "box", before=f"{text}\n"))
    (tmp_path / "candidate.toml").write_text(text)
    with pytest.raises(InputError, match=r"candidate\.toml: got .*want a TOML file"):
        recorded.about(tmp_path)
    assert casefile.setting(f"a={text[4:]}") == ("a", text[4:])  # what is no TOML value is text


@pytest.mark.parametrize(
    "text", ["[" * 100_000, '{"a":' * 5000 + "1" + "}" * 5000, '{"a": ' + "9" * 5000 + "}", '{"a": NaN}']
)
def test_a_baseline_and_a_run_without_end_are_refused(text: str, tmp_path: Path) -> None:
    for name in ("ball.json", "run.json"):
        (tmp_path / name).write_text(text)
    with pytest.raises(InputError, match=r"ball\.json: got .*want the baseline of a candidate"):
        baseline.read(tmp_path / "ball.json", hostile.BALL_SCENE, "mine")
    with pytest.raises(InputError, match=r"run\.json: got .*want the run\.json of a stored run"):
        store.load(tmp_path)
    assert store.status(tmp_path) == "damaged"


def test_a_text_may_begin_with_the_mark_of_its_order_of_bytes(tmp_path: Path) -> None:
    (tmp_path / "candidate.toml").write_text('name = "mine"', encoding="utf-8-sig")
    assert recorded.about(tmp_path).name == "mine"
    (tmp_path / "a.json").write_text("[1]", encoding="utf-8-sig")
    assert texts.read_json(tmp_path / "a.json", "numbers") == [1]


def test_a_text_that_is_too_large_is_refused_unread(tmp_path: Path) -> None:
    with (tmp_path / "candidate.toml").open("wb") as file:
        file.truncate(2**34)  # of holes
    with pytest.raises(InputError, match=r"candidate\.toml: got a file of 16384 MB, want a TOML file, of at most 2 MB"):
        recorded.about(tmp_path)


def test_a_message_is_one_line_that_a_terminal_shows_as_it_is() -> None:
    text = str(InputError("a\nb", "\x1b[31m" + "x" * 10_000, "less"))
    assert text.isprintable()
    assert len(text) < 600
    assert text.startswith(r"a\nb: got \x1b[31mxxx")


# Quantities and names


@pytest.mark.parametrize(
    "unit", ["mm^9^9^9", "mm**9**9**9", "mm^(9^9^9)", "mm^999", "mm^2.5", "mm^9e9", "mm^-9^9", "mm" * 60]
)
def test_a_unit_with_an_exponent_that_has_no_end_is_refused(unit: str) -> None:
    with pytest.raises(ValueError, match="a length with its unit"):
        quantity(f"1 {unit}", "a length")


def test_quantities_have_a_size_that_exists() -> None:
    assert quantity("1 m^3/m^2", "a length") == 1000
    assert quantity("1000 km", "a length") == 1e9
    for text, want in (
        ("1e300 kPa", "of at most 1e\\+07 MPa"),
        ("-1e300 kPa", "of at most"),
        ("1e-300 kPa", "at least 1e-30"),
    ):
        with pytest.raises(ValueError, match=want):
            positive(text, "a pressure")


BAD = [
    ('mu = "10 kPa"', 'mu = "1e300 kPa"', "effect[0].mu", "a pressure of at most 1e+07 MPa"),
    ('bulk = "10 MPa"', 'bulk = "9 kPa"', "effect[1].bulk", "at least the shear modulus of neo_hooke, 0.01 MPa"),
    ('name = "top"', 'name = ""', "bone[0].name", "a name of 1 to 100"),
    ('name = "top"', 'name = "a\\u0000b"', "bone[0].name", "a name of 1 to 100"),
    ('name = "sides"', 'name = " "', "attachment[0].name", "a name of 1 to 100"),
    ('solver = "fenicsx"', 'solver = "fenicsx"\nranks = 1000000', "reference.ranks", "less than or equal to 1024"),
]


@pytest.mark.parametrize(("old", "new", "key", "want"), BAD)
def test_a_scene_that_means_nothing_is_refused(old: str, new: str, key: str, want: str, tmp_path: Path) -> None:
    with pytest.raises(InputError, match=rf"case\.toml: {re.escape(key)}: got .*want .*{re.escape(want)}"):
        hostile.read_scene(scene(tmp_path / "box", old, new))


@pytest.mark.parametrize(("key", "value"), [("distance_rounding", "1e6 mm"), ("distance_error", "1e-6 mm")])
def test_a_distance_that_no_grid_resolves_is_refused(key: str, value: str, tmp_path: Path) -> None:
    old = 'half_space = { point = "0, -200, 0 mm", normal = [0, 1, 0] }'
    with pytest.raises(InputError, match=rf'bone\[2\]: got .*want "{key}" from 0\.001 to 10? mm'):
        casefile.read(scene(tmp_path / "box", old, f'surface = "mesh:box/box.ply"\nunit = "mm"\n{key} = "{value}"'))


@pytest.mark.parametrize("key", [f"effect[{'9' * 5000}].mu", f"effect[{'9' * 9}].mu", "9" * 5000])
def test_a_key_with_a_number_without_end_is_refused(key: str) -> None:
    with pytest.raises(InputError, match=r"got (nothing, want a key that this scene has|an unknown key)"):
        casefile.read("box_squeeze", changes={key: "1 kPa"})


def test_more_ranks_than_the_machine_has_cores_are_refused() -> None:
    with pytest.raises(InputError, match=r"ranks: got 1000, want at most \d+ on this machine"):
        fenicsx._command(parse(fenicsx.Settings, {"ranks": 1000}, "reference"), Path())


class Called(Record):
    """Something with a name, and a file's."""

    name: Name = "a"
    file: FileName = "a"


@pytest.mark.parametrize("file", ["", ".", "..", ".a", "a/b", "a b", "a\\b", "a\n", "é" * 101, "a:b"])
def test_what_is_no_name_of_a_file_is_refused(file: str) -> None:
    with pytest.raises(
        InputError, match=r"file: got .*want a name of 1 to 100 letters, digits and \. _ -, with no dot first"
    ):
        parse(Called, {"file": file}, "record")


@pytest.mark.parametrize("kind", ["folder", "pipe", "dangling"])
def test_what_a_candidate_says_is_not_passed_over(kind: str, tmp_path: Path) -> None:
    place = tmp_path / "candidate.toml"
    {"folder": place.mkdir, "pipe": lambda: os.mkfifo(place), "dangling": lambda: place.symlink_to("nothing")}[kind]()
    with pytest.raises(InputError, match=r"candidate\.toml: got no file, want a TOML file"):
        recorded.about(tmp_path)


def test_a_unit_that_is_empty_is_not_millimetres(tmp_path: Path) -> None:
    assert recorded.choice(tmp_path).settings["unit"] == "mm"
    with pytest.raises(InputError, match='unit: got "", want a unit of length'):
        parse(recorded.RecordedSettings, recorded.choice(tmp_path, "").settings, "case.toml")


@pytest.mark.parametrize(("far", "apart"), [(1e6, r"1e\+06"), (1e200, "inf")])
def test_landmarks_a_kilometre_apart_are_refused(far: float, apart: str) -> None:
    points = np.array([[0, 0, 0], [30, 0, 0], [0, 30, 0], [far, 0, 0.0]])
    with pytest.raises(InputError, match=rf"got landmarks {apart} mm apart, want those around one attachment"):
        draped(fan(points), BALL)


def test_a_point_beyond_the_world_is_refused() -> None:
    points = BALL.points.copy()
    points[3, 1] = 1e300
    with pytest.raises(InputError, match=r"a coordinate of 1e\+300 mm \(vertex 3\), want at most 1e\+09 mm"):
        check_finite(Surface(points, BALL.triangles))


# Files outside the folder of a scene


@pytest.fixture
def outside(tmp_path: Path) -> Path:
    """A box outside of the folder of the scene."""
    (tmp_path / "elsewhere").mkdir()
    (tmp_path / "elsewhere" / "box.ply").write_bytes((HOME / "meshes" / "box" / "box.ply").read_bytes())
    scene(tmp_path / "case")
    return tmp_path


@pytest.mark.parametrize("kind", ["up", "absolute", "link", "meshes"])
def test_what_lies_outside_is_read_only_where_one_allows_it(
    kind: str, outside: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (outside / "case" / "link.ply").symlink_to("../elsewhere/box.ply")
    named = {"up": "../elsewhere/box.ply", "absolute": str(outside / "elsewhere" / "box.ply"), "link": "link.ply"}
    monkeypatch.setattr("fem_reference.scenes.case.HOME", HOME)
    up = "mesh:" + "../" * 20 + str(outside / "elsewhere" / "box.ply").lstrip("/")
    folder = scene(outside / "case", "mesh:box/box.ply", named.get(kind, up))
    with pytest.raises(
        InputError, match=rf"muscle\.surface: got .*want a file in the folder of the scene, or {ALLOWED_SETTING}="
    ):
        muscle.setup(casefile.read_muscle(folder))
    monkeypatch.setenv(ALLOWED_SETTING, f"/nowhere:{outside / 'elsewhere'}")
    assert len(muscle.setup(casefile.read_muscle(folder)).bones) == 3


def test_a_program_may_name_what_it_may_read(outside: Path) -> None:
    import tomllib

    table = tomllib.loads(SCENE.replace("mesh:box/box.ply", str(outside / "elsewhere" / "box.ply")))
    case = make_case(table, folder=outside / "case")
    assert case.file(str(outside / "elsewhere" / "box.ply"), "muscle.surface").is_file()


def test_an_index_names_files_in_its_folder_only(tmp_path: Path) -> None:
    (tmp_path / "below").mkdir()
    for name in ("../out.vtp", "/etc/hostname"):
        files.write_pvd(tmp_path / "below" / "a.pvd", [(0, name)])
        with pytest.raises(InputError, match=rf'a\.pvd: got a reference to "{name}", outside the folder of the file'):
            files.read_pvd(tmp_path / "below" / "a.pvd")


def test_a_name_that_no_file_can_have_is_refused(tmp_path: Path) -> None:
    files.write_pvd(tmp_path / "a.pvd", [(0, "b" * 5000 + ".vtp")])
    (_, named), *_ = files.read_pvd(tmp_path / "a.pvd")
    with pytest.raises(InputError, match="got no file, want a "):
        files.read_surface(named, 1.0)


def _series(folder: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    folder.mkdir()
    monkeypatch.chdir(folder)  # where meshio puts its .h5
    with meshio.xdmf.TimeSeriesWriter(folder / "run.xdmf") as series:
        series.write_points_cells(BALL.points, [("triangle", BALL.triangles)])
        series.write_data(0.0, point_data={"displacement": 0 * BALL.points})
    return folder


@pytest.mark.parametrize("link", ["external", "soft", "virtual", "huge"])
def test_numbers_behind_links_of_hdf5_are_refused(link: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    folder = _series(tmp_path / "a", monkeypatch)
    assert len(files.read_xdmf(folder / "run.xdmf", 1.0)) == 1
    with h5py.File(tmp_path / "secret.h5", "w") as secret:
        secret["data0"] = BALL.points
    with h5py.File(folder / "run.h5", "a") as file:
        del file["data0"]
        if link == "external":
            file["data0"] = h5py.ExternalLink("../secret.h5", "/data0")
        elif link == "soft":
            file["data0"] = h5py.SoftLink("/data1")
        elif link == "huge":
            file.create_dataset("data0", (10**12, 3), float, chunks=(1000, 3))
        else:
            layout = h5py.VirtualLayout(BALL.points.shape, float)
            layout[:] = h5py.VirtualSource("../secret.h5", "data0", BALL.points.shape)
            file.create_virtual_dataset("data0", layout)
    with pytest.raises(InputError, match=r'run\.xdmf: got .*"/data0"'):
        files.read_xdmf(folder / "run.xdmf", 1.0)


@pytest.mark.parametrize(
    ("old", "new", "got"),
    [
        ("run.h5:/", "../b/run.h5:/", 'a reference to "../b/run.h5", outside'),
        ('Format="HDF"', 'Format="Binary"', 'numbers in the format "Binary"'),
        ("run.h5:/data0", "run.h5", "which is no FILE:/PLACE"),
        ("<Xdmf", '<!DOCTYPE a [<!ENTITY b SYSTEM "file:///etc/hostname">]><Xdmf', "a document type"),
    ],
)
def test_a_series_names_files_beside_it_only(
    old: str, new: str, got: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    folder = _series(tmp_path / "a", monkeypatch)
    text = (folder / "run.xdmf").read_text()
    assert old in text
    (folder / "run.xdmf").write_text(text.replace(old, new, 1))
    with pytest.raises(InputError, match=re.escape(got)):
        files.read_xdmf(folder / "run.xdmf", 1.0)


# Meshes that say more than they have

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
        ({"points": 10**9}, "3 points of 1000000000"),
        ({"points": "4294967295 0"}, 'NumberOfPoints of "4294967295 0"'),
        ({"cells": 2**40}, "1 offsets of"),
        ({"form": "binary", "data": base64.b64encode(struct.pack("<I", 2**32 - 8)).decode()}, "8 bytes of"),
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
        ("POINTS 99999999999 double\n0 0 0\n", "numbers said to be in"),
        ("POINTS -1 double\n0 0 0\n", 'a count of "-1"'),
        ("POINTS 1 double\n0 0 0\nPOLYGONS 1 4\n3 0 0 7\n", "cell 0 with a point that does not exist, of 1"),
        ("POINTS 1 double\n0 0 0\nPOLYGONS 1 4\n99 0 0 0\n", "cells that do not fit"),
        ("POINTS 1 string\n0 0 0\n", 'numbers of type "string"'),
        ("NONSENSE 1 2\n", 'a section "NONSENSE"'),
    ],
)
def test_a_legacy_file_that_says_more_than_it_has_is_refused(text: str, got: str, tmp_path: Path) -> None:
    (tmp_path / "a.vtk").write_text(HEAD + text)
    with pytest.raises(InputError, match=rf"a\.vtk: got .*{re.escape(got)}"):
        files.read_surface(tmp_path / "a.vtk", 1.0)


@pytest.mark.parametrize(
    ("settings", "old", "new", "got"),
    [
        ({}, b"$NodeData\n1\n", b"$NodeData\n4294967295\n", "want a triangle surface"),
        ({}, b'displacement"\n1\n', b'displacement"\n99999999999999999999\n', "a section that goes on beyond the end"),
        ({}, b"$Nodes\n", b"$Nodes\n" + struct.pack("<4Q", 1, 10**9, 1, 10**9), "Nodes that are more"),
        ({}, b"$Elements\n", b"$Elements\n" + struct.pack("<4Q", 10**9, 4, 1, 4), "Elements that are more"),
        ({"file_format": "gmsh22", "binary": False}, b"$Nodes\n", b"$Nodes\n1000000000\n", "Nodes that are more"),
        ({"file_format": "gmsh", "binary": False}, b"$Nodes\n", b"$Nodes\n1 1000000000 1 9\n", "Nodes that are more"),
    ],
)
def test_an_msh_that_says_more_than_it_has_is_refused(
    settings: dict[str, Any], old: bytes, new: bytes, got: str, tmp_path: Path
) -> None:
    displacement = {} if settings else {"displacement": BALL.points}
    path = tmp_path / "ball.msh"
    meshio.Mesh(BALL.points, [("triangle", BALL.triangles)], displacement).write(
        path, **{"file_format": "gmsh"} | settings
    )
    assert np.array_equal(files.read_surface(path, 1.0).triangles, BALL.triangles)
    data = path.read_bytes()
    assert old in data
    path.write_bytes(data.replace(old, new, 1))
    with pytest.raises(InputError, match=got):
        files.read_surface(path, 1.0)


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


# Stored runs


@pytest.fixture
def run(tmp_path: Path) -> Path:
    hostile.KINDS["run.json"].make(tmp_path)
    return tmp_path / "run"


@pytest.mark.parametrize(
    ("key", "value"),
    [
        ("numbers", [0, -1, 2]), ("numbers", [20, 10, 0]), ("numbers", "012"), ("numbers", [0.5, 1, 2]), ("scalars", []),
        ("scalars", {"energy": [1]}), ("scalars", {"energy": ["a", "b", "c"]}), ("cost", {"seconds": "1"}), ("cost", None),
        ("origin", []), ("origin", {"versions": 3}), ("parts", "surface"), ("parts", [1]), ("name", 1), ("name", ""),
        ("solver", None), ("message", {}), ("status", []), ("format", "1"), ("frames", {}), ("more", 1),
    ],
)  # fmt: skip
def test_a_run_with_another_type_is_refused(key: str, value: object, run: Path) -> None:
    table = json.loads((run / "run.json").read_text())
    (run / "run.json").write_text(json.dumps(table | {key: value}))
    with pytest.raises(InputError, match=rf"run\.json: run(\.{key}|: got)"):
        store.load(run)
    assert store.finished(run) is None


def test_arrays_that_are_programs_or_bombs_are_refused(run: Path) -> None:
    place = run / "state" / "frame_0010.npz"

    class Program:
        def __reduce__(self) -> Any:
            return (pytest.fail, ("it was executed",))

    np.savez(place, displacement=np.array([Program()], object), pressure=0, before=0, rate=0)
    with pytest.raises(InputError, match=r"frame_0010\.npz: got .*Object arrays cannot be loaded"):
        states.read_arrays(place)
    with (
        zipfile.ZipFile(place, "w", zipfile.ZIP_DEFLATED) as file,
        file.open("rate.npy", "w", force_zip64=True) as member,
    ):
        for _ in range(1100):
            member.write(bytes(2**20))
    assert place.stat().st_size < 2 * 2**20
    with pytest.raises(InputError, match=r"frame_0010\.npz: got .*1100 MB of arrays"):
        states.read_arrays(place)


# The exit status


@pytest.mark.parametrize(
    "error", [ZeroDivisionError("by zero"), RecursionError("deep"), AssertionError("\n two lines"), MemoryError()]
)
def test_a_mistake_of_ours_is_no_verdict(
    error: Exception, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def fails(*_: object) -> None:
        raise error

    monkeypatch.setattr(casefile, "cases", fails)
    assert cli.main(["list"]) == cli.BROKEN == 70
    said = capsys.readouterr().err
    assert said.count("\n") == 1
    assert "judged" in said if isinstance(error, MemoryError) else "no verdict" in said and "Please report it" in said
