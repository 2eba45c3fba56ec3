"""A small scene on disk: a bar between two plates, one of which turns there and back. Solved in a few seconds."""

from pathlib import Path

import numpy as np
import shapes

from fem_reference.foundations.mesh import Floats, Surface
from fem_reference.foundations.motion import apply
from fem_reference.io import files

CASE = """
title = "A bar between two plates"
proves = "the steps from a scene file to a page"

[muscle]
surface = "bar.vtp"
unit = "mm"
tet_size = "6 mm"

[[bone]]
name = "floor"
surface = "floor.vtp"
unit = "mm"

[[bone]]
name = "lid"
surface = "lid.vtp"
unit = "mm"

[bone.motion]
axis = {axis}
centre = "{centre} mm"
keyframes = [{{ frame = 0, angle = "0 rad" }}, {{ frame = 10, angle = "0.4 rad" }}, {{ frame = 20, angle = "0 rad" }}]

[[attachment]]
name = "origin"
bone = "floor"
within = "1.5 mm"

[[attachment]]
name = "insertion"
bone = "lid"
within = "1.5 mm"

[[effect]]
name = "neo_hooke"
mu = "10 kPa"

[[effect]]
name = "incompressible"
bulk = "10 MPa"

[fibres]
traced = {{ count = 4, start = "origin", end = "insertion" }}

[frames]
first = 0
last = 20
every = 5

[reference]
solver = "fenicsx"
first_step = 5

[[candidate]]
name = "pbd"
solver = "pbd"
sub_iterations = 3
solver_iterations = 2
damping = 0.05
stretch = 1.0
volume = 1.0
bending = 0.5

[[expect]]
of = "reference"
metric = "volume"
statistic = "deviation"
frame = "any"
truth = "0 %"
within = "0.5 %"
kind = "property"
because = "the bulk modulus is 1000 times the shear modulus"

[negative_control]
key = "effect[1].bulk"
value = "10 kPa"
because = "a body that yields loses volume"
"""

# An effect more: fibres that are slack up to a stretch.
FIBRES = """
[[effect]]
name = "fibre_passive"
stress = "300 kPa"
p1 = 0.05
p2 = 6.6
optimal_stretch = {slack}
linear_from = 1.4
"""


def write(folder: Path, pose: Floats | None = None) -> Path:
    """The scene in ``folder``, as a whole moved by the 4 x 4 ``pose``; returns the folder."""
    pose = np.eye(4) if pose is None else pose
    folder.mkdir(parents=True, exist_ok=True)
    surfaces = {"bar": body(), "floor": plate(-1.0), "lid": plate(41.0)}
    for name, surface in surfaces.items():
        moved = surface.moved_to(apply(pose, surface.points))
        files.write_surface(folder / f"{name}.vtp", moved, moved.points)
    axis = [float(value) for value in pose[:3, :3] @ [1, 0, 0]]
    centre = ", ".join(repr(float(value)) for value in apply(pose, np.array([[5.0, 5, 30]]))[0])
    (folder / "case.toml").write_text(CASE.format(axis=axis, centre=centre))
    return folder


def body() -> Surface:
    """A bar 10 x 10 x 40 with bulging sides."""
    bar = shapes.skin(shapes.box((4, 4, 12), (10, 10, 40)))
    points = np.array(bar.points)
    swell = 1 + 0.3 * np.sin(np.pi * points[:, 2] / 40)
    points[:, :2] = 5 + (points[:, :2] - 5) * swell[:, None]
    return bar.moved_to(points)


def plate(z: float) -> Surface:
    """A flat box around height ``z``."""
    skin = shapes.skin(shapes.box((1, 1, 1), (30, 30, 1)))
    return skin.moved_to(skin.points + [-10, -10, z - 0.5])
