"""The case of a muscle: its muscle, attachments, fibres and frames; each mistake is named with its key."""

from pathlib import Path

import pytest

from fem_reference.foundations.errors import InputError
from fem_reference.scenes import casefile
from fem_reference.scenes.muscle import MOST_FRAMES, Frames
from tests.scenes.bars import OUTLINE, PRESSURE, SCENE, changed, refused, written

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
    with pytest.raises(InputError, match=r'fibres.traced.start: got "start", want a name that is there: there is none'):
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
    scene = changed(bar, "effect", tables)
    assert [effect.title for effect in scene.effects] == ["NeoHooke", "Pressure on free", "Pressure on end"]
    assert scene.key != changed(bar, "effect", tables[:2]).key


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
