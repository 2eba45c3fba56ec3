"""A sequence that somebody else computed: found in every form it may have, refused unless it is of this surface."""

import json
from pathlib import Path

import meshio
import numpy as np
import pytest
import shapes
import small

import fem_reference as fr
from fem_reference.foundations.errors import InputError
from fem_reference.foundations.mesh import Floats, Surface
from fem_reference.foundations.records import parse
from fem_reference.io import files
from fem_reference.problems.problem import AtRest
from fem_reference.problems.setup import Setup
from fem_reference.runs.store import Frame
from fem_reference.runs.writer import Writer
from fem_reference.solvers import recorded

REST = shapes.sphere(1, 30.0)
FRAMES = (0, 10, 20)


def moved(number: int) -> Floats:
    """Growing by 1 % a frame, the centre wandering."""
    return REST.points * (1 + number / 100) + [number, 0, 0]


def read(
    folder: Path, frames: tuple[int, ...] = FRAMES, interval: float | None = None, rest: Surface = REST
) -> list[Frame]:
    taken: list[Frame] = []
    settings = recorded.RecordedSettings(folder=str(folder), unit="mm")
    outcome = recorded.solve(Setup(rest, (), (), frames, interval), settings, taken.append)
    assert outcome.status == "converged"
    assert outcome.message.startswith(f"read {len(frames)} frames from {folder}")
    assert outcome.cost == {}
    return taken


def check(taken: list[Frame], within: float = 0.0) -> None:
    assert [frame.number for frame in taken] == list(FRAMES)
    for frame in taken:
        assert abs(frame.surface - moved(frame.number)).max() <= within


def save(path: Path, points: Floats, triangles: np.ndarray = REST.triangles, **settings: object) -> Path:
    meshio.Mesh(points, [("triangle", np.asarray(triangles, np.int32))]).write(path, **settings)
    return path


def sequence(folder: Path, suffix: str = "ply", numbers: tuple[int, ...] = FRAMES, **settings: object) -> Path:
    for number in numbers:
        save(folder / f"run2_{number:03d}.{suffix}", moved(number), **settings)
    return folder


# STL holds float32: half a unit in the last place of 64 mm is 4e-6 mm.
@pytest.mark.parametrize(
    ("suffix", "within"), [("ply", 0.0), ("obj", 0.0), ("off", 0.0), ("vtk", 0.0), ("vtu", 0.0), ("stl", 4e-6)]
)
def test_a_folder_of_meshes(tmp_path: Path, suffix: str, within: float) -> None:
    sequence(tmp_path, suffix, (*FRAMES, 5), **({"binary": True} if suffix == "stl" else {}))
    for other in ("notes_0010.csv", "frame_0010.json", "._run2_010.ply", "rest.ply", "fixed_0010.txt"):
        (tmp_path / other).write_text("not a frame")
    check(read(tmp_path), within)


def test_the_unit_is_applied(tmp_path: Path) -> None:
    save(tmp_path / "0.ply", moved(0) / 1000)
    taken: list[Frame] = []
    settings = parse(recorded.RecordedSettings, {"folder": str(tmp_path), "unit": "m"}, "case.toml")
    recorded.solve(Setup(REST, (), (), (0,), None), settings, taken.append)
    assert np.allclose(taken[0].surface, moved(0), rtol=0, atol=1e-14 * 60)  # two roundings at 30 mm


@pytest.mark.parametrize("leads_to", ["frames.pvd", "."])
@pytest.mark.parametrize("interval", [None, 0.02])
def test_an_index(tmp_path: Path, leads_to: str, interval: float | None) -> None:
    """Its times are frame numbers, or times in steps of the interval; entries between the frames are passed over."""
    (tmp_path / "below").mkdir()
    sequence(tmp_path / "below")
    entries = [(0, "run2_000"), (10, "run2_010"), (20, "run2_020"), (12.5, "nowhere"), (float("nan"), "nowhere")]
    times = [(number * (interval or 1), name) for number, name in entries]
    files.write_pvd(tmp_path / "frames.pvd", [(time, f"below/{name}.ply") for time, name in times])
    check(read(tmp_path / leads_to, interval=interval))


@pytest.mark.parametrize("leads_to", ["run.xdmf", "."])
@pytest.mark.parametrize("data_format", ["XML", "HDF"])
def test_a_time_series(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, leads_to: str, data_format: str) -> None:
    (tmp_path / "elsewhere").mkdir()
    monkeypatch.chdir(tmp_path)  # meshio puts its .h5 into the current directory
    with meshio.xdmf.TimeSeriesWriter(tmp_path / "run.xdmf", data_format=data_format) as series:
        series.write_points_cells(REST.points, [("triangle", REST.triangles)])
        for number in FRAMES:
            series.write_data(number * 0.1, point_data={"displacement": moved(number) - REST.points})
    monkeypatch.chdir(tmp_path / "elsewhere")
    check(read(tmp_path / leads_to, interval=0.1), within=3e-14)  # the sum is rounded twice, at 60 mm


def test_a_stored_run(tmp_path: Path) -> None:
    identity = {"name": "pbd", "solver": "pbd", "origin": {}, "frames": FRAMES}
    writer = Writer(tmp_path / "run", identity, AtRest(REST))
    for number in FRAMES:
        writer.add(Frame(number, moved(number)))
    assert json.loads((tmp_path / "run" / "run.json").read_text())["numbers"] == list(FRAMES)
    check(read(tmp_path / "run"))


def test_orientation_and_first_corner_are_free(tmp_path: Path) -> None:
    """check_closed turns a surface outward, and writers begin a triangle where they like."""
    for number, triangles in zip(
        FRAMES, (REST.triangles, REST.triangles[:, ::-1], np.roll(REST.triangles, 1, axis=1)), strict=True
    ):
        save(tmp_path / f"{number}.ply", moved(number), triangles)
    check(read(tmp_path))


def test_the_order_of_the_triangles_is_free(tmp_path: Path) -> None:
    """Only the vertices must be in their order; here the triangles are mixed anew in each frame, and once turned over."""
    for number in FRAMES:
        triangles = np.roll(np.random.default_rng(number).permutation(REST.triangles), 1, axis=1)
        save(tmp_path / f"{number}.ply", moved(number), triangles[:, ::-1] if number == 10 else triangles)
    check(read(tmp_path))


def test_an_inward_stl(tmp_path: Path) -> None:
    for number in FRAMES:
        save(tmp_path / f"{number}.stl", moved(number), REST.triangles[:, ::-1], binary=True)
    check(read(tmp_path), within=4e-6)


# What is wrong with frame 20, and what is said about it.
def _lost_vertex() -> tuple[Floats, np.ndarray]:
    return np.vstack([moved(20), [[0, 0, 0]]]), REST.triangles


def _lost_triangle() -> tuple[Floats, np.ndarray]:
    return moved(20), REST.triangles[1:]


def _other_vertices() -> tuple[Floats, np.ndarray]:
    """The numbers of two vertices exchanged: their five triangles each, two of which they share."""
    a, b = REST.triangles[0, :2]
    number = np.arange(42)
    number[[a, b]] = b, a
    return moved(20), np.roll(number[REST.triangles], 1, axis=0)


def _repeated_triangle() -> tuple[Floats, np.ndarray]:
    """One of them twice, and another one missing."""
    triangles = REST.triangles.copy()
    triangles[3] = np.roll(triangles[5], 1)
    return moved(20), triangles


def _two_flipped() -> tuple[Floats, np.ndarray]:
    triangles = REST.triangles.copy()
    triangles[[7, 9]] = triangles[[7, 9]][:, ::-1]
    return moved(20), triangles


def _not_a_number() -> tuple[Floats, np.ndarray]:
    points = moved(20)
    points[5, 1] = np.nan
    return points, REST.triangles


@pytest.mark.parametrize("suffix", ["ply", "vtu"])
@pytest.mark.parametrize(
    ("damage", "got"),
    [
        (_lost_vertex, "43 vertices instead of 42"),
        (_lost_triangle, "79 triangles instead of 80"),
        (_other_vertices, r"\d+ triangles with other vertices, the first of which is triangle \d+"),
        (_repeated_triangle, "2 triangles with other vertices, the first of which is triangle 3"),
        (_two_flipped, "2 triangles with other vertices, the first of which is triangle 7"),
        (_not_a_number, r"a point that is not finite \(vertex 5\)"),
    ],
    ids=lambda value: getattr(value, "__name__", ""),
)
def test_a_frame_of_another_surface_is_refused_before_any_is_taken(
    tmp_path: Path, suffix: str, damage, got: str
) -> None:
    sequence(tmp_path, suffix)
    save(tmp_path / f"run2_020.{suffix}", *damage())
    refuse(tmp_path, rf"run2_020\.{suffix}: got {got}, want")


def refuse(folder: Path, match: str, rest: Surface = REST) -> None:
    """InputError with this message, and no frame sunk before it."""
    taken: list[Frame] = []
    settings = recorded.RecordedSettings(folder=str(folder), unit="mm")
    with pytest.raises(InputError, match=match):
        recorded.solve(Setup(rest, (), (), FRAMES, None), settings, taken.append)
    assert taken == []


def test_a_cut_frame_is_refused(tmp_path: Path) -> None:
    path = sequence(tmp_path) / "run2_010.ply"
    path.write_bytes(path.read_bytes()[:-5])
    refuse(tmp_path, r"run2_010\.ply: got .*, want a complete triangle surface")


def test_stl_triangles_in_another_order_do_not_fit(tmp_path: Path) -> None:
    sequence(tmp_path, "stl", binary=True)
    save(tmp_path / "run2_020.stl", moved(20), np.roll(REST.triangles, 1, axis=0), binary=True)
    refuse(
        tmp_path,
        r"run2_020\.stl: got corners of vertex \d+ that are .* mm apart, want the triangles of sphere in their order",
    )


def test_stl_corners_part_by_more_than_rounding(tmp_path: Path) -> None:
    """2e-4 mm is above the limit of 1e-4 mm, 0.5e-4 mm below it."""
    corners = moved(20)[REST.triangles].reshape(-1, 3)
    for gap, refused in ((0.5e-4, False), (2e-4, True)):
        corners[0, 0] = moved(20)[REST.triangles[0, 0], 0] + gap
        sequence(tmp_path, "stl", binary=False)
        save(tmp_path / "run2_020.stl", corners, np.arange(len(corners)).reshape(-1, 3), binary=False)
        if refused:
            refuse(tmp_path, rf"corners of vertex {REST.triangles[0, 0]} that are 0\.0002 mm apart")
        else:
            read(tmp_path)


def test_missing_frames_are_listed(tmp_path: Path) -> None:
    sequence(tmp_path, numbers=(0, 5, 15))
    refuse(tmp_path, r"got no frame 10, 20 \(there are 3: 0 to 15\), want every requested frame")


def test_a_folder_without_meshes(tmp_path: Path) -> None:
    refuse(tmp_path, r"got no frame 0, 10, 20 \(there are 0: none\)")


def test_times_that_are_not_frame_numbers(tmp_path: Path) -> None:
    """A series in seconds whose scene states no interval has frame 0 alone."""
    sequence(tmp_path)
    files.write_pvd(tmp_path / "run.pvd", [(number / 100, f"run2_{number:03d}.ply") for number in FRAMES])
    refuse(tmp_path, r"run\.pvd: got no frame 10, 20")


@pytest.mark.parametrize("other", ["run2_10.ply", "run2_010.obj"])
def test_two_files_of_one_number(tmp_path: Path, other: str) -> None:
    save(sequence(tmp_path) / other, moved(10))
    refuse(tmp_path, "got frame 10 in run2_0?10.* and run2_0?10.*, want every frame once")


def test_two_entries_of_one_time(tmp_path: Path) -> None:
    files.write_pvd(tmp_path / "run.pvd", [(0, "a.ply"), (0, "b.ply")])
    refuse(tmp_path, r"run\.pvd: got frame 0 in a\.ply and b\.ply")


def test_two_indices(tmp_path: Path) -> None:
    (tmp_path / "a.pvd").write_text("")
    (tmp_path / "b.xdmf").write_text("")
    refuse(tmp_path, r"got the sequences a\.pvd and b\.xdmf, want one of them")


@pytest.mark.parametrize("name", ["absent", "absent.pvd", "mesh_0.ply"])
def test_no_sequence(tmp_path: Path, name: str) -> None:
    save(tmp_path / "mesh_0.ply", moved(0))
    refuse(tmp_path / name, rf"{name}: got another kind of file, or nothing, want a folder, or a \.pvd or \.xdmf file")


def test_an_index_of_a_file_that_is_not_there(tmp_path: Path) -> None:
    files.write_pvd(tmp_path / "run.pvd", [(number, f"gone_{number}.ply") for number in FRAMES])
    refuse(tmp_path, r"gone_0\.ply: got no file")


@pytest.mark.parametrize(
    ("first", "away"),
    # A sphere of 30 mm times k is 30 |k - 1| mm from itself; moved by (6, 0, 0) mm it is 6 mm away.
    # Its box has a diagonal below 60 sqrt(3) = 104 mm (its vertices do not reach out on all axes), 5 % are 5.1 mm.
    [(REST.points / 1000, "30"), (REST.points * 10, "270"), (REST.points + np.array([6.0, 0, 0]), "6")],
)
def test_a_first_frame_that_is_not_at_rest(tmp_path: Path, first: Floats, away: str) -> None:
    save(sequence(tmp_path) / "run2_000.ply", first)
    refuse(
        tmp_path,
        rf"run2_000\.ply: got a first frame \(0\) that is {away} mm \(rms\) from the rest surface sphere, .*unit",
    )


@pytest.mark.parametrize(("shift", "warnings"), [(0.05, 0), (0.2, 1), (1.0, 1), (4.9, 1)])
def test_a_sequence_that_is_shifted_as_a_whole_is_taken(
    tmp_path: Path, caplog: pytest.LogCaptureFixture, shift: float, warnings: int
) -> None:
    """Up to 5 % of the diagonal it is the candidate's error, which is to be measured; said above rounding."""
    for number in FRAMES:
        save(tmp_path / f"{number}.ply", moved(number) + np.array([0, 0, shift]))
    for frame in read(tmp_path):
        assert np.allclose(frame.surface - moved(frame.number), [0, 0, shift], rtol=0, atol=1e-13)
    printed = f"{tmp_path / '0.ply'}: a first frame (0) that is {shift:.3g} mm (rms) from the rest surface sphere"
    assert [message.split(",")[0] for message in caplog.messages] == [printed] * warnings


def test_another_numbering_of_the_vertices_shows_at_rest(tmp_path: Path) -> None:
    """The same body with the same triangles as numbers, but its vertices on other places."""
    save(sequence(tmp_path) / "run2_000.ply", np.roll(REST.points, 1, axis=0))
    refuse(tmp_path, r"run2_000\.ply: got a first frame \(0\)")


def test_what_the_reports_program_computed(data: Path) -> None:
    """31 frames of gluteus maximus; the first is the rest mesh to the bit, the last has moved (its README)."""
    rest = files.read_surface(data / "hip/muscles/gluteus_maximus.vtk", 1.0)
    taken = read(data / "candidates/report_pbd_gluteus_maximus", tuple(range(0, 301, 10)), rest=rest)
    assert np.array_equal(taken[0].surface, rest.points)
    assert np.linalg.norm(taken[10].surface - rest.points, axis=1).max() > 10


def said(folder: Path, text: str) -> Path:
    (folder / "candidate.toml").write_text(text)
    return folder


def test_what_a_candidate_says_of_itself(tmp_path: Path) -> None:
    sequence(said(tmp_path, 'name = "mine.2"\nversion = "2.1"\nunit = "cm"\nseconds_per_frame = 0.5\nthreads = 4\n'))
    settings = recorded.RecordedSettings(folder=str(tmp_path), unit="cm")
    rest = REST.moved_to(10 * REST.points)
    taken: list[Frame] = []
    outcome = recorded.solve(Setup(rest, (), (), FRAMES, None), settings, taken.append)
    assert outcome.cost == {"seconds_per_frame": 0.5, "threads": 4}
    assert np.allclose(taken[2].surface, 10 * moved(20), rtol=1e-15, atol=0)
    assert recorded.about(tmp_path).name == "mine.2"
    assert recorded.origin(settings) == {"candidate": {"name": "mine.2", "version": "2.1"}}


def test_what_a_candidate_says_stands_beside_an_index_too(tmp_path: Path) -> None:
    files.write_pvd(tmp_path / "frames.pvd", [])
    assert recorded.about(said(tmp_path, "threads = 2") / "frames.pvd").threads == 2


def test_a_candidate_may_say_nothing(tmp_path: Path) -> None:
    assert recorded.about(tmp_path) == recorded.about(said(tmp_path, "")) == recorded.About()
    assert recorded.origin(recorded.RecordedSettings(folder=str(tmp_path), unit="mm")) == {}
    check(read(sequence(said(tmp_path, 'unit = "mm"'))))


@pytest.mark.parametrize(
    ("text", "match"),
    [
        (
            'nme = "x"',
            r"candidate\.toml: nme: got an unknown key, want name, or another one of case, group, left_out, name",
        ),
        ('name = "my solver"', r'candidate\.toml: name: got "my solver", want a name of 1 to 100 letters'),
        ('name = ""', r"candidate\.toml: name: got"),
        ("version = 2", r"candidate\.toml: version: got 2, want a valid string"),
        ('unit = "furlong per day"', r'candidate\.toml: unit: got "furlong per day", want a unit of length'),
        ('unit = "s"', r'candidate\.toml: unit: got "s", want a unit of length'),
        ("seconds_per_frame = 0", r"candidate\.toml: seconds_per_frame: got 0, want greater than 0"),
        ('seconds_per_frame = "0.1"', r'candidate\.toml: seconds_per_frame: got "0\.1", want a valid number'),
        ("threads = -1", r"candidate\.toml: threads: got -1, want greater than 0"),
        ("name = mine", r"candidate\.toml: got .*, want a TOML file"),
        ('unit = "m"', r'candidate\.toml: unit: got "m", want the unit of --unit or of the case, 1 mm'),
    ],
)
def test_what_a_candidate_says_wrongly(tmp_path: Path, text: str, match: str) -> None:
    refuse(sequence(said(tmp_path, text)), match)


def test_frames_that_python_reads_are_in_the_unit_that_is_said(tmp_path: Path) -> None:
    case = fr.load_case(small.write(tmp_path / "bar"), {"frames.last": 5})
    rest = small.body()
    (tmp_path / "frames").mkdir()
    for number, away in ((0, 0.0), (5, 3.0)):
        files.write_surface(tmp_path / "frames" / f"frame_{number}.ply", rest, (rest.points + [0, 0, away]) / 25.4)
    run = fr.read_run(tmp_path / "frames", case, unit="in")
    assert run.positions[1] == pytest.approx(rest.points + [0, 0, 3.0], abs=1e-4)  # mm
    with pytest.raises(fr.InputError, match=r"frame_0\.ply"):
        fr.read_run(tmp_path / "frames", case)
