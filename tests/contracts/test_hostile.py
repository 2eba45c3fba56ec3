"""What bad input is refused for, and how: before memory is taken, by a sentence that names the place, and never as a verdict."""

import importlib.util
import json
import os
import re
import zipfile
from pathlib import Path
from typing import Any

import hostile
import hostile_runs
import numpy as np
import pytest

from fem_reference import cli
from fem_reference.assessment import baseline
from fem_reference.foundations.errors import InputError
from fem_reference.foundations.mesh import Surface, check_finite
from fem_reference.foundations.records import FileName, Name, Record, parse
from fem_reference.foundations.units import positive, quantity
from fem_reference.io import files
from fem_reference.problems import muscle
from fem_reference.runs import states, store
from fem_reference.scenes import casefile
from fem_reference.scenes.case import ALLOWED_SETTING, HOME
from fem_reference.scenes.made import make_case
from fem_reference.solvers import fenicsx, recorded

SCENE = (HOME / "cases" / "box_squeeze" / "case.toml").read_text(encoding="utf-8")
BALL = hostile_runs.BALL


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
        baseline.read(tmp_path / "ball.json", hostile_runs.BALL_SCENE, "mine")
    with pytest.raises(InputError, match=r"run\.json: got .*want the run\.json of a stored run"):
        store.load(tmp_path)
    assert store.status(tmp_path) == "damaged"


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
    if importlib.util.find_spec("dolfinx") is None:
        pytest.skip("no FEniCSx here, which is asked for first")
    with pytest.raises(InputError, match=r"ranks: got 1000, want at most \d+ on this machine"):
        fenicsx.require(parse(fenicsx.Settings, {"ranks": 1000}, "reference"))


class Called(Record):
    """Something with a name, and a file's."""

    name: Name = "a"
    file: FileName = "a"


@pytest.mark.parametrize("file", ["", ".", "..", ".a", "a/b", "a b", "a\\b", "a\n", "é" * 101, "a:b"])
def test_what_is_no_name_of_a_file_is_refused(file: str) -> None:
    with pytest.raises(
        InputError, match=r"file: got .*want a name of 1 to 100 letters, digits and \. _ -, without a dot at its start"
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


@pytest.mark.slow
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
    assert (
        "judged" in said if isinstance(error, MemoryError) else "not a verdict" in said and "Please report it" in said
    )
