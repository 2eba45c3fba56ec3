"""Small scenes at random, by a seed: a bar between two bones, with fibres parallel, oblique or curved, and what acts on it."""

from pathlib import Path

import numpy as np
import shapes

from fem_reference.foundations.mesh import Floats, Polylines
from fem_reference.io import files
from fem_reference.scenes import casefile
from fem_reference.scenes.muscle import MuscleCase

LENGTH, WIDTH, AREA = 40.0, 10.0, 100.0  # of the bar [mm, mm, mm2]
# What a scene may have besides its material: few sets, as each subset of one is compiled.
KINDS = {
    "held": ("active_tension", "fibre_passive"),
    "loaded": ("active_tension", "gravity", "pressure"),
    "moved": ("active_tension", "fibre_passive", "damping", "contact"),
    "shaken": ("active_tension", "gravity", "damping"),
}

TEXT = """
effects = "{choice}"
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
{effects}
[fibres]
polylines = {{ file = "fibres.vtp", unit = "mm" }}

[frames]
first = 0
last = 4
every = {every}
interval = "{interval:.4g} s"

[reference]
solver = "fenicsx"
element = "P2"
first_step = 4
store_state = {states}

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

EFFECTS = {
    "active_tension": """
[[effect]]
name = "active_tension"
tension = "300 kPa"
ramp = [{{ frame = 0, amount = 0.0 }}, {{ frame = 4, amount = {activation:.4g} }}]
""",
    "fibre_passive": """
[[effect]]
name = "fibre_passive"
stress = "{passive:.4g} kPa"
p1 = 0.05
p2 = 6.6
optimal_stretch = {slack:.4g}
linear_from = 1.4
""",
    "gravity": """
[[effect]]
name = "gravity"
density = "{density:.4g} kg/m3"
acceleration = "{weight} m/s^2"
ramp = [{{ frame = 0, amount = 0.0 }}, {{ frame = 4, amount = 1.0 }}]
""",
    "pressure": """
[[effect]]
name = "pressure"
on = "free"
pressure = "{pressure:.4g} kPa"
ramp = [{{ frame = 0, amount = 0.0 }}, {{ frame = 4, amount = 1.0 }}]
""",
    "damping": """
[[effect]]
name = "damping"
coefficient = "{drag:.4g} kPa s/mm^2"
""",
    "contact": """
[[effect]]
name = "contact"
stiffness = "{contact:.4g} kPa/mm"
smoothing = "0.2 mm"
bones = ["ball"]
""",
}


def lines(slope: float, bow: float) -> Polylines:
    """Lines through the bar along its length, that lean by ``slope`` and bow sideways by ``bow`` [mm]; those that it does not hold
    are shorter.
    """
    along = np.linspace(0.5, LENGTH - 0.5, 30)
    found = []
    for x0 in np.arange(1.0 - slope * LENGTH, WIDTH, 3.0):
        for y in (2.5, 7.5):
            x = x0 + slope * along + bow * np.sin(np.pi * along / LENGTH)
            line = np.column_stack([x, np.full(len(x), y), along])[(x > 0.2) & (x < WIDTH - 0.2)]
            if len(line) > 4:
                found.append(line)
    return Polylines(np.concatenate(found), np.cumsum([0, *map(len, found)]))


def text(seed: int, choice: str = "auto") -> tuple[str, Polylines]:
    """A scene of the ``seed``, and its fibres."""
    rng = np.random.default_rng(seed)

    def between(low: float, high: float) -> float:
        """Spread evenly by the logarithm."""
        return float(np.exp(rng.uniform(np.log(low), np.log(high))))

    kind = list(KINDS)[seed % len(KINDS)]
    mu, radius, gap, angle = between(3, 50), rng.uniform(4, 8), between(0.3, 30), rng.uniform(0, 2 * np.pi)
    along = unit(rng.normal(size=3) * [1, 1, 0.5])
    along[2] = abs(along[2])  # a bar that is pushed together buckles
    side = WIDTH / 2 + radius + gap
    centre = (WIDTH / 2 + side * np.cos(angle), WIDTH / 2 + side * np.sin(angle), rng.uniform(12, 32))
    still = kind == "held" or (kind == "loaded" and rng.uniform() < 0.5)
    values = {
        "choice": choice,
        "direction": [float(x) for x in along],
        "distance": 0.0 if still else between(0.3, 12),
        "centre": ", ".join(f"{x:.4f}" for x in centre),
        "radius": radius,
        "mu": mu,
        "bulk": 1000 * mu,
        "activation": 0.0 if rng.uniform() < 0.15 else between(1e-5, 0.3),
        "passive": between(30, 600),
        "slack": rng.uniform(1.0, 1.1),
        "density": between(1e-3, 1e5),
        "weight": ", ".join(f"{9.81 * x:.4f}" for x in unit(rng.normal(size=3))),
        "pressure": between(1e-4, 0.3) * mu,
        "drag": mu * between(1e-7, 1e-3),
        "contact": 50 * mu,
        "interval": between(0.01, 1),
        "states": "true",
        "every": 2 if kind in ("moved", "shaken") else 4,
    }
    values["effects"] = "".join(EFFECTS[name] for name in KINDS[kind]).format(**values)
    shape = rng.integers(3)  # parallel, oblique, curved
    fibres = lines(np.tan(rng.uniform(0.17, 0.6)) if shape == 1 else 0.0, rng.uniform(1, 3) if shape == 2 else 0.0)
    return TEXT.format(**values), fibres


def unit(vector: Floats) -> Floats:
    """A vector of length 1."""
    return np.asarray(vector / np.linalg.norm(vector))


def scene(folder: Path, seed: int, choice: str = "auto") -> MuscleCase:
    """A scene of the ``seed`` in ``folder``: whether and how bones move, what acts and how much, stiffness and fibres at random."""
    return write(folder, *text(seed, choice))


def write(folder: Path, case: str, fibres: Polylines) -> MuscleCase:
    """The scene of a ``case`` in ``folder``."""
    folder.mkdir(parents=True)
    skin = shapes.skin(shapes.box((2, 2, 8), (WIDTH, WIDTH, LENGTH)))
    files.write_surface(folder / "bar.vtp", skin, skin.points)
    files.write_polylines(folder / "fibres.vtp", fibres, fibres.points)
    (folder / "case.toml").write_text(case, encoding="utf-8")
    return casefile.read_muscle(folder)
