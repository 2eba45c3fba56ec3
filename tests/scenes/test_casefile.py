"""Scenes are read strictly: every mistake is one message that names file and key, and the key follows every input."""

import math
import os
import shutil
import tomllib
from pathlib import Path

import pytest

from fem_reference.foundations.errors import InputError
from fem_reference.foundations.motion import Rotation, Translation
from fem_reference.geometry.rigid_bodies import CLOSED_FORMS, Box, Capsule, Cylinder, HalfSpace, Obstacle, Sphere
from fem_reference.problems.muscle import solid
from fem_reference.scenes import casefile
from fem_reference.scenes.case import DATA_SETTING, HOME, home
from fem_reference.scenes.muscle import MuscleCase

MUSCLE_KEYS = [
    "attachment",
    "bone",
    "candidate",
    "effect",
    "effects",
    "expect",
    "fibres",
    "frames",
    "muscle",
    "negative_control",
    "proves",
]
MUSCLE_KEYS += ["quick", "reference", "title", "unsolved"]
SCENE = """
title = "A bar"
proves = "that scenes are read"

[muscle]
surface = "bar.ply"
unit = "cm"
tet_size = "2 cm"

[[bone]]
name = "wall"
surface = "wall.ply"
unit = "mm"

[[bone]]
name = "lever"
surface = "lever.ply"
unit = "mm"
motion.axis = [0, 0, 2]
motion.centre = "1, 2, 3 cm"
motion.keyframes = [{ frame = 0, angle = "0 deg" }, { frame = 10, angle = "90 deg" }]

[[attachment]]
name = "start"
bone = "wall"
within = "2 mm"

[[attachment]]
name = "end"
bone = "lever"
vertices = { file = "end.csv", value = 2 }

[[effect]]
name = "neo_hooke"
mu = "30 kPa"

[[effect]]
name = "incompressible"
bulk = "30 MPa"

[fibres.traced]
count = 3
start = "start"
end = "end"

[frames]
first = 0
last = 20
every = 5
interval = "0.02 s"

[reference]
solver = "fenicsx"
newton_iterations = 20

[[candidate]]
name = "fast"
solver = "pbd"
stretch = 1.0

[[expect]]
of = "reference"
metric = "volume"
statistic = "deviation"
frame = "any"
truth = "0 %"
within = "1 %"
kind = "property"
because = "it is nearly incompressible"

[negative_control]
key = "effect[1].bulk"
value = "40 kPa"
because = "it is compressible then"
"""
# Solvers check their own settings.
OPTIONAL = ("interval", "newton_iterations", "stretch", "statistic", 'frame = "any"')
NEEDED = list(dict.fromkeys(line for line in SCENE.splitlines() if " = " in line and not line.startswith(OPTIONAL)))
FILES = ("bar.ply", "wall.ply", "lever.ply", "end.csv")
TITLE = {"key": "title", "value": "another", "because": "it is another"}
ROD = {"start": "0, 0, 0 mm", "end": "0, 3, 4 cm", "radius": "2 mm"}
TURN = {
    "axis": [0, 0, 2],
    "centre": "1, 2, 3 cm",
    "keyframes": [{"frame": 0, "angle": "0 deg"}, {"frame": 9, "angle": "1 deg"}],
}
SLIDE = {"direction": [0, -3, 0], "keyframes": [{"frame": 0, "distance": "0 mm"}, {"frame": 9, "distance": "1 cm"}]}
RAMP = [{"frame": 0, "amount": 0}, {"frame": 10, "amount": 1}]
PRESSURE = {"name": "pressure", "on": "free", "pressure": "1 kPa", "ramp": RAMP}
POLYLINES = {"file": "fibres.vtk", "unit": "mm"}
OUTLINE = {"file": "marks.csv", "unit": "mm", "clouds": ["a", "b"], "reach": "3 mm"}


@pytest.fixture
def bar(tmp_path: Path) -> Path:
    """A scene folder called ``bar`` with its files."""
    folder = tmp_path / "bar"
    folder.mkdir()
    (folder / "case.toml").write_text(SCENE, encoding="utf-8")
    for name in (*FILES, "fibres.vtk", "marks.csv"):
        (folder / name).write_text(f"content of {name}", encoding="utf-8")
    return folder


def edited(folder: Path, old: str, new: str) -> Path:
    assert old in SCENE
    (folder / "case.toml").write_text(SCENE.replace(old, new, 1), encoding="utf-8")
    return folder


# Reading scenes


def test_scene_has_what_the_file_says(bar: Path) -> None:
    scene = casefile.read(bar)
    assert (scene.name, scene.folder, scene.place) == ("bar", bar.resolve(), str(bar.resolve() / "case.toml"))
    assert (scene.muscle.unit, scene.muscle.tet_size) == pytest.approx((10.0, 20.0))
    assert scene.bone[0].motion is None
    assert scene.bone[1].motion is not None
    assert scene.bone[1].motion.poses() == Rotation(
        (0.0, 0.0, 2.0), (10.0, 20.0, 30.0), (0.0, 10.0), (0.0, pytest.approx(math.pi / 2))
    )
    assert scene.bone[1].motion.centre == pytest.approx((10.0, 20.0, 30.0))
    assert [effect.model_dump() for effect in scene.effects] == [
        {"mu": pytest.approx(0.03)},
        {"bulk": pytest.approx(30.0)},
    ]
    assert scene.frames.numbers == (0, 5, 10, 15, 20)
    assert scene.reference.settings == {"newton_iterations": 20}
    assert scene.candidate[0].settings == {"stretch": 1.0}


def test_folder_and_file_are_the_same_scene(bar: Path) -> None:
    assert casefile.read(bar) == casefile.read(bar / "case.toml") == casefile.read(str(bar))


def test_loads_of_a_kind_act_on_different_parts(bar: Path) -> None:
    tables = [{"name": "neo_hooke", "mu": "1 kPa"}, PRESSURE, PRESSURE | {"on": "end"}]
    scene = changed(bar, "effect", tables)
    assert [effect.title for effect in scene.effects] == ["NeoHooke", "Pressure on free", "Pressure on end"]
    assert scene.key != changed(bar, "effect", tables[:2]).key


def test_candidates_may_be_none(bar: Path) -> None:
    start, end = SCENE.index("[[candidate]]"), SCENE.index("[[expect]]")
    assert casefile.read(edited(bar, SCENE[start:end], "")).candidate == ()


FORMS = [
    ({"half_space": {"point": "1, 2, 3 cm", "normal": [0, 2, 0]}}, HalfSpace((10, 20, 30), (0, 2, 0))),
    ({"box": {"centre": "0, 0, 1 mm", "size": "4, 1, 4 cm"}}, Box((0, 0, 1), (40, 10, 40), 0)),
    ({"box": {"centre": "0, 0, 1 mm", "size": "4, 1, 4 cm", "rounding": "5 mm"}}, Box((0, 0, 1), (40, 10, 40), 5)),
    ({"sphere": {"centre": "0, 0, 1 mm", "radius": "3 cm"}}, Sphere((0, 0, 1), 30)),
    ({"capsule": ROD}, Capsule((0, 0, 0), (0, 30, 40), 2)),
    ({"cylinder": ROD}, Cylinder((0, 0, 0), (0, 30, 40), 2)),
]


@pytest.mark.parametrize(("table", "body"), FORMS, ids=lambda entry: type(entry).__name__)
def test_a_bone_may_have_a_closed_form(bar: Path, table: dict[str, object], body: Obstacle) -> None:
    scene = changed(bar, "bone[0]", {"name": "wall"} | table)
    assert solid(scene.bone[0]) == body
    assert solid(scene.bone[1]) is None


def test_a_bone_may_slide(bar: Path) -> None:
    motion = changed(bar, "bone[1].motion", SLIDE).bone[1].motion
    assert motion is not None
    assert motion.poses() == Translation((0.0, -3.0, 0.0), (0.0, 9.0), (0.0, 10.0))


def test_what_the_first_case_shows_in_comments_can_be_read(bar: Path) -> None:
    comments = [
        line[2:] for line in (HOME / "cases/hip_flexion/case.toml").read_text().splitlines() if line[:2] == "# "
    ]
    shown = [line for line in comments if line.split(" = ")[0] in CLOSED_FORMS]
    assert len(shown) == len(CLOSED_FORMS)
    for line in shown:
        assert solid(changed(bar, "bone[0]", {"name": "wall"} | tomllib.loads(line)).bone[0]) is not None
    slide = "\n".join(line for line in comments if line.split(" = ")[0] in ("direction", "keyframes"))
    assert changed(bar, "bone[1].motion", tomllib.loads(slide)).bone[1].motion is not None
    meshers = [line for line in comments if line.startswith("mesher = ")]
    muscle = {"surface": "bar.ply", "unit": "cm", "tet_size": "2 cm"} | tomllib.loads(meshers[0])
    assert changed(bar, "muscle", muscle).muscle.mesher == "block"


def test_attachments_may_be_none(bar: Path) -> None:
    start, end = SCENE.index("[[attachment]]"), SCENE.index("[[effect]]")
    text = SCENE[:start] + SCENE[end:]
    with pytest.raises(InputError, match=r'fibres.traced.start: got "start", want a name that is there: there is none'):
        casefile.read(written(bar, text))
    traced = text[text.index("[fibres.traced]") : text.index("[frames]")]
    lines = 'fibres.polylines = { file = "fibres.vtk", unit = "mm" }\n'
    text = lines + text.replace(traced, "")
    with pytest.raises(InputError, match=r"case.toml: attachment: got none, want an attachment, .* or the effect"):
        casefile.read(written(bar, text))
    slow = '[[effect]]\nname = "damping"\ncoefficient = "1 Pa s/mm^2"\n\n[frames]'
    assert casefile.read(written(bar, text.replace("[frames]", slow))).attachment == ()


def written(folder: Path, text: str) -> Path:
    (folder / "case.toml").write_text(text, encoding="utf-8")
    return folder


NAN, INF = math.nan, math.inf
WRONG = [
    # key, what stands there instead, what the message says
    ("muscle.unit", "2 mm", 'muscle.unit: got "2 mm", want a unit of length'),
    ("muscle.tet_size", "2 kPa", 'muscle.tet_size: got "2 kPa", want a length with its unit, such as "2 mm"'),
    ("muscle.tet_size", "0 mm", 'muscle.tet_size: got "0 mm", want more than zero'),
    ("muscle.tet_size", 2.0, "muscle.tet_size: got 2.0, want a length"),
    ("effect[0].mu", "30 mm", 'effect[0].mu: got "30 mm", want a pressure with its unit, such as "30 kPa"'),
    ("effect[0].mu", "-30 kPa", 'effect[0].mu: got "-30 kPa", want more than zero'),
    (
        "effect[0].name",
        "hooke",
        'effect[0].name: got "hooke", want one of active_tension, contact, damping, fibre_active',
    ),
    ("effect", ["hooke"], 'effect[0].name: got "hooke", want one of active_tension, contact, damping, fibre_active'),
    ("effect", "hooke", 'effect: got "hooke", want'),
    ("effect", [], "effect: got [], want"),
    ("effect[1]", {"name": "neo_hooke", "mu": "1 kPa"}, 'effect[1].name: got "neo_hooke" a second time, want every'),
    ("effect[1]", PRESSURE | {"on": "top"}, 'effect[1].on: got "top", want one of start, end, free'),
    (
        "effect[0]",
        PRESSURE | {"ramp": [{"frame": 0, "amount": 0.5}]},
        "effect[0].ramp: got an amount of 0.5 at frame 0, the first, want 0 there, where the muscle rests",
    ),
    ("effect", [PRESSURE, PRESSURE], 'effect[1].name: got "pressure" on "free" a second time, want every effect once'),
    ("attachment[0].name", "free", 'attachment: got the name "free" twice, want every name once'),
    ("bone[1].motion.axis", [0, 0, 0], "bone[1].motion.axis: got [0, 0, 0], want an axis that is not zero"),
    ("bone[1].motion.axis", [1e-320, 0, 0], "bone[1].motion.axis: got [1e-320, 0, 0], want an axis that is not zero"),
    ("bone[1].motion.axis", [1e200, 0, 0], "want an axis that is not zero, with a length from 1e-9 to 1e9"),
    ("bone[1].motion.axis", [NAN, 0, 0], "bone[1].motion.axis[0]: got nan, want a finite number"),
    ("bone[1].motion.axis", [0, INF, 0], "bone[1].motion.axis[1]: got inf, want a finite number"),
    ("bone[1].motion.axis", ["1", "0", "0"], 'bone[1].motion.axis[0]: got "1", want a valid number'),
    ("bone[1].motion.keyframes[1].frame", NAN, "bone[1].motion.keyframes[1].frame: got nan, want a finite number"),
    ("bone[1].motion.keyframes[1].frame", "10", 'bone[1].motion.keyframes[1].frame: got "10", want a valid number'),
    ("muscle.tet_size", "1e-320 mm", 'muscle.tet_size: got "1e-320 mm", want at least 1e-30 mm'),
    ("muscle.tet_size", "mm", 'muscle.tet_size: got "mm", want a length with its unit'),
    ("title", 3, "title: got 3, want a valid string"),
    ("bone[1].motion.centre", "1, 2 mm", 'bone[1].motion.centre: got "1, 2 mm", want three lengths with one unit'),
    ("bone[1].motion.keyframes[1].frame", 0, "want keyframes in the order of their frames"),
    (
        "bone[1].motion.keyframes[1].angle",
        "90",
        'keyframes[1].angle: got "90", want an angle with its unit, such as "30 deg"',
    ),
    (
        "bone[1].motion.keyframes[0].angle",
        "1 deg",
        "bone[1].motion: got a bone turned at the first frame, want angle 0 there",
    ),
    (
        "muscle",
        {"surface": "bar.ply", "unit": "cm", "tet_size": "2 cm", "mesher": "gmsh"},
        'muscle.mesher: got "gmsh", want',
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
        "bone[1].motion",
        SLIDE | {"keyframes": [{"frame": 0, "distance": "2 mm"}, {"frame": 9, "distance": "1 mm"}]},
        "bone[1].motion: got a bone moved at the first frame, want distance 0 there",
    ),
    (
        "bone[0]",
        {"name": "wall", "cylinder": ROD, "capsule": ROD},
        'want exactly one of "surface", "half_space", "box", "sphere", "capsule", "cylinder"',
    ),
    ("bone[0]", {"name": "wall"}, "bone[0]: got {'name': 'wall'}, want exactly one of \"surface\", \"half_space\""),
    ("bone[0]", {"name": "wall", "surface": "wall.ply"}, "bone[0]: got {"),
    ("bone[0]", {"name": "wall", "surface": "wall.ply"}, 'want "unit" beside "surface" and only there'),
    ("bone[0]", {"name": "wall", "capsule": ROD, "unit": "mm"}, 'want "unit" beside "surface" and only there'),
    (
        "bone[0]",
        {"name": "wall", "capsule": ROD, "distance_error": "0.05 mm"},
        'want "distance_error" beside "surface" only: a closed form has none',
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
        'bone[0].cylinder.end: got "0, 0, 0 mm", want another point than the start',
    ),
    ("bone[1].name", "wall", 'bone: got the name "wall" twice, want every name once'),
    ("attachment[1].name", "start", 'attachment: got the name "start" twice, want every name once'),
    ("candidate[0].name", "reference", 'candidate: got the name "reference" twice, want every name once'),
    ("candidate[0].name", "a/b", 'candidate[0].name: got "a/b", want'),
    ("attachment[1].bone", "ulna", 'attachment[1].bone: got "ulna", want one of wall, lever'),
    ("attachment[1]", {"name": "end", "bone": "lever"}, 'want exactly one of "vertices", "within", "outline"'),
    ("attachment[0]", {"name": "a", "bone": "wall", "within": "2 mm", "outline": OUTLINE}, "want exactly one of"),
    ("fibres.traced.start", "middle", 'fibres.traced.start: got "middle", want one of start, end'),
    ("fibres.traced.end", "middle", 'fibres.traced.end: got "middle", want one of start, end'),
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
    ("expect[0].of", "slow", 'expect[0].of: got "slow", want one of reference, candidates, fast'),
    ("expect[0].kind", "hope", 'expect[0].kind: got "hope", want'),
    ("expect[0].frame", "last", 'expect[0].frame: got "last", want'),
    ("expect[0].frame", True, "expect[0].frame: got True, want"),
    ("negative_control.key", "nonsense.key", 'negative_control.key: got "nonsense.key", want a key of this scene'),
    ("negative_control.key", "", 'negative_control.key: got "", want a key of this scene'),
    ("negative_control.key", "effect[\u00b2].bulk", "want a key of this scene"),
    (
        "negative_control.key",
        "negative_control.because",
        'negative_control.value: got "40 kPa", want a value that changes negative_control.because',
    ),
    (
        "negative_control.value",
        "30000 kPa",
        'negative_control.value: got "30000 kPa", want a value that changes effect[1].bulk',
    ),
    (
        "negative_control.value",
        "5 mm",
        'negative_control.value: got "5 mm", want a value that can be read (effect[1].bulk: got "5 mm", want',
    ),
    (
        "negative_control.value",
        5,
        "negative_control.value: got 5, want a value that can be read (effect[1].bulk: got 5, want a pressure",
    ),
    ("negative_control", TITLE, 'negative_control.key: got "title", want a key that changes what is solved'),
    (
        "negative_control",
        TITLE | {"key": "expect[0].truth", "value": "9 %"},
        'key: got "expect[0].truth", want a key that',
    ),
    (
        "negative_control",
        TITLE | {"key": "candidate[0].stretch", "value": 0.5},
        'key: got "candidate[0].stretch", want a',
    ),
    ("negative_control.value", True, "negative_control.value: got True, want"),
    ("negative_control.value", NAN, "negative_control.value: got nan, want"),
]


@pytest.mark.parametrize(("key", "value", "message"), WRONG, ids=lambda entry: str(entry)[:40])
def test_wrong_value_names_file_and_key(bar: Path, key: str, value: object, message: str) -> None:
    with pytest.raises(InputError) as caught:
        casefile.read(bar, changes={key: value})
    assert str(caught.value).startswith(str(bar.resolve() / "case.toml") + ": ")
    assert message in str(caught.value)


def test_a_negative_control_changes_what_is_judged(bar: Path) -> None:
    # What changes the time only, or a run that nothing is expected of, turns no verdict.
    control = {"key": "reference.ranks", "value": 2, "because": "it is faster"}
    with pytest.raises(InputError, match=r'negative_control\.key: got "reference\.ranks", want a key that changes'):
        casefile.read(bar, changes={"reference.ranks": 1, "negative_control": control})
    edited(bar, 'key = "effect[1].bulk"\nvalue = "40 kPa"', 'key = "title"\nvalue = "another"')
    for wrong in (True, False):
        with pytest.raises(InputError, match=r'negative_control\.key: got "title"'):
            casefile.read(bar, with_negative_control=wrong)
    control = {"key": "candidate[0].stretch", "value": 0.5, "because": "it is softer"}
    for of in ("fast", "candidates"):
        read = casefile.read(bar, changes={"expect[0].of": of, "negative_control": control})
        assert read.negative_control.key == control["key"]


@pytest.mark.parametrize("line", NEEDED)
def test_every_key_is_needed(bar: Path, line: str) -> None:
    with pytest.raises(InputError, match=r"case\.toml: "):
        casefile.read(edited(bar, line + "\n", ""))


@pytest.mark.parametrize(
    ("table", "place", "known"),
    [
        (
            'title = "A bar"\n',
            "colour",
            ", ".join(MUSCLE_KEYS),
        ),
        ("[muscle]\n", "muscle.colour", "mesher, refinements, surface, tet_size, unit"),
        (
            "[[bone]]\n",
            "bone[0].colour",
            "box, capsule, cylinder, distance_error, distance_rounding, half_space, motion, name, sphere, surface, unit",
        ),
        ("[[attachment]]\n", "attachment[0].colour", "bone, name, outline, stiffness, vertices, within"),
        ("[[effect]]\n", "effect[0].colour", "mu"),
        ("[fibres.traced]\n", "fibres.traced.colour", "count, end, start"),
        ("[frames]\n", "frames.colour", "every, first, interval, last"),
        ("[[expect]]\n", "expect[0].colour", "because, frame, kind, metric, of, statistic, truth, within"),
        ("[negative_control]\n", "negative_control.colour", "because, key, value"),
    ],
)
def test_unknown_key_is_reported_the_known_ones(bar: Path, table: str, place: str, known: str) -> None:
    with pytest.raises(InputError) as caught:
        casefile.read(edited(bar, table, table + 'colour = "red"\n'))
    assert f"case.toml: {place}: got an unknown key, want one of {known}" in str(caught.value)


@pytest.mark.parametrize("key", ["name", "folder"])
def test_what_the_folder_says_is_no_key(bar: Path, key: str) -> None:
    with pytest.raises(InputError, match=rf"case\.toml: {key}: got an unknown key, want one of attachment, "):
        casefile.read(edited(bar, 'title = "A bar"\n', f'title = "A bar"\n{key} = "hip_flexion"\n'))


@pytest.mark.parametrize(("number", "printed"), [("nan", "nan"), ("inf", "inf"), ("-inf", "-inf")])
def test_numbers_of_a_file_are_finite(bar: Path, number: str, printed: str) -> None:
    with pytest.raises(InputError, match=rf"axis\[2\]: got {printed}, want a finite number"):
        casefile.read(edited(bar, "axis = [0, 0, 2]", f"axis = [0, 0, {number}]"))


@pytest.mark.parametrize("text", [b"title = ", b"\xff\xfe"])
def test_text_that_is_no_toml(bar: Path, text: bytes) -> None:
    (bar / "case.toml").write_bytes(text)
    with pytest.raises(InputError, match="want a TOML file"):
        casefile.read(bar)


def test_case_that_is_not_there() -> None:
    with pytest.raises(InputError, match=r'CASE: got "nowhere", want a scene file, .* one of .*hip_flexion'):
        casefile.read("nowhere")


# Changes and the negative control


def test_changes_replace_values(bar: Path) -> None:
    changed = casefile.read(
        bar, changes={"frames.last": 10, "effect[0].mu": "1 kPa", "bone[1].motion.keyframes[1].angle": "1 rad"}
    )
    assert changed.frames.numbers == (0, 5, 10)
    assert changed.effects[0] == casefile.read(bar, changes={"effect[0].mu": "0.001 MPa"}).effects[0]
    assert changed.bone[1].motion is not None
    assert changed.bone[1].motion.keyframes[1].angle == 1.0
    assert casefile.read(bar).frames.last == 20


def test_a_change_may_add_what_is_optional(bar: Path) -> None:
    assert casefile.read(bar, changes={"frames.interval": "10 ms"}).frames.interval == 0.01
    with pytest.raises(
        InputError, match=r"frames.intervall: got an unknown key, want interval, or another one of every"
    ):
        casefile.read(bar, changes={"frames.intervall": "10 ms"})


def test_all_that_is_wrong_with_keys_is_said_at_once(bar: Path) -> None:
    path = bar / "case.toml"
    path.write_text(path.read_text().replace("tet_size", "tetsize").replace('title = "A bar"\n', ""))
    with pytest.raises(InputError) as raised:
        casefile.read(bar)
    first, *others = str(raised.value).splitlines()
    assert "muscle.tetsize: got an unknown key, want tet_size, or another one of" in first
    assert sorted(line.split("case.toml: ")[1] for line in others) == [
        "muscle.tet_size: got nothing, want this key",
        "title: got nothing, want this key",
    ]


@pytest.mark.parametrize("key", ["", "effect[7].mu", "effect.mu", "frames.last.more", "title[0]"])
def test_change_of_a_key_that_is_not_there(bar: Path, key: str) -> None:
    with pytest.raises(InputError, match="got nothing, want a key that this scene has"):
        casefile.read(bar, changes={key: 1})


def test_a_change_that_leads_nowhere_says_what_there_is(bar: Path) -> None:
    for key, wanted in {
        "bone.lid.unit": r"; there are bone\[0\] \(\w+\), bone\[1\] \(\w+\)$",
        "muscle.size.more": r"; there are surface, unit, tet_size",
        "frames.last.more": r"a table that it has$",
    }.items():
        with pytest.raises(InputError, match=wanted):
            casefile.read(bar, changes={key: 1})


def test_negative_control_changes_one_key(bar: Path) -> None:
    assert casefile.read(bar, with_negative_control=True) == casefile.read(bar, changes={"effect[1].bulk": "40 kPa"})


def test_negative_control_that_is_missing(bar: Path) -> None:
    with pytest.raises(InputError, match=r"case.toml: negative_control: got None"):
        casefile.read(edited(bar, SCENE[SCENE.index("[negative_control]") :], ""), with_negative_control=True)


def test_negative_control_is_tried_on_reading(bar: Path) -> None:
    with pytest.raises(InputError, match=r"case\.toml: negative_control\.key: got .*want a key of this scene"):
        casefile.read(edited(bar, 'key = "effect[1].bulk"', 'key = "effect[2].bulk"'))


def test_negative_control_may_be_a_number(bar: Path) -> None:
    file = edited(bar, 'key = "effect[1].bulk"\nvalue = "40 kPa"', 'key = "frames.last"\nvalue = 15')
    assert casefile.read(file, with_negative_control=True).frames.last == 15


def test_changes_may_take_away_what_the_negative_control_changes(bar: Path) -> None:
    changes = {"effect": [{"name": "neo_hooke", "mu": "1 kPa"}]}
    assert len(casefile.read(bar, changes=changes).effects) == 1
    with pytest.raises(InputError, match=r"negative_control\.key: got .*, want a key of this scene"):
        casefile.read(bar, changes=changes, with_negative_control=True)


@pytest.mark.parametrize("inside", [True, False])
def test_cases_inside_the_package_come_before_those_beside_it(tmp_path: Path, inside: bool) -> None:
    package = tmp_path / "site-packages" / "fem_reference"
    for folder in (package.parent, *([package] if inside else [])):
        (folder / "cases").mkdir(parents=True)
    assert home(package) == (package if inside else package.parent)


# Files


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


# The key

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


def changed(folder: Path, key: str, value: object) -> MuscleCase:
    if key == "bone[0].name":
        return casefile.read(folder, changes={key: value, "attachment[0].bone": value})
    return casefile.read(folder, changes={key: value})


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


# The shipped cases


@pytest.mark.parametrize("case", casefile.cases())
def test_shipped_case_reads_and_its_files_exist(case: str) -> None:
    text = (HOME / "cases" / case / "case.toml").read_text(encoding="utf-8")
    if '"data:' in text and DATA_SETTING not in os.environ:
        pytest.skip(f"its anatomy is in {DATA_SETTING}, which is not set")
    scene = casefile.read(case)
    assert scene.name == case
    assert scene.expect, "a shipped case shows that its numbers are right"
    assert scene.negative_control, "and that they could be wrong"
    assert casefile.read(case, changes=scene.quick).quick == scene.quick
    changed = casefile.read(case, with_negative_control=True)
    assert len(scene.key) == 64
    assert (changed.key, changed.candidate) != (scene.key, scene.candidate)
    for i, candidate in enumerate(scene.candidate):
        if "folder" in candidate.settings:
            assert scene.file(candidate.settings["folder"], f"candidate[{i}].folder").is_dir()


def test_every_folder_of_cases_is_a_case() -> None:
    folders = sorted(path.name for path in (HOME / "cases").iterdir() if path.is_dir())
    assert casefile.cases() == [name for name in folders if name != "hard"]  # which has those of the verb stress


def test_a_case_of_ones_own_may_expect_nothing(bar: Path) -> None:
    file = edited(bar, SCENE[SCENE.index("[[expect]]") :], "")
    scene = casefile.read(file)
    assert (scene.expect, scene.negative_control) == ((), None)
    assert scene.key == casefile.read(file, changes={"title": "x"}).key


def test_the_key_of_a_scalar_case_follows_what_determines_its_solution(tmp_path: Path) -> None:
    folder = Path(shutil.copytree(HOME / "cases" / "plate_square", tmp_path / "plate"))
    before = casefile.read(folder).key
    assert before == casefile.read("plate_square").key
    for key, value in {"title": "x", "candidate[0].solver": "scikit_fem", "expect[0].within": 1.0}.items():
        assert casefile.read(folder, changes={key: value}).key == before
    others = {"effect[0].coefficient": 2.0, "element.order": 2, "domain.mesh.triangles": "delaunay"}
    keys = [casefile.read(folder, changes={key: value}).key for key, value in others.items()]
    for name in ("points.csv", "tri.csv", "bounds.csv"):
        text = (folder / name).read_text(encoding="utf-8")
        (folder / name).write_text(text + "\n", encoding="utf-8")
        keys.append(casefile.read(folder).key)
        (folder / name).write_text(text, encoding="utf-8")
    assert len({before, *keys}) == 1 + len(keys)
