"""The verbs ``new`` and ``validate``: a scene to begin with, and what is known of it before it is solved."""

import re
from pathlib import Path

import numpy as np
import pytest
import shapes

from fem_reference import cli
from fem_reference.foundations.errors import InputError
from fem_reference.geometry.distance import distances
from fem_reference.io import files
from fem_reference.problems import muscle
from fem_reference.scenes import casefile
from fem_reference.scenes.case import HOME
from fem_reference.studies import new_scene

HIP = HOME / "meshes" / "hip"


@pytest.fixture
def stl(tmp_path: Path) -> Path:
    """The muscle and bones of hip_flexion as somebody's STL files, in metres."""
    for name in ("muscle", "pelvis", "femur"):
        surface = files.read_surface(HIP / f"{name}.ply", 1.0)
        shapes.write(tmp_path / f"my_{name}.stl", surface, surface.points / 1000)
    return tmp_path


def words(folder: Path, *more: str) -> list[str]:
    bones = ["--bone", str(folder / "my_femur.stl"), "--bone", str(folder / "my_pelvis.stl")]
    return ["new", str(folder / "mine"), "--muscle", str(folder / "my_muscle.stl"), *bones, *more]


def test_a_scene_of_surfaces_can_be_set_up_as_it_is(stl: Path, capsys) -> None:
    assert cli.main(words(stl)) == cli.DONE
    assert f"fem-reference run {stl / 'mine'}" in capsys.readouterr().out
    scene = casefile.read_muscle(stl / "mine")
    rest = muscle.setup(scene)
    given = files.read_surface(HIP / "muscle.ply", 1.0)
    assert len(rest.surface.points) == len(given.points)  # STL's copies of points are one again,
    assert np.ptp(rest.surface.points, axis=0) == pytest.approx(np.ptp(given.points, axis=0), rel=1e-5)  # in mm
    origin, insertion = rest.attached
    assert {origin.bone.name, insertion.bone.name} == {"my_pelvis", "my_femur"}
    assert not set(origin.vertices.tolist()) & set(insertion.vertices.tolist())
    for end in rest.attached:  # no vertex that is nearer to its bone was left out
        away = distances(rest.surface.points, end.bone.surface).distance
        assert away[end.vertices].max() < np.delete(away, end.vertices).min()
    assert [bone.motion is not None for bone in rest.bones] == [False, True]
    volume = 6 * np.sqrt(2) * 176e3 / scene.muscle.tet_size**3 * 8**scene.muscle.refinements
    assert volume == pytest.approx(5000, rel=0.05)


@pytest.mark.parametrize(("scale", "unit"), [(1.0, "mm"), (1e-3, "m")])
def test_the_unit_is_guessed_where_only_one_makes_a_muscle_and_bones(scale: float, unit: str) -> None:
    muscle, *bones = (files.read_surface(HIP / f"{name}.ply", scale) for name in ("muscle", "pelvis", "femur"))
    assert new_scene.guessed_unit(muscle, bones).name == unit


def test_where_several_units_make_one_it_is_asked_for() -> None:
    muscle, *bones = (files.read_surface(HIP / f"{name}.ply", 0.2) for name in ("muscle", "pelvis", "femur"))
    want = r'--unit: got no unit, but "muscle.ply" is 41.*, possible for a muscle in mm or cm; "pelvis.ply" is .*: several units'
    with pytest.raises(InputError, match=want):
        new_scene.guessed_unit(muscle, bones)


def test_what_cannot_be_is_refused_and_nothing_is_written(stl: Path, capsys) -> None:
    taken = stl / "taken"
    taken.mkdir()
    for given, want in (
        (["new", str(taken)], "which exists already"),
        (words(stl)[:6], "--bone: got 1 files, want two or more"),
        (words(stl, "--from", "rod"), '--from: got "rod" with --muscle'),
        (["new", str(stl / "mine"), "--bone", "x.stl"], "--bone: got a bone without --muscle"),
        ([*words(stl)[:4], "--bone", str(stl / "my_femur.stl"), "--bone", str(stl / "no.stl")], "no.stl"),
    ):
        assert cli.main(given) == cli.BAD_INPUT
        assert want in capsys.readouterr().err
        assert not (stl / "mine").exists()


def test_a_copy_of_a_case_is_that_case(tmp_path: Path) -> None:
    assert cli.main(["new", str(tmp_path / "again"), "--from", "rod"]) == cli.DONE
    assert casefile.read(tmp_path / "again").key == casefile.read("rod").key


@pytest.mark.slow
def test_validate_says_what_a_scene_is_and_costs(stl: Path, capsys) -> None:
    cli.main(words(stl))
    assert cli.main(["validate", str(stl / "mine"), "--quiet"]) == cli.DONE
    printed = capsys.readouterr().out
    assert "mine can be solved" in printed
    assert re.search(
        r"motion: the distance from \w+ to \w+ is \d+(\.\d+)? mm at rest, and at most \d+ % (longer|shorter), at frame 20",
        printed,
    )
    assert "of processor time, within a factor of three, for 11 frames" in printed
    assert cli.main(["validate", str(stl / "mine"), "--quiet", "--set", "reference.element=P9"]) == cli.BAD_INPUT
    assert 'element: got "P9"' in capsys.readouterr().err


@pytest.mark.slow
def test_a_case_runs_with_its_negative_control(tmp_path: Path, capsys) -> None:
    words = ["rod", "--candidate", "listing", "--quiet", "--out", str(tmp_path)]
    assert cli.main(["compare", *words]) == cli.DONE
    assert cli.main(["compare", *words, "--negative-control"]) == cli.VERDICT_FAIL
    assert "verdict: fail" in capsys.readouterr().out
    assert cli.main(["compare", *words, "--negative-control", "--set", "title=x"]) == cli.BAD_INPUT
