"""An export has everything in it, is there whole or not at all, and what comes back of it is judged."""

import csv
import json
import re
import subprocess
import sys
import tomllib
from dataclasses import replace
from pathlib import Path

import acting
import meshio
import numpy as np
import pytest
import small

from fem_reference import cli, export, report
from fem_reference.export import open_formats
from fem_reference.foundations.errors import InputError
from fem_reference.foundations.motion import apply
from fem_reference.foundations.records import parse
from fem_reference.io import files
from fem_reference.problems import muscle
from fem_reference.problems.body import ByCell
from fem_reference.problems.muscle import MuscleProblem
from fem_reference.runs.cost import seconds_per_frame
from fem_reference.runs.store import Outcome, Run
from fem_reference.scenes import casefile
from fem_reference.scenes.muscle import MuscleCase
from fem_reference.solvers import recorded
from fem_reference.studies.execution import Bench

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def scene(tmp_path_factory: pytest.TempPathFactory) -> MuscleCase:
    read = casefile.read(small.write(tmp_path_factory.mktemp("case") / "bar"))
    assert isinstance(read, MuscleCase)
    return read


@pytest.fixture(scope="module")
def built(scene: MuscleCase) -> MuscleProblem:
    """The small scene, with a direction of fibres in each tet, no two the same."""
    bar = muscle.build(scene, muscle.setup(scene))
    along = np.random.default_rng(6).normal(size=(len(bar.mesh.tets), 3))
    return replace(bar, fibre=ByCell(along / np.linalg.norm(along, axis=1)[:, None]))


@pytest.fixture(scope="module")
def exported(scene: MuscleCase, built: MuscleProblem, tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("export") / "bar"
    export.export(scene, lambda: built, folder, "open")
    return folder


def rows(path: Path) -> list[list[str]]:
    with path.open(newline="") as table:
        return list(csv.reader(table))[1:]


def test_surfaces_and_fibres_come_back_to_the_bit(exported: Path, built: MuscleProblem) -> None:
    surfaces = [built.surface, *(bone.surface for bone in built.bones)]
    for name, surface in zip(("muscle.ply", "bones/0.ply", "bones/1.ply"), surfaces, strict=True):
        for points, triangles in (
            (meshio.read(exported / name).points, meshio.read(exported / name).cells_dict["triangle"]),
            (files.read_surface(exported / name, 1.0).points, files.read_surface(exported / name, 1.0).triangles),
        ):
            assert np.array_equal(points, surface.points)
            assert np.array_equal(triangles, surface.triangles)
    fibres = files.read_polylines(exported / "fibres.vtk", 1.0)
    assert np.array_equal(fibres.points, built.fibres.points)
    assert np.array_equal(fibres.offsets, built.fibres.offsets)


@pytest.mark.parametrize("name", ["tets.vtu", "tets.msh"])
def test_tets_and_fibre_directions_come_back_to_the_bit(exported: Path, built: MuscleProblem, name: str) -> None:
    mesh = meshio.gmsh.read(exported / name) if name.endswith("msh") else meshio.read(exported / name)
    assert np.array_equal(mesh.points, built.mesh.points)
    assert np.array_equal(mesh.cells_dict["tetra"], built.mesh.tets)
    assert np.array_equal(mesh.cell_data["fibre"][0], built.directions)


def test_poses_of_every_bone_and_frame(exported: Path, built: MuscleProblem) -> None:
    found = {
        (bone, int(frame)): np.reshape(row, (4, 4)).astype(float) for bone, frame, *row in rows(exported / "poses.csv")
    }
    assert len(found) == len(built.bones) * len(built.frames)
    for bone in built.bones:
        for frame in built.frames:
            assert np.array_equal(found[bone.name, frame], bone.pose(frame))


def test_what_is_attached(exported: Path, built: MuscleProblem) -> None:
    for attached in built.attached:
        vertices = [
            int(row[2])
            for row in rows(exported / "attachments.csv")
            if row[:2] == [attached.attachment, attached.bone.name]
        ]
        assert np.array_equal(vertices, attached.vertices)
        facets = [
            row[2:]
            for row in rows(exported / "attachment_facets.csv")
            if row[:2] == [attached.attachment, attached.bone.name]
        ]
        assert np.array_equal(np.array(facets, int), built.mesh.facets[attached.attachment])


def test_the_surface_lies_where_its_shares_of_the_tets_say(exported: Path, built: MuscleProblem) -> None:
    """1e-9 mm is rounding at 40 mm in flat tets, whose shares are large."""
    table = np.array(rows(exported / "surface_in_tets.csv"), float)
    corners = built.mesh.points[built.mesh.tets[table[:, 1].astype(int)]]
    assert np.array_equal(table[:, 0], np.arange(len(built.surface.points)))
    assert np.allclose(np.einsum("vi,vik->vk", table[:, 2:], corners), built.surface.points, rtol=0, atol=1e-9)


def test_the_scene_says_units_and_values(exported: Path, built: MuscleProblem) -> None:
    facts = json.loads((exported / "scene.json").read_text())
    assert facts["frames"] == [0, 5, 10, 15, 20]
    assert [effect["name"] for effect in facts["effects"]] == ["neo_hooke", "incompressible"]
    assert facts["effects"][0]["parameters"] == {"mu": {"value": 0.01, "unit": "MPa"}}  # 10 kPa
    floor, lid = facts["bones"]
    assert (floor["name"], floor["file"], floor["obstacle"]) == ("floor", "bones/0.ply", False)
    assert "motion" not in floor
    assert lid["motion"]["keyframes"][1] == {"frame": 10.0, "angle": 0.4}
    assert facts["mesh"]["tets"] == len(built.mesh.tets)


def test_springs_are_stated_in_the_unit_that_they_have(scene: MuscleCase, built: MuscleProblem) -> None:
    soft = casefile.read_muscle(scene.folder, changes={"attachment[0].stiffness": "250 kPa/mm"})
    facts = open_formats.facts(soft, replace(built, attached=muscle.setup(soft).attached))
    assert facts["attachments"] == [
        {"name": "origin", "bone": "floor", "stiffness": 0.25, "unit": "MPa/mm"},
        {"name": "insertion", "bone": "lid", "stiffness": None, "unit": "MPa/mm"},
    ]


def test_bones_that_contact_names_are_obstacles(scene: MuscleCase, built: MuscleProblem) -> None:
    contact = parse(acting.effects.find("contact"), acting.PARAMETERS["contact"] | {"bones": ["lid"]}, "test")
    facts = open_formats.facts(scene, replace(built, effects=(*built.effects, contact)))
    assert [bone["obstacle"] for bone in facts["bones"]] == [False, True]


@pytest.mark.parametrize("name", sorted(acting.PARAMETERS))
def test_every_effect_can_be_stated(scene: MuscleCase, built: MuscleProblem, name: str) -> None:
    effect = parse(acting.effects.find(name), acting.PARAMETERS[name], "test")
    (printed,) = open_formats.facts(scene, replace(built, effects=(effect,)))["effects"]
    assert printed["name"] == name
    assert json.loads(json.dumps(printed, allow_nan=False))["parameters"].keys() == type(effect).model_fields.keys()


def code(text: str) -> str:
    """The only example in Python."""
    (block,) = re.findall(r"```python\n(.*?)```", text, re.DOTALL)
    return block


def test_the_reading_example_runs(exported: Path, built: MuscleProblem) -> None:
    """With numpy and meshio, from a process that cannot see this project; numpy prints 8 digits."""
    text = (exported / "README.md").read_text()
    words = [sys.executable, "-I", "-W", "error", "-c", code(text)]
    said = subprocess.run(words, cwd=exported, capture_output=True, text=True, check=True).stdout
    head, numbers = said.split(" at [")
    insertion = built.attached[1]
    assert head == f"At frame 10, lid has vertices {' '.join(map(str, insertion.vertices))}"
    moved = apply(insertion.bone.pose(10), built.surface.points[insertion.vertices])
    found = np.array(re.findall(r"-?\d+\.?\d*(?:e[+-]\d+)?", numbers), float).reshape(-1, 3)
    assert np.allclose(found, moved, rtol=0, atol=1e-6)


def test_every_file_is_explained(exported: Path) -> None:
    text = (exported / "README.md").read_text()
    names = {path.name for path in exported.iterdir()} - {"README.md", "bones"}
    assert {name for name in names if f"`{name}`" not in text} == set()


def test_the_example_of_a_candidate_is_one(exported: Path) -> None:
    """As it stands, and with what is a comment in it: every key there is."""
    text = (exported / "candidate.toml").read_text()
    assert recorded.about(exported).unit == "mm"
    every = tomllib.loads(re.sub(r"^# (?=\w+ = )", "", text, flags=re.MULTILINE))
    assert parse(recorded.About, every, "test").seconds_per_frame == 0.01
    assert every.keys() == recorded.About.model_fields.keys()


def test_a_folder_that_is_in_use_is_refused_before_any_work(scene: MuscleCase, tmp_path: Path) -> None:
    (tmp_path / "mine.txt").write_text("work of months")
    with pytest.raises(
        InputError, match=r"--to: got .*, which is not empty, want a folder that is not there yet, or empty"
    ):
        export.export(scene, lambda: pytest.fail("built"), tmp_path, "open")
    with pytest.raises(InputError, match=r"--to: got .*mine\.txt\", a file, want a folder"):
        export.export(scene, lambda: pytest.fail("built"), tmp_path / "mine.txt", "open")
    assert [path.name for path in tmp_path.iterdir()] == ["mine.txt"]


def test_a_folder_that_cannot_be_written_shows_before_the_problem_is_built(scene: MuscleCase, tmp_path: Path) -> None:
    (tmp_path / "file").touch()
    with pytest.raises(OSError, match="cannot be written: Not a directory"):
        export.export(scene, lambda: pytest.fail("built"), tmp_path / "file" / "scene", "open")


def test_an_export_that_fails_leaves_nothing(
    scene: MuscleCase, built: MuscleProblem, tmp_path: Path, monkeypatch
) -> None:
    def fails(*_: object) -> None:
        raise OSError("no space left")

    monkeypatch.setattr(open_formats, "write_lines", fails)
    with pytest.raises(OSError, match="no space left"):
        export.export(scene, lambda: built, tmp_path / "new" / "folders" / "bar", "open")
    assert list(tmp_path.iterdir()) == []
    monkeypatch.undo()
    (tmp_path / "bar").mkdir()  # an empty folder is free
    assert "scene.json" in export.export(scene, lambda: built, tmp_path / "bar", "open")


@pytest.fixture(scope="module")
def foreign(exported: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """What somebody else's solver makes of the export."""
    folder = tmp_path_factory.mktemp("foreign") / "run 7"
    script = Path(__file__).parents[1] / "foreign_solver.py"
    subprocess.run([sys.executable, "-I", "-W", "error", script, exported, folder], check=True)
    return folder


def test_a_foreign_solver_is_judged(
    scene: MuscleCase, built: MuscleProblem, foreign: Path, tmp_path: Path, monkeypatch
) -> None:
    """Against a reference that slides by 1 mm a frame number. Bodies turned as a whole keep volume and fibre lengths."""
    slid = np.multiply.outer(np.array(built.frames, float), [0, 0, 1.0])

    def obtain(bench: Bench, name: str, choice, place: str) -> Run:
        if choice.solver == "recorded":
            return bench.read(name, choice, place)
        positions, fibres = (points + slid[:, None] for points in (built.surface.points, built.fibres.points))
        outcome = Outcome("converged", "slid", {"seconds_solve": 4.0})
        return Run(name, "fenicsx", outcome, built.frames, built.surface, positions, built.fibres, fibres)

    drawn = []
    monkeypatch.setattr(Bench, "obtain", obtain)
    monkeypatch.setattr(report, "write", lambda result, folder, _: drawn.append(result) or folder / "report.html")
    words = ["compare", scene.place, "--candidate", str(foreign), "--out", str(tmp_path), "--quiet"]
    assert cli.main([*words, "--json", str(tmp_path / "facts.json")]) == cli.DONE
    facts = json.loads((tmp_path / "facts.json").read_text())
    assert facts["cost"]["stiff"] == {"seconds_per_frame": 0.002, "threads": 1.0}
    found = {
        (row["metric"], row["statistic"], row["frame"]): row["value"]
        for row in facts["measures"]
        if row["candidate"] == "stiff"
    }
    turned = apply(built.bones[1].pose(10), built.surface.points)
    away = np.linalg.norm(turned - built.surface.points - [0, 0, 10], axis=1).max()
    assert found["surface_deviation", "max", 10] == pytest.approx(away, abs=1e-9)
    for number in built.frames:
        assert found["volume", "deviation", number] == pytest.approx(0, abs=1e-9)
        assert found["fibre_length", "mean", number] == pytest.approx(0, abs=1e-6)
    (stiff,) = drawn[0].candidates
    assert stiff.origin["candidate"] == {"name": "stiff", "version": "0.1"}
    step = stiff.numbers[1] - stiff.numbers[0]
    assert seconds_per_frame(stiff) == pytest.approx(
        0.002 * step
    )  # of the frames wanted; the file says of a frame number


def test_gluteus_maximus_goes_out_and_comes_back(data: Path, tmp_path: Path) -> None:
    """From metres in float64: rounding is below 1e-9 mm at 500 mm. 1218 vertices are on the pelvis (its case)."""
    assert (data / "hip").is_dir()
    large = casefile.read("gluteus_maximus", changes={"muscle.tet_size": "20 mm", "frames.every": 100})
    assert isinstance(large, MuscleCase)
    rest = muscle.setup(large)
    export.export(large, lambda: muscle.build(large, rest), tmp_path / "export", "open")
    script = Path(__file__).parents[1] / "foreign_solver.py"
    subprocess.run([sys.executable, "-I", script, tmp_path / "export", tmp_path / "frames"], check=True)
    assert sum(row[0] == "origin" for row in rows(tmp_path / "export" / "attachments.csv")) == 1218
    taken = []
    recorded.solve(rest, recorded.RecordedSettings(folder=str(tmp_path / "frames"), unit="m"), taken.append)
    for frame in taken:
        moved = apply(rest.bones[2].pose(frame.number), rest.surface.points)
        assert np.allclose(frame.surface, moved, rtol=0, atol=1e-9)


def test_the_unit_of_a_foreign_solver_is_its_own(scene: MuscleCase, foreign: Path, tmp_path: Path, capsys) -> None:
    words = ["compare", scene.place, "--candidate", str(foreign), "--unit", "mm", "--out", str(tmp_path), "--quiet"]
    assert cli.main(words) == cli.BAD_INPUT
    assert 'candidate.toml: unit: got "m", want what --unit or the case says, a unit of 1 mm' in capsys.readouterr().err


def test_the_verb(scene: MuscleCase, tmp_path: Path, capsys) -> None:
    words = ["export", scene.place, "--quiet", "--to", str(tmp_path / "new" / "bar"), "--set", "muscle.tet_size=9 mm"]
    assert cli.main([*words, "--json", str(tmp_path / "facts.json")]) == cli.DONE
    printed = json.loads((tmp_path / "facts.json").read_text())
    there = {str(path.relative_to(tmp_path / "new" / "bar")) for path in (tmp_path / "new" / "bar").rglob("*.*")}
    assert set(printed["files"]) == there
    assert cli.main(words) == cli.BAD_INPUT
    assert "which is not empty" in capsys.readouterr().err
    assert cli.main(["export", "rod", "--to", str(tmp_path / "rod")]) == cli.BAD_INPUT
    assert 'got "rod", a scalar case, want the case of a muscle' in capsys.readouterr().err
