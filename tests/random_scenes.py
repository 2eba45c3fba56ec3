"""Small scenes at random, by a seed: a bar between two bones of which one moves, and a third bone somewhere beside it."""

from pathlib import Path

import numpy as np
import shapes

from fem_reference.io import files
from fem_reference.scenes import casefile
from fem_reference.scenes.muscle import MuscleCase

TEXT = """
effects = "auto"
title = "A bar at random"
proves = "which effects a scene needs"

[muscle]
surface = "bar.vtp"
unit = "mm"
tet_size = "5 mm"
mesher = "block"

[[bone]]
name = "floor"
box = {{ centre = "5, 5, -5 mm", size = "30, 30, 9 mm", rounding = "1 mm" }}

[[bone]]
name = "lid"
box = {{ centre = "5, 5, 45 mm", size = "30, 30, 9 mm", rounding = "1 mm" }}

[bone.motion]
direction = {direction}
keyframes = [{{ frame = 0, distance = "0 mm" }}, {{ frame = 4, distance = "{distance:.4g} mm" }}]

[[bone]]
name = "ball"
sphere = {{ centre = "{centre} mm", radius = "{radius:.4g} mm" }}

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
mu = "{mu:.4g} kPa"

[[effect]]
name = "incompressible_penalty"
bulk = "{bulk:.4g} kPa"

[[effect]]
name = "active_tension"
tension = "300 kPa"
ramp = [{{ frame = 0, amount = 0.0 }}, {{ frame = 4, amount = {activation:.4g} }}]

[[effect]]
name = "damping"
coefficient = "{drag:.4g} kPa s/mm^2"

[[effect]]
name = "contact"
stiffness = "{contact:.4g} kPa/mm"
smoothing = "0.2 mm"
bones = ["ball"]

[fibres]
traced = {{ count = 4, start = "origin", end = "insertion" }}

[frames]
first = 0
last = 4
every = 4
interval = "{interval:.4g} s"

[reference]
solver = "fenicsx"
element = "P2"
first_step = 4

[[expect]]
of = "reference"
metric = "volume"
statistic = "deviation"
frame = "any"
truth = "0 %"
within = "5 %"
kind = "property"
because = "the bulk modulus is large"

[negative_control]
key = "effect[1].bulk"
value = "{mu:.4g} kPa"
because = "a body that yields loses volume"
"""


def scene(folder: Path, seed: int) -> MuscleCase:
    """A scene of the ``seed`` in ``folder``: at random distance of the ball, speed, stiffness and activation."""
    rng = np.random.default_rng(seed)

    def between(low: float, high: float) -> float:
        """Spread evenly by the logarithm."""
        return float(np.exp(rng.uniform(np.log(low), np.log(high))))

    folder.mkdir(parents=True)
    skin = shapes.skin(shapes.box((2, 2, 8), (10, 10, 40)))
    files.write_surface(folder / "bar.vtp", skin, skin.points)
    mu, radius, gap, angle = between(3, 50), rng.uniform(4, 8), between(0.3, 30), rng.uniform(0, 2 * np.pi)
    along = rng.normal(size=3) * [1, 1, 0.5]
    along[2] = abs(along[2])  # a bar that is pushed together buckles
    side = 5 + radius + gap
    centre = (5 + side * np.cos(angle), 5 + side * np.sin(angle), rng.uniform(12, 32))
    values = {
        "direction": [float(x) for x in along / np.linalg.norm(along)],
        "distance": between(1, 12),
        "centre": ", ".join(f"{x:.4f}" for x in centre),
        "radius": radius,
        "mu": mu,
        "bulk": 1000 * mu,
        "activation": between(1e-5, 0.3),
        "drag": mu * between(1e-7, 1e-3),
        "contact": 50 * mu,
        "interval": between(0.01, 1),
    }
    (folder / "case.toml").write_text(TEXT.format(**values), encoding="utf-8")
    return casefile.read_muscle(folder)
