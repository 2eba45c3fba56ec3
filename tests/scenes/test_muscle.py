"""The case of a muscle: its muscle, bones, attachments, fibres and frames; each mistake is named with its key."""

import math
from pathlib import Path

import pytest

from fem_reference.foundations.errors import InputError
from fem_reference.foundations.motion import RigidMotion
from fem_reference.geometry.rigid_bodies import Box, Capsule, Cylinder, HalfSpace, Obstacle, Sphere
from fem_reference.problems.muscle import solid
from fem_reference.scenes import casefile
from fem_reference.scenes.muscle import MOST_FRAMES, Frames
from tests.scenes.bars import OUTLINE, PRESSURE, ROD, SCENE, SLIDE, TURN, changed, edited, refused, written

# Key, what stands there instead, what the message says.
WRONG = [
    ("muscle.unit", "2 mm", 'muscle.unit: got "2 mm", want a unit of length'),
    ("muscle.tet_size", "2 kPa", 'muscle.tet_size: got "2 kPa", want a length with its unit, such as "2 mm"'),
    ("muscle.tet_size", "0 mm", 'muscle.tet_size: got "0 mm", want more than zero'),
    ("muscle.tet_size", 2.0, "muscle.tet_size: got 2.0, want a length"),
    ("muscle.tet_size", "1e-320 mm", 'muscle.tet_size: got "1e-320 mm", want at least 1e-30 mm'),
    ("muscle.tet_size", "mm", 'muscle.tet_size: got "mm", want a length with its unit'),
    (
        "muscle",
        {"surface": "bar.ply", "unit": "cm", "tet_size": "2 cm", "mesher": "gmsh"},
        'muscle.mesher: got "gmsh", want',
    ),
    ("attachment[1]", {"name": "end", "bone": "lever"}, 'want exactly one of "vertices", "within", "outline"'),
    ("attachment[0]", {"name": "a", "bone": "wall", "within": "2 mm", "outline": OUTLINE}, "want exactly one of"),
    ("fibres.traced.count", 0, "fibres.traced.count: got 0, want greater than 0"),
    ("fibres.traced.count", 10**18, "want less than or equal to 100000"),
    ("fibres", {}, 'fibres: got {}, want exactly one of "polylines", "traced"'),
    ("frames.every", 3, "want last = first + a multiple of every"),
    ("frames.last", 0, "want last = first + a multiple of every"),
    ("frames.every", True, "frames.every: got True, want a valid integer"),
    ("frames.every", "5", 'frames.every: got "5", want a valid integer'),
    ("frames.every", 5.0, "frames.every: got 5.0, want a valid integer"),
    ("frames.last", 2000000000000000, "want at most 100000 frames"),
    ("frames", {"first": 10**12, "last": 10**12 + 5, "every": 5}, "want frame numbers up to 1000000000"),
    ("frames.interval", "1 mm", 'frames.interval: got "1 mm", want a time with its unit, such as "0.01 s"'),
]


def test_attachments_may_be_none(bar: Path) -> None:
    start, end = SCENE.index("[[attachment]]"), SCENE.index("[[effect]]")
    text = SCENE[:start] + SCENE[end:]
    with pytest.raises(InputError, match=r'fibres.traced.start: got "start", want none, as none is defined'):
        casefile.read(written(bar, text))
    traced = text[text.index("[fibres.traced]") : text.index("[frames]")]
    lines = 'fibres.polylines = { file = "fibres.vtk", unit = "mm" }\n'
    text = lines + text.replace(traced, "")
    with pytest.raises(InputError, match=r"case.toml: attachment: got none, want an attachment, .* or the effect"):
        casefile.read(written(bar, text))
    slow = '[[effect]]\nname = "damping"\ncoefficient = "1 Pa s/mm^2"\n\n[frames]'
    assert casefile.read(written(bar, text.replace("[frames]", slow))).attachment == ()


def test_loads_of_a_kind_act_on_different_parts(bar: Path) -> None:
    tables = [{"name": "neo_hooke", "mu": "1 kPa"}, PRESSURE, PRESSURE | {"on": "end"}]
    soft = {"attachment[1].stiffness": "1 MPa/mm"}
    scene = casefile.read(bar, changes=soft | {"effect": tables})
    assert [effect.title for effect in scene.effects] == ["NeoHooke", "Pressure on free", "Pressure on end"]
    assert scene.key != casefile.read(bar, changes=soft | {"effect": tables[:2]}).key


@pytest.mark.parametrize(("key", "value", "message"), WRONG, ids=lambda entry: str(entry)[:40])
def test_wrong_value_names_file_and_key(bar: Path, key: str, value: object, message: str) -> None:
    refused(bar, key, value, message)


def test_frames_go_from_the_first_to_the_last_in_equal_steps() -> None:
    frames = Frames(first=3, last=15, every=4)
    assert frames.numbers == (3, 7, 11, 15)
    assert Frames(first=0, last=MOST_FRAMES - 1, every=1).numbers[-1] == MOST_FRAMES - 1


def test_refinements_halve_the_tetrahedra_that_are_shown(bar: Path) -> None:
    muscle = {"surface": "bar.ply", "unit": "cm", "tet_size": "2 cm", "refinements": 2}
    facts = changed(bar, "muscle", muscle).facts
    assert facts == {
        "muscle": "bar.ply, tetrahedra of 5 mm",
        "bones": "wall, lever",
        "attachments": "start, end",
        "frames": "0 to 20, every 5",
    }


NAN, INF = math.nan, math.inf
FORMS = [
    ({"half_space": {"point": "1, 2, 3 cm", "normal": [0, 2, 0]}}, HalfSpace((10, 20, 30), (0, 2, 0))),
    ({"box": {"centre": "0, 0, 1 mm", "size": "4, 1, 4 cm"}}, Box((0, 0, 1), (40, 10, 40), 0)),
    ({"box": {"centre": "0, 0, 1 mm", "size": "4, 1, 4 cm", "rounding": "5 mm"}}, Box((0, 0, 1), (40, 10, 40), 5)),
    ({"sphere": {"centre": "0, 0, 1 mm", "radius": "3 cm"}}, Sphere((0, 0, 1), 30)),
    ({"capsule": ROD}, Capsule((0, 0, 0), (0, 30, 40), 2)),
    ({"cylinder": ROD}, Cylinder((0, 0, 0), (0, 30, 40), 2)),
]
# Key, what stands there instead, what the message says.
WRONG_BONES = [
    ("bone[1].motion.axis", [0, 0, 0], "bone[1].motion.axis: got [0, 0, 0], want an axis that is not zero"),
    ("bone[1].motion.axis", [1e-320, 0, 0], "bone[1].motion.axis: got [1e-320, 0, 0], want an axis that is not zero"),
    ("bone[1].motion.axis", [1e200, 0, 0], "want an axis that is not zero, with a length from 1e-9 to 1e9"),
    ("bone[1].motion.axis", [NAN, 0, 0], "bone[1].motion.axis[0]: got nan, want a finite number"),
    ("bone[1].motion.axis", [0, INF, 0], "bone[1].motion.axis[1]: got inf, want a finite number"),
    ("bone[1].motion.axis", ["1", "0", "0"], 'bone[1].motion.axis[0]: got "1", want a valid number'),
    ("bone[1].motion.keyframes[1].frame", NAN, "bone[1].motion.keyframes[1].frame: got nan, want a finite number"),
    ("bone[1].motion.keyframes[1].frame", "10", 'bone[1].motion.keyframes[1].frame: got "10", want a valid number'),
    ("bone[1].motion.centre", "1, 2 mm", 'bone[1].motion.centre: got "1, 2 mm", want three lengths with one unit'),
    ("bone[1].motion.keyframes[1].frame", 0, "want keyframes in the order of their frames"),
    (
        "bone[1].motion.keyframes[1].angle",
        "90",
        'keyframes[1].angle: got "90", want an angle with its unit, such as "30 deg"',
    ),
    (
        "bone[1].motion",
        SLIDE | {"direction": [0, 0, 0]},
        "bone[1].motion.direction: got [0, 0, 0], want a direction that",
    ),
    ("bone[1].motion", SLIDE | {"direction": [0, 1]}, "bone[1].motion.direction"),
    ("bone[1].motion", SLIDE | {"axis": [0, 0, 1]}, 'want either "axis" and "centre" (a rotation) or "direction" (a'),
    (
        "bone[1].motion",
        SLIDE | {"centre": "0, 0, 0 mm"},
        'want either "axis" and "centre" (a rotation) or "direction" (a',
    ),
    ("bone[1].motion", SLIDE | TURN, "bone[1].motion.keyframes: got"),
    ("bone[1].motion", SLIDE | TURN | {"keyframes": SLIDE["keyframes"]}, "bone[1].motion: got {"),
    (
        "bone[1].motion",
        TURN | {"keyframes": SLIDE["keyframes"]},
        'want "frame" and "angle" in each keyframe of a rotation',
    ),
    (
        "bone[1].motion",
        SLIDE | {"keyframes": [{"frame": 0, "distance": "0 mm"}, {"frame": 9}]},
        'want "frame" and "distance" in each keyframe of a translation',
    ),
    (
        "bone[1].motion",
        SLIDE | {"keyframes": [{"frame": 0, "distance": "0 mm"}, {"frame": 9, "distance": "1 mm", "angle": "1 deg"}]},
        'want "frame" and "distance" in each keyframe of a translation',
    ),
    (
        "bone[1].motion",
        SLIDE | {"keyframes": [{"frame": 0, "distance": "1 deg"}, {"frame": 9, "distance": "1 mm"}]},
        'bone[1].motion.keyframes[0].distance: got "1 deg", want a length with its unit',
    ),
    (
        "bone[0]",
        {"name": "wall", "cylinder": ROD, "capsule": ROD},
        'want exactly one of "surface", "half_space", "box", "sphere", "capsule", "cylinder"',
    ),
    ("bone[0]", {"name": "wall"}, "bone[0]: got {'name': 'wall'}, want exactly one of \"surface\", \"half_space\""),
    ("bone[0]", {"name": "wall", "surface": "wall.ply"}, "bone[0]: got {"),
    ("bone[0]", {"name": "wall", "surface": "wall.ply"}, 'want "unit" if and only if "surface" is given'),
    ("bone[0]", {"name": "wall", "capsule": ROD, "unit": "mm"}, 'want "unit" if and only if "surface" is given'),
    (
        "bone[0]",
        {"name": "wall", "capsule": ROD, "distance_error": "0.05 mm"},
        'want "distance_error" only with "surface", as an analytic shape has none',
    ),
    (
        "bone[0]",
        {"name": "wall", "half_space": {"point": "0, 0, 0 mm", "normal": [0, 0, 0]}},
        "bone[0].half_space.normal: got [0, 0, 0], want a normal that is not zero",
    ),
    (
        "bone[0]",
        {"name": "wall", "half_space": {"point": "0, 0 mm", "normal": [0, 1, 0]}},
        'bone[0].half_space.point: got "0, 0 mm", want three lengths with one unit',
    ),
    (
        "bone[0]",
        {"name": "wall", "box": {"centre": "0, 0, 0 mm", "size": "1, 0, 1 mm"}},
        "want three lengths above zero",
    ),
    (
        "bone[0]",
        {"name": "wall", "box": {"centre": "0, 0, 0 mm", "size": "4, 2, 4 mm", "rounding": "1.1 mm"}},
        'bone[0].box.rounding: got "1.1 mm", want a length from 0 to half of the shortest edge',
    ),
    (
        "bone[0]",
        {"name": "wall", "sphere": {"centre": "0, 0, 0 mm", "radius": "0 mm"}},
        'bone[0].sphere.radius: got "0 mm", want more than zero',
    ),
    (
        "bone[0]",
        {"name": "wall", "sphere": {"centre": "0, 0, 0 mm", "radius": "1 mm", "colour": "red"}},
        "bone[0].sphere.colour: got an unknown key, want one of centre, radius",
    ),
    (
        "bone[0]",
        {"name": "wall", "capsule": {"start": "0, 0, 0 mm"}},
        "bone[0].capsule.end: got nothing, want this key",
    ),
    (
        "bone[0]",
        {"name": "wall", "cylinder": ROD | {"end": "0, 0, 0 mm"}},
        'bone[0].cylinder.end: got "0, 0, 0 mm", want a point other than the start',
    ),
]


@pytest.mark.parametrize(("table", "body"), FORMS, ids=lambda entry: type(entry).__name__)
def test_a_bone_may_have_a_closed_form(bar: Path, table: dict[str, object], body: Obstacle) -> None:
    scene = changed(bar, "bone[0]", {"name": "wall"} | table)
    assert solid(scene.bone[0]) == body
    assert solid(scene.bone[1]) is None


def test_a_bone_may_slide(bar: Path) -> None:
    motion = changed(bar, "bone[1].motion", SLIDE).bone[1].motion
    assert motion is not None
    assert motion.poses() == RigidMotion((0.0, -3.0, 0.0), None, (0.0, 9.0), (0.0, 10.0))


@pytest.mark.parametrize(("number", "printed"), [("nan", "nan"), ("inf", "inf"), ("-inf", "-inf")])
def test_numbers_of_a_file_are_finite(bar: Path, number: str, printed: str) -> None:
    with pytest.raises(InputError, match=rf"axis\[2\]: got {printed}, want a finite number"):
        casefile.read(edited(bar, "axis = [0, 0, 2]", f"axis = [0, 0, {number}]"))


@pytest.mark.parametrize(("key", "value", "message"), WRONG_BONES, ids=lambda entry: str(entry)[:40])
def test_wrong_value_of_a_bone_names_file_and_key(bar: Path, key: str, value: object, message: str) -> None:
    refused(bar, key, value, message)
