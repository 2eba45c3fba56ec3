"""A surface is read as its file has it, and a file that is not whole, or no triangle surface, is refused."""

import re
import subprocess
import sys
from pathlib import Path

import meshio
import numpy as np
import pytest
import shapes

from fem_reference.foundations.errors import InputError
from fem_reference.foundations.mesh import Polylines, Surface, enclosed_volume
from fem_reference.io import files
from fem_reference.io import formats as io_formats
from fem_reference.io.formats import formats, vtk

WRITTEN_BY_US = [suffix for suffix, one in formats().items() if one.write]
BALL = shapes.sphere(2, 30.0)  # 162 vertices that float32 cannot hold, 320 triangles
UNREADABLE = f"want a complete triangle surface as {' '.join(formats())}"

# Every format and kind of it, written by meshio, and how far its coordinates may be from ours [mm]: nothing where it
# holds float64 or all its digits, and half a unit in the last place of float32 at 30 mm (1e-6) for binary STL.
WRITTEN = {
    "binary.ply": ({}, 0.0),
    "text.ply": ({"binary": False}, 0.0),
    "text.obj": ({}, 0.0),
    "text.off": ({}, 0.0),
    "binary.stl": ({"binary": True}, 1e-6),
    "text.stl": ({"binary": False}, 0.0),
    "binary.vtk": ({}, 0.0),
    "text.vtk": ({"binary": False}, 0.0),
    "binary.vtu": ({}, 0.0),
    "binary.msh": ({"file_format": "gmsh"}, 0.0),
    "old.msh": ({"file_format": "gmsh22"}, 0.0),
}


@pytest.fixture(scope="module")
def written(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with the ball in every format, polydata among them."""
    folder = tmp_path_factory.mktemp("written")
    mesh = meshio.Mesh(BALL.points, [("triangle", BALL.triangles)])
    for name, (settings, _) in WRITTEN.items():
        mesh.write(folder / name, **settings)
    files.write_surface(folder / "polydata.vtp", BALL, BALL.points)
    (folder / "polydata.vtk").write_text(polydata(BALL))
    return folder


def polydata(surface: Surface, kind: str = "POLYGONS") -> str:
    points = "\n".join(" ".join(map(repr, point)) for point in surface.points.tolist())
    rows = "\n".join(f"{len(row)} {' '.join(map(str, row))}" for row in surface.triangles.tolist())
    m, corners = surface.triangles.shape
    head = f"# vtk DataFile Version 3.0\nball\nASCII\nDATASET POLYDATA\nPOINTS {len(surface.points)} double\n"
    return f"{head}{points}\n{kind} {m} {m * (corners + 1)}\n{rows}\n"


@pytest.mark.parametrize("suffix", WRITTEN_BY_US)
def test_a_surface_comes_back_as_it_was_written(suffix: str, tmp_path: Path) -> None:
    """The contract of formats, met by every file of io/formats: points to the bit, in their order where triangles share them."""
    path, moved = tmp_path / f"ball{suffix}", BALL.points + 1 / 3
    files.write_surface(path, BALL, moved)
    assert [one.name for one in tmp_path.iterdir()] == [path.name]
    back = files.read_surface(path, 10.0)
    assert np.array_equal(back.points[back.triangles], 10.0 * moved[BALL.triangles])
    assert files.shares_points(back.place) == np.array_equal(back.triangles, BALL.triangles)


# Where a file does not state its size, only a cut before its triangles shows anyhow.
CUTS = [
    (suffix, share)
    for suffix in formats()
    for share in (0.0, 0.01, 0.2, 0.4, 0.7, 0.97)
    if formats()[suffix].states_size or share < 0.5
]


@pytest.mark.parametrize(("suffix", "share"), CUTS)
def test_what_was_written_and_cut_off_is_refused(
    suffix: str, share: float, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    """The contract of formats: nobody takes half a file for a whole one, and nobody prints."""
    path = tmp_path / f"ball{suffix}"
    write = files.write_surface if suffix in WRITTEN_BY_US else shapes.write
    write(path, BALL, BALL.points)
    whole = path.read_bytes()
    path.write_bytes(whole[: int(share * len(whole))])
    with pytest.raises(InputError, match=rf"^{re.escape(str(path))}: got \S.*, {UNREADABLE}"):
        files.read_surface(path, 1.0)
    assert capfd.readouterr() == ("", "")


@pytest.mark.parametrize("suffix", vtk.LINES)
def test_lines_come_back_as_they_were_written(suffix: str, tmp_path: Path) -> None:
    lines, path = Polylines(BALL.points[:13], np.array([0, 2, 7, 13])), tmp_path / f"lines{suffix}"
    files.write_polylines(path, lines, lines.points / 3)
    back = files.read_polylines(path, 1.0)
    assert np.array_equal(back.points, lines.points / 3)
    assert np.array_equal(back.offsets, lines.offsets)


@pytest.mark.parametrize(
    ("text", "problem"),
    [
        ("", "unfinished: FORMAT is None, want a Format"),
        ("from fem_reference.io.formats.off import FORMAT", r"\.off, which"),
    ],
)
def test_a_file_that_is_no_format_is_named(text: str, problem: str, tmp_path: Path, monkeypatch) -> None:
    (tmp_path / "unfinished.py").write_text(text)
    monkeypatch.setattr(io_formats, "__path__", [*io_formats.__path__, str(tmp_path)])
    monkeypatch.setitem(sys.modules, "fem_reference.io.formats.unfinished", None)  # so that it is gone afterwards
    del sys.modules["fem_reference.io.formats.unfinished"]
    with pytest.raises(TypeError, match=problem):
        formats.__wrapped__()


@pytest.mark.parametrize("name", [*WRITTEN, "polydata.vtp", "polydata.vtk"])
def test_every_format_keeps_points_and_triangles(written: Path, name: str, capfd: pytest.CaptureFixture[str]) -> None:
    surface = files.read_surface(written / name, 1.0)
    if name.endswith(".stl"):  # three points a triangle, in the order of the triangles
        want, triangles = BALL.points[BALL.triangles].reshape(-1, 3), np.arange(3 * len(BALL.triangles)).reshape(-1, 3)
    else:
        want, triangles = BALL.points, BALL.triangles
    assert np.array_equal(surface.triangles, triangles)
    assert abs(surface.points - want).max() <= WRITTEN.get(name, ({}, 0.0))[1]
    assert surface.place == str(written / name)
    assert capfd.readouterr() == ("", "")


def test_the_unit_of_a_file_is_applied_in_float64(tmp_path: Path) -> None:
    # 0.1 in float32 is 0.100000001490116...; times 1000 this is 100.0000015 in float64, 100 or a neighbour in float32.
    path = tmp_path / "metres.ply"
    points = np.array([[0.1, 0, 0], [0, 0.1, 0], [0, 0, 0.1]], np.float32)
    meshio.Mesh(points, [("triangle", np.array([[0, 1, 2]]))]).write(path)
    assert files.read_surface(path, 1000.0).points[0, 0] == float(np.float32(0.1)) * 1000


@pytest.mark.parametrize("share", [0.0, 0.005, 0.02, 0.2, 0.4, 0.6, 0.8, 0.97])
@pytest.mark.parametrize(
    "name", [*(name for name in WRITTEN if not name.endswith(".obj")), "polydata.vtp", "polydata.vtk"]
)
def test_a_file_cut_off_anywhere_is_refused(
    written: Path, tmp_path: Path, capfd: pytest.CaptureFixture[str], name: str, share: float
) -> None:
    """In its header, its vertices and its faces; the message names it, and nobody prints."""
    whole = (written / name).read_bytes()
    path = tmp_path / name
    path.write_bytes(whole[: int(share * len(whole))])
    with pytest.raises(InputError, match=rf"^{re.escape(str(path))}: got \S.*, {UNREADABLE}"):
        files.read_surface(path, 1.0)
    assert capfd.readouterr() == ("", "")


def test_a_cut_obj_is_refused_where_the_cut_shows(written: Path, tmp_path: Path) -> None:
    # OBJ states no counts: a cut between two lines of faces cannot be distinguished from a smaller file.
    path, text = tmp_path / "cut.obj", (written / "text.obj").read_text()
    faces = text.index("\nf ")
    for stop, got in (
        (0, "no triangles"),
        (text.index("v ") + 8, "a position with fewer than three coordinates"),
        (faces, "no triangles"),
        (faces + 4, "a polygon with 1 corners"),
        (text.rstrip().rindex(" "), "a polygon with 2 corners"),
    ):
        path.write_text(text[:stop])
        with pytest.raises(InputError, match=f"got {got}"):
            files.read_surface(path, 1.0)


def test_ply_in_all_its_variety(tmp_path: Path) -> None:
    """Big endian, extra properties before and behind, an element between, the other name of the corners."""
    header = """ply
format binary_big_endian 1.0
comment element of surprise 3
element vertex 4
property uchar red
property double x
property double y
property double z
element edge 1
property int vertex1
property int vertex2
element face 2
property uchar flags
property list uchar ushort vertex_index
property list uchar float texcoord
end_header
"""
    vertices = np.zeros(4, [("red", "u1"), ("x", ">f8"), ("y", ">f8"), ("z", ">f8")])
    vertices["x"], vertices["y"], vertices["z"] = np.array([[0, 0, 0], [1 / 3, 0, 0], [0, 1 / 7, 0], [0, 0, 3]]).T
    faces = np.zeros(2, [("flags", "u1"), ("n", "u1"), ("corners", ">u2", 3), ("k", "u1"), ("texture", ">f4", 6)])
    faces["n"], faces["corners"], faces["k"] = 3, [[0, 1, 2], [0, 2, 3]], 6
    path = tmp_path / "rich.ply"
    path.write_bytes(header.encode() + vertices.tobytes() + np.array([0, 1], ">i4").tobytes() + faces.tobytes())
    surface = files.read_surface(path, 3.0)
    assert surface.triangles.tolist() == [[0, 1, 2], [0, 2, 3]]
    assert surface.points.tolist() == [[0, 0, 0], [3 * (1 / 3), 0, 0], [0, 3 * (1 / 7), 0], [0, 0, 9]]


def test_obj_in_its_variety(tmp_path: Path) -> None:
    path = tmp_path / "rich.obj"
    path.write_text(
        "# a\no one\nv 0 0 0 1 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvn 0 0 1\nf 1/1/1 2/1/1 3/1/1\nv 0 0 1\nf -4 -2//1 -1\n"
    )
    assert files.read_surface(path, 1.0).triangles.tolist() == [[0, 1, 2], [0, 2, 3]]


def test_off_in_its_variety(tmp_path: Path) -> None:
    path = tmp_path / "rich.off"
    path.write_text(
        "COFF # colours\n3 1 0\n\n0 0 0 255 0 0 1\n1 0 0 255 0 0 1\n0 1 0 255 0 0 1 # last\n3 0 1 2 9 9 9\n"
    )
    assert files.read_surface(path, 1.0).triangles.tolist() == [[0, 1, 2]]


QUAD = Surface(np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]]), np.array([[0, 1, 2, 3]]))
PLY_TEXT = "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n"
CORNERS = "property list uchar int vertex_indices\nend_header\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n"
LIST_PLY = (
    "ply\nformat ascii 1.0\nelement vertex 3\nproperty list uchar float x\nproperty float y\nproperty float z\n"
    "element face 1\nproperty list uchar int vertex_indices\nend_header\n2 0 0 0 0\n2 1 1 0 0\n2 1 1 1 0\n3 0 1 2\n"
)


@pytest.mark.parametrize(
    ("name", "text", "got"),
    [
        ("quad.vtk", polydata(QUAD), "a polygon with 4 corners"),
        ("strip.vtk", polydata(QUAD, "TRIANGLE_STRIPS"), "PolyData with cells other than triangles"),
        (
            "grid.vtk",
            "# vtk DataFile Version 3.0\n\nASCII\nDATASET STRUCTURED_POINTS\nDIMENSIONS 2 2 2\n",
            "a VTK file of STRUCTURED_POINTS",
        ),
        ("quad.obj", "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1 2 3 4\n", "a polygon with 4 corners"),
        ("quad.off", "OFF 4 1 0\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n4 0 1 2 3\n", "a polygon with 4 corners"),
        ("quad.ply", f"{PLY_TEXT}element face 1\n{CORNERS}4 0 1 2 3\n", "a polygon with 4 corners"),
        ("mixed.ply", f"{PLY_TEXT}element face 2\n{CORNERS}3 0 1 2\n4 0 1 2 3\n", "polygons of different sizes"),
        ("none.ply", f"{PLY_TEXT}element face 0\n{CORNERS}", "no triangles"),
        ("cloud.ply", f"{PLY_TEXT}end_header\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n", "no vertices or no faces"),
        ("short.off", "OFF 3 1 0\n0 0 0\n1 0 0\n0 1\n3 0 1 2\n", "a position with fewer than three coordinates"),
        ("huge.obj", f"v 0 0 0\nv 1 0 0\nv 1 1 0\nf 1 2 {10**30}\n", "Python int too large"),
        ("huge.off", f"OFF 3 1 0\n0 0 0\n1 0 0\n1 1 0\n3 0 1 {10**30}\n", "Python int too large"),
        ("empty.obj", "f 1 2 3\n", "no vertices"),
        ("empty.off", "OFF 0 1 0\n3 0 1 2\n", "no vertices"),
        ("list.ply", LIST_PLY, r"points of shape \(3, 4\)"),
        (
            "half.ply",
            f"{PLY_TEXT}element face 1\n{CORNERS}3 0 1 1.5\n",
            r"corners of shape \(1, 3\) that are not three",
        ),
        ("nan.ply", f"{PLY_TEXT}element face 1\n{CORNERS}3 0 1 nan\n", r"corners of shape \(1, 3\) that are not three"),
        ("word.off", "a text\n", "no OFF header"),
        ("word.vtp", "a text\n", "syntax error"),
        ("word.step", "ISO-10303-21\n", 'the suffix ".step"'),
    ],
)
def test_what_is_not_a_triangle_surface_is_refused(tmp_path: Path, name: str, text: str, got: str) -> None:
    path = tmp_path / name
    path.write_text(text)
    with pytest.raises(InputError, match=f"{name}: got {got}.*{UNREADABLE}"):
        files.read_surface(path, 1.0)


@pytest.mark.parametrize(("name", "got"), [("body.vtu", "cells of VTK type 10"), ("body.msh", "cells of type tetra")])
def test_tetrahedra_are_no_surface(tmp_path: Path, name: str, got: str) -> None:
    body = shapes.box((1, 1, 1), (1.0, 1.0, 1.0))
    meshio.Mesh(body.points, [("tetra", body.tets)]).write(
        tmp_path / name, **({"file_format": "gmsh"} if "msh" in name else {})
    )
    with pytest.raises(InputError, match=got):
        files.read_surface(tmp_path / name, 1.0)


def test_a_file_that_is_not_there_is_named(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"absent\.ply: got no file"):
        files.read_surface(tmp_path / "absent.ply", 1.0)


def test_vtk_stays_silent_in_a_fresh_process(tmp_path: Path) -> None:
    """VTK's own log goes to the file descriptor of stderr, before Python could catch it."""
    (tmp_path / "cut.vtp").write_text("<VTKFile")
    code = (
        "import pathlib, sys; from fem_reference.io import files\nfrom fem_reference.foundations import errors\n"
        "try: files.read_surface(pathlib.Path(sys.argv[1]), 1.0)\n"
        "except errors.InputError: print('refused')"
    )
    ran = subprocess.run([sys.executable, "-c", code, tmp_path / "cut.vtp"], capture_output=True, text=True, check=True)
    assert (ran.stdout, ran.stderr) == ("refused\n", "")


@pytest.mark.parametrize(
    ("name", "triangles", "volume", "digits"),
    [
        ("hip/muscles/gluteus_maximus.vtk", 19752, 746562, 0),
        ("box/box.vtk", 5292, 800000, 0),
        ("hip/bones/femur_r.ply", 84998, None, 0),
    ],
)
def test_the_reports_meshes(data: Path, name: str, triangles: int, volume: float | None, digits: int) -> None:
    """Counts and volumes as their README states them, to the digits it gives."""
    surface = files.read_surface(data / name, 1.0)
    assert len(surface.triangles) == triangles
    if volume is not None:
        assert round(enclosed_volume(surface.points, surface.triangles), digits) == volume
