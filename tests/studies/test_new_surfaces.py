"""The verb ``new`` on surfaces of any file name and unit: one muscle, units that agree, and a scene that can be read."""

import json
import re
import shutil
from pathlib import Path

import numpy as np
import pytest
import shapes
from hypothesis import HealthCheck, example, given, settings
from hypothesis import strategies as st

from fem_reference import cli
from fem_reference.foundations.errors import InputError
from fem_reference.foundations.mesh import Surface
from fem_reference.foundations.units import LENGTH_UNITS, length_unit
from fem_reference.io import files
from fem_reference.scenes import casefile
from fem_reference.studies import new_scene

# A bar of 211 mm between a block below it and one above, which are 300 mm long; each touches it.
MUSCLE, BONE = (30, 30, 207), (30, 300, 30)
PLACES = {"muscle": (0.0, 0, 0), "low": (0.0, -135, -30), "high": (0.0, -135, 207)}
SIZES = {"muscle": MUSCLE, "low": BONE, "high": BONE}


def bodies(folder: Path, units: dict[str, float] | None = None, suffix: str = ".stl") -> dict[str, Path]:
    """The files of muscle and bones in ``folder``, in ``units`` [mm] of each, by default mm."""
    found = {}
    for name, size in SIZES.items():
        surface = shapes.skin(shapes.box((3, 3, 8), size))
        found[name] = folder / f"{name}{suffix}"
        moved = (surface.points + PLACES[name]) / (units or {}).get(name, 1.0)
        shapes.write(found[name], surface, moved)
    return found


def made(folder: Path, given: dict[str, Path], *more: str) -> int:
    """The exit status of ``new`` with these surfaces."""
    bones = [word for name, path in given.items() if name != "muscle" for word in ("--bone", str(path))]
    return cli.main(["new", str(folder / "mine"), "--muscle", str(given["muscle"]), *bones, *more])


def length(folder: Path) -> float:
    """Of the muscle of a scene that was made [mm]."""
    scene = casefile.read_muscle(folder / "mine")
    return float(np.ptp(files.read_surface(scene.folder / "muscle.ply", 1.0).points[:, 2]))


def test_a_second_muscle_is_refused_and_not_dropped(tmp_path: Path, capsys) -> None:
    given = bodies(tmp_path)
    assert made(tmp_path, given, "--muscle", str(tmp_path / "other.stl")) == cli.BAD_INPUT
    said = capsys.readouterr().err
    assert f'--muscle: got "{given["muscle"]}" and "{tmp_path / "other.stl"}", want one of them' in said
    assert not (tmp_path / "mine").exists()


@pytest.mark.parametrize(
    "words",
    [["recommend", "rod", "--error", "1 mm", "--error", "2 mm"], ["new", "x", "--from", "rod", "--from", "rod"]],
)
def test_no_option_of_one_value_is_taken_twice(words: list[str], capsys) -> None:
    assert cli.main(words) == cli.BAD_INPUT
    assert re.search(r'got ".*" and ".*", want one of them', capsys.readouterr().err)


@pytest.mark.parametrize("unit", LENGTH_UNITS)
def test_the_flag_takes_the_units_that_scenes_take(unit: str, tmp_path: Path, capsys) -> None:
    each = length_unit(unit)
    assert made(tmp_path, bodies(tmp_path, dict.fromkeys(SIZES, each)), "--unit", unit) == cli.DONE
    assert length(tmp_path) == pytest.approx(207, rel=1e-5)
    text = (tmp_path / "mine" / "case.toml").read_text().replace('unit = "mm"', f'unit = "{unit}"', 1)
    (tmp_path / "mine" / "case.toml").write_text(text)
    assert casefile.read_muscle(tmp_path / "mine").muscle.unit == each
    assert "guessed" not in capsys.readouterr().out


@pytest.mark.parametrize("unit", ["Mm", "inches", "parsec", "2 mm", "", "kPa", "MM", "µ"])
def test_the_flag_refuses_the_units_that_scenes_refuse(unit: str, tmp_path: Path, capsys) -> None:
    assert made(tmp_path, bodies(tmp_path), "--unit", unit) == cli.BAD_INPUT
    assert f'--unit: got "{unit}", want a unit of length: ' in capsys.readouterr().err
    assert not (tmp_path / "mine").exists()
    assert made(tmp_path, bodies(tmp_path)) == cli.DONE
    text = (tmp_path / "mine" / "case.toml").read_text().replace('unit = "mm"', f'unit = "{unit}"', 1)
    (tmp_path / "mine" / "case.toml").write_text(text)
    with pytest.raises(InputError, match=r"muscle\.unit: got .*, want a unit of length: "):
        casefile.read_muscle(tmp_path / "mine")


def test_a_guess_is_printed_with_what_it_follows_from(tmp_path: Path, capsys) -> None:
    options = ("--json", str(tmp_path / "new.json"))
    assert made(tmp_path, bodies(tmp_path, dict.fromkeys(SIZES, 1000.0)), *options) == cli.DONE
    said = capsys.readouterr().out
    # sqrt(207^2 + 2 * 30^2) and sqrt(300^2 + 2 * 30^2) mm, in m
    assert (
        'lengths are in m (guessed: "muscle.stl" is 0.211 long, possible for a muscle in m; "low.stl" is 0.303 long'
        in said
    )
    assert json.loads((tmp_path / "new.json").read_text())["unit"] == "m"
    assert length(tmp_path) == pytest.approx(207, rel=1e-5)


def test_a_muscle_in_inches_is_not_taken_for_one_in_centimetres(tmp_path: Path, capsys) -> None:
    # A muscle of 211.3 mm is 8.32 inches long, which is one in cm too; its bones in inches do not decide it.
    assert made(tmp_path, bodies(tmp_path, dict.fromkeys(SIZES, 25.4))) == cli.BAD_INPUT
    assert re.search(
        r'--unit: got no unit, but "muscle.stl" is 8.32 long, possible for a muscle in cm or in; ',
        capsys.readouterr().err,
    )
    # Bones in mm beside it contradict both.
    assert made(tmp_path, bodies(tmp_path, {"muscle": 25.4})) == cli.BAD_INPUT
    said = capsys.readouterr().err
    assert 'a muscle in cm or in; "low.stl" is 303 long, possible for a bone in mm' in said
    assert "no unit suits all of them" in said
    assert not (tmp_path / "mine").exists()


def test_surfaces_that_are_apart_are_refused(tmp_path: Path, capsys) -> None:
    # As long as a muscle and bones in mm, but the muscle was scaled about another origin: its boxes are far from theirs.
    given = bodies(tmp_path)
    surface = shapes.skin(shapes.box((3, 3, 8), MUSCLE))
    shapes.write(given["muscle"], surface, surface.points + [0, 0, 2000])
    for more in ((), ("--unit", "mm")):
        assert made(tmp_path, given, *more) == cli.BAD_INPUT
        assert re.search(r"muscle.stl: got .*1.76e\+03 mm from the muscle, .* want .*--unit", capsys.readouterr().err)
    assert not (tmp_path / "mine").exists()


NAMES = st.text(st.characters(exclude_characters="/\0", codec="utf-8"), min_size=1, max_size=240)


@pytest.mark.slow
@settings(max_examples=60, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(muscle=NAMES, low=NAMES, high=NAMES)
@example(muscle='a "quote"', low="back\\slash", high="new\nline")
@example(muscle=" blank ", low="control \x01\x7f\x1b[31m", high="tab\tand\r")
@example(muscle="m" * 240, low="l" * 240, high="l" * 239 + "h")
@example(muscle="muscle", low="data:low", high="mesh:high")
@example(muscle="$title ${name} $", low="#no comment", high='"""')
@example(muscle="é" * 120, low="骨" * 80, high="\u2028\u0085")
@example(muscle="..", low="...low", high="-high")
@example(muscle="a\x01", low="a\x02", high="muscle\x01")
def test_a_scene_is_readable_whatever_files_are_called(muscle: str, low: str, high: str, tmp_path: Path) -> None:
    """Names that a scene can have come back as they are, and all others as ones that differ."""
    box = shapes.skin(shapes.box((3, 3, 8), MUSCLE))
    body = Surface(box.points, box.triangles, f"{muscle}.stl")
    ends = {name: _block(name, i) for i, name in enumerate((low, high))}
    if len({low, high}) < 2:
        return
    folder = tmp_path / "scene"
    shutil.rmtree(folder, ignore_errors=True)
    new_scene.write(folder, body, ends)
    scene = casefile.read_muscle(folder)
    names = [bone.name for bone in scene.bone]
    assert len({*names, "muscle"}) == 3
    for name in (low, high):
        if new_scene.is_name(name) and name != "muscle":
            assert name in names
    for bone in scene.bone:
        assert bone.surface is not None
        points = files.read_surface(scene.file(bone.surface, "surface"), 1.0).points
        assert np.ptp(points[:, 1]) == pytest.approx(300)
    assert {one.bone for one in scene.attachment} == set(names)


def _block(name: str, i: int) -> Surface:
    box = shapes.skin(shapes.box((3, 3, 8), BONE))
    return Surface(box.points + PLACES[("low", "high")[i]], box.triangles, f"{name}.stl")


@pytest.mark.parametrize("name", ['my "muscle"', "my\\muscle", "my\nmuscle", " ", "my\x07muscle", "m" * 240, "é" * 120])
def test_files_of_any_name_make_a_scene_on_the_command_line(name: str, tmp_path: Path) -> None:
    given = bodies(tmp_path)
    for role in SIZES:
        given[role] = given[role].rename(tmp_path / f"{name[:-1] if len(name) > 100 else name}{role[0]}.stl")
    assert made(tmp_path, given) == cli.DONE
    assert len(casefile.read_muscle(tmp_path / "mine").bone) == 2


@pytest.mark.parametrize("name", ["new\nline", " blank", "m" * 240, "control\x01", "e" * 300])
def test_a_folder_that_no_scene_can_be_called_by_is_refused(name: str, tmp_path: Path, capsys) -> None:
    given = bodies(tmp_path)
    words = ["new", str(tmp_path / name)]
    bones = ["--bone", str(given["low"]), "--bone", str(given["high"])]
    for more in (["--muscle", str(given["muscle"]), *bones], ["--from", "rod"]):
        assert cli.main([*words, *more]) == cli.BAD_INPUT
        assert "fem-reference: NAME: got" in capsys.readouterr().err
    assert sorted(path.name for path in tmp_path.iterdir()) == ["high.stl", "low.stl", "muscle.stl"]
