"""What goes out comes back the same, and a file that is not whole is never read nor left behind."""

from pathlib import Path

import meshio
import numpy as np
import pytest
import shapes

from fem_reference.foundations.errors import InputError
from fem_reference.foundations.mesh import Polylines
from fem_reference.io import files

BALL = shapes.sphere(2, 30.0)
MOVED = BALL.points + np.random.default_rng(1).normal(size=BALL.points.shape)


def test_a_surface_comes_back_bit_by_bit_with_its_displacement(tmp_path: Path) -> None:
    path = tmp_path / "moved.vtp"
    files.write_surface(path, BALL, MOVED)
    back = files.read_surface(path, 1.0)
    assert np.array_equal(back.points, MOVED)
    assert np.array_equal(back.triangles, BALL.triangles)
    assert np.array_equal(displacement(path), MOVED - BALL.points)


def displacement(path: Path) -> np.ndarray:
    import pyvista

    values = np.asarray(pyvista.read(path).point_data["displacement"])
    assert values.dtype == np.float64
    return values


def test_polylines_come_back_bit_by_bit(tmp_path: Path) -> None:
    """Lines of different lengths, two of which touch in space without being one."""
    lines = Polylines(np.vstack([MOVED[:7], MOVED[6:12]]), np.array([0, 2, 7, 13]))
    path = tmp_path / "lines.vtp"
    files.write_polylines(path, lines, lines.points / 3)
    back = files.read_polylines(path, 1.0)
    assert np.array_equal(back.points, lines.points / 3)
    assert np.array_equal(back.offsets, lines.offsets)
    assert np.array_equal(displacement(path), lines.points / 3 - lines.points)


def test_tets_are_read_by_others(tmp_path: Path) -> None:
    body = shapes.box((2, 2, 2), (1.0, 2.0, 3.0))
    path = tmp_path / "body.vtu"
    files.write_tets(path, body, body.points * 1.1)
    back = meshio.read(path)
    assert np.array_equal(back.points, body.points * 1.1)
    assert np.array_equal(back.cells_dict["tetra"], body.tets)
    assert np.array_equal(back.point_data["displacement"], body.points * 1.1 - body.points)


def segments(*cells: list[int]) -> str:
    points = "".join(f"{i} 0 0\n" for i in range(9))
    rows = "".join(f"{len(cell)} {' '.join(map(str, cell))}\n" for cell in cells)
    size = sum(len(cell) + 1 for cell in cells)
    head = "# vtk DataFile Version 3.0\n\nASCII\nDATASET POLYDATA\nPOINTS 9 double\n"
    return f"{head}{points}LINES {len(cells)} {size}\n{rows}" if cells else head + points


@pytest.mark.parametrize(
    ("cells", "want"),
    [
        (([0, 1], [1, 2], [3, 4], [4, 5, 6]), [[0, 1, 2], [3, 4, 5, 6]]),
        (([4, 5], [1, 2], [3, 4], [0, 1]), [[3, 4, 5], [0, 1, 2]]),  # in any order
        (([0, 1], [1, 2], [1, 3]), [[0, 1], [1, 2], [1, 3]]),  # where it branches, lines end
        (([2, 1, 0], [3, 4]), [[2, 1, 0], [3, 4]]),  # in the file's direction along the line
    ],
)
def test_segments_become_lines(tmp_path: Path, cells: tuple[list[int], ...], want: list[list[int]]) -> None:
    path = tmp_path / "segments.vtk"
    path.write_text(segments(*cells))
    lines = files.read_polylines(path, 10.0)
    numbers = [
        (lines.points[start:stop, 0] / 10).tolist()
        for start, stop in zip(lines.offsets, lines.offsets[1:], strict=False)
    ]
    assert numbers == want


@pytest.mark.parametrize(
    ("name", "text", "got"),
    [
        ("ring.vtk", segments([0, 1], [1, 2], [2, 0]), "lines that form a closed ring"),
        ("none.vtk", segments(), "no lines"),
        ("cut.vtk", segments([0, 1], [1, 2])[:-6], "3 numbers instead of 6"),
        ("beyond.vtk", segments([0, 1], [1, 9]), "cell 1 with a point outside 0 to 8"),
        ("below.vtk", segments([0, 1], [-1, 2]), "cell 1 with a point outside 0 to 8"),
        ("point.vtk", segments([0, 1], [3]), "line 1 of fewer than two points"),
        ("nan.vtk", segments([0, 1]).replace("5 0 0", "5 nan 0"), r"a point that is not finite \(point 5\)"),
        ("inf.vtk", segments([0, 1]).replace("1 0 0", "1 0 inf"), r"a point that is not finite \(point 1\)"),
        ("flat.vtk", segments([0, 1], [3, 4]).replace("4 0 0", "3 0 0"), "line 1 of zero length"),
        ("lines.obj", "l 1 2\n", 'the suffix ".obj"'),
    ],
)
def test_lines_that_are_none_are_refused(tmp_path: Path, name: str, text: str, got: str) -> None:
    (tmp_path / name).write_text(text)
    with pytest.raises(InputError, match=f"{name}: got {got}.*want complete polylines as .vtk or .vtp"):
        files.read_polylines(tmp_path / name, 1.0)


def test_what_a_solver_made_of_lines_is_read(tmp_path: Path) -> None:
    """Stored frames in which a solver lost points, or drew a line into one; their cells must be whole all the same."""
    path = tmp_path / "moved.vtp"
    lines = Polylines(MOVED[:4], np.array([0, 2, 4]))
    moved = np.array([[np.nan] * 3, [np.inf] * 3, [1.0, 2, 3], [1.0, 2, 3]])
    files.write_polylines(path, lines, moved)
    assert np.array_equal(files.read_polylines(path, 1.0, moved=True).points, moved, equal_nan=True)
    with pytest.raises(InputError, match=r"moved\.vtp: got a point that is not finite \(point 0\)"):
        files.read_polylines(path, 1.0)
    (tmp_path / "cells.vtk").write_text(segments([0, 9]))
    with pytest.raises(InputError, match=r"cells\.vtk: got cell 0 with a point outside 0 to"):
        files.read_polylines(tmp_path / "cells.vtk", 1.0, moved=True)


def test_an_index_comes_back(tmp_path: Path) -> None:
    files.write_pvd(tmp_path / "run.pvd", [(0, "surface/frame_0.vtp"), (10, 'surface/"a" & <b>.vtp')])
    want = [(0.0, tmp_path / "surface/frame_0.vtp"), (10.0, tmp_path / 'surface/"a" & <b>.vtp')]
    assert files.read_pvd(tmp_path / "run.pvd") == want


@pytest.mark.parametrize(
    "text", ["", "<VTKFile><Collection>", '<VTKFile><DataSet timestep="one" file="a"/></VTKFile>', "<A><DataSet/></A>"]
)
def test_a_damaged_index_is_refused(tmp_path: Path, text: str) -> None:
    (tmp_path / "run.pvd").write_text(text)
    with pytest.raises(InputError, match=r"run\.pvd: got .*, want a PVD index"):
        files.read_pvd(tmp_path / "run.pvd")


def test_rows_of_a_table(tmp_path: Path) -> None:
    path = tmp_path / "table.csv"
    path.write_text('\ufeffname, x\n# a, comment\n\n  "hip, left" , 1.5\n7\n', encoding="utf-8")
    assert files.read_rows(path) == [["name", "x"], ["hip, left", "1.5"], ["7"]]


def test_a_table_that_is_no_text_is_refused(tmp_path: Path) -> None:
    (tmp_path / "table.csv").write_bytes(b"1,\xff\n")
    with pytest.raises(InputError, match="want a comma-separated table in UTF-8"):
        files.read_rows(tmp_path / "table.csv")


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="no device here that is full")
def test_a_device_that_takes_nothing_is_named() -> None:
    with pytest.raises(OSError, match="No space left on device: '/dev/full'"):
        files.write_text(Path("/dev/full"), "text")


def test_a_failed_write_leaves_what_was_there(tmp_path: Path) -> None:
    path = tmp_path / "note.txt"
    files.write_text(path, "before")
    with pytest.raises(UnicodeEncodeError):
        files.write_text(path, "half \ud800")
    with pytest.raises(ValueError, match="broadcast"):
        files.write_surface(tmp_path / "new.vtp", BALL, MOVED[:3])
    assert path.read_text() == "before"
    assert list(tmp_path.iterdir()) == [path]


def test_a_place_that_cannot_be_written_is_an_error(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(OSError, match="absent/moved"):
        files.write_surface(tmp_path / "absent" / "moved.vtp", BALL, MOVED)
    assert capfd.readouterr() == ("", "")


def test_the_reports_fibres_are_five_lines_of_six_points(data: Path) -> None:
    lines = files.read_polylines(data / "hip/muscles/gluteus_maximus_fibres.vtk", 1.0)
    assert lines.offsets.tolist() == [0, 6, 12, 18, 24, 30]
