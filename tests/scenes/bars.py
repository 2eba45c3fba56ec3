"""The scene of a bar between a wall and a lever, as text in a folder: read with other values, and refused."""

from pathlib import Path

import pytest

from fem_reference.foundations.errors import InputError
from fem_reference.scenes import casefile
from fem_reference.scenes.muscle import MuscleCase

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
FILES = ("bar.ply", "wall.ply", "lever.ply", "end.csv")
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


def edited(folder: Path, old: str, new: str) -> Path:
    assert old in SCENE
    (folder / "case.toml").write_text(SCENE.replace(old, new, 1), encoding="utf-8")
    return folder


def written(folder: Path, text: str) -> Path:
    (folder / "case.toml").write_text(text, encoding="utf-8")
    return folder


def changed(folder: Path, key: str, value: object) -> MuscleCase:
    if key == "bone[0].name":
        return casefile.read(folder, changes={key: value, "attachment[0].bone": value})
    return casefile.read(folder, changes={key: value})


def refused(folder: Path, key: str, value: object, message: str) -> None:
    """One message of the file and the ``message`` where ``key`` has another ``value``."""
    with pytest.raises(InputError) as caught:
        casefile.read(folder, changes={key: value})
    assert str(caught.value).startswith(str(folder.resolve() / "case.toml") + ": ")
    assert message in str(caught.value)
