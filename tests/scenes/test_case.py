"""Cases: files found where they may be, and keys of all that determines the solution and of nothing else."""

import shutil
from pathlib import Path

import pytest
import small

from fem_reference.foundations.errors import InputError
from fem_reference.scenes import casefile
from fem_reference.scenes.case import DATA_SETTING, HOME, home
from tests.scenes.bars import FILES, OUTLINE, POLYLINES, changed


def test_the_key_of_a_scene_is_of_what_its_files_contain_and_not_of_their_names(tmp_path: Path) -> None:
    folder = small.write(tmp_path / "bar")
    before = casefile.read(folder).key
    text = (folder / "case.toml").read_text()
    (folder / "floor.vtp").rename(folder / "ground.vtp")
    (folder / "case.toml").write_text(text.replace('"floor.vtp"', '"ground.vtp"'))
    assert casefile.read(folder).key == before
    (folder / "case.toml").write_text(text.replace('"floor.vtp"', '"lid.vtp"'))
    assert casefile.read(folder).key != before


@pytest.mark.parametrize("inside", [True, False])
def test_cases_inside_the_package_come_before_those_beside_it(tmp_path: Path, inside: bool) -> None:
    package = tmp_path / "site-packages" / "fem_reference"
    for folder in (package.parent, *([package] if inside else [])):
        (folder / "cases").mkdir(parents=True)
    assert home(package) == (package if inside else package.parent)


def test_file_is_found_beside_the_scene_in_meshes_and_in_data(bar: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    scene = casefile.read(bar)
    assert scene.file("bar.ply", "muscle.surface") == bar.resolve() / "bar.ply"
    assert scene.file("mesh:hip/card.toml", "muscle.surface") == HOME / "meshes" / "hip" / "card.toml"
    monkeypatch.setenv(DATA_SETTING, str(bar))
    assert scene.file("data:wall.ply", "muscle.surface") == bar / "wall.ply"


def test_file_without_the_data_setting(bar: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv(DATA_SETTING, raising=False)
    with pytest.raises(InputError, match=f'muscle.surface: got "data:a.ply" while {DATA_SETTING} is not set'):
        casefile.read(bar).file("data:a.ply", "muscle.surface")


def test_file_that_is_not_there(bar: Path) -> None:
    with pytest.raises(
        InputError, match=r'bone\[0\].surface: got "lost.ply", which is not at .*lost.ply, want a file that exists'
    ):
        casefile.read(bar).file("lost.ply", "bone[0].surface")


SOLUTION = {
    "muscle.unit": "m",
    "muscle.tet_size": "1 cm",
    "muscle.surface": "wall.ply",
    "muscle": {"surface": "bar.ply", "unit": "cm", "tet_size": "2 cm", "mesher": "block"},
    "bone[0]": {"name": "wall", "sphere": {"centre": "0, 0, 0 mm", "radius": "3 mm"}},
    "bone[1].motion": {
        "direction": [0, -1, 0],
        "keyframes": [{"frame": 0, "distance": "0 mm"}, {"frame": 9, "distance": "1 mm"}],
    },
    "bone[0].name": "floor",
    "bone[1].unit": "cm",
    "bone[1].surface": "wall.ply",
    "bone[1].motion.axis": [0, 1, 2],
    "bone[1].motion.centre": "1, 2, 4 cm",
    "bone[1].motion.keyframes[1].angle": "91 deg",
    "bone[1].motion.keyframes[1].frame": 11,
    "attachment[0].within": "3 mm",
    "attachment[1].vertices.value": 1,
    "attachment[1].vertices.file": "wall.ply",
    "attachment[1]": {"name": "end", "bone": "lever", "outline": OUTLINE},
    "effect[0].mu": "31 kPa",
    "effect[1].bulk": "31 MPa",
    "fibres.traced.count": 4,
    "fibres": {"polylines": POLYLINES},
    "frames.last": 25,
    "frames.every": 10,
}


def test_key_differs_with_every_input_of_the_solution(bar: Path) -> None:
    keys = [casefile.read(bar).key, *(changed(bar, key, value).key for key, value in SOLUTION.items())]
    assert len(set(keys)) == len(keys)


def test_key_is_blind_to_what_does_not_change_the_solution(bar: Path) -> None:
    changes = {"title": "x", "expect[0].within": "2 %", "candidate[0].stretch": 0.5, "effect[0].mu": "0.03 MPa"}
    moved = Path(shutil.copytree(bar, bar.parent / "elsewhere"))
    assert casefile.read(moved, changes=changes).key == casefile.read(bar).key


@pytest.mark.parametrize("name", FILES)
def test_key_follows_the_content_of_files(bar: Path, name: str) -> None:
    before = casefile.read(bar).key
    (bar / name).write_text("other content", encoding="utf-8")
    assert casefile.read(bar).key != before


@pytest.mark.parametrize(("key", "name"), [("fibres", "fibres.vtk"), ("attachment[1]", "marks.csv")])
def test_key_follows_the_content_of_polylines_and_outlines(bar: Path, key: str, name: str) -> None:
    before = changed(bar, key, SOLUTION[key]).key
    (bar / name).write_text("other content", encoding="utf-8")
    assert changed(bar, key, SOLUTION[key]).key != before
