"""Scenes with ``effects = "auto"``: a bar whose lid turns, and one between plates that rest; and a stand-in that solves them."""

from pathlib import Path

import numpy as np
import pytest
import random_scenes
import small
import stand_ins

from fem_reference.runs.store import Frame, Outcome
from fem_reference.scenes import casefile
from fem_reference.scenes.muscle import MuscleCase
from fem_reference.solvers import fenicsx

CONTACT = '\n[[effect]]\nname = "contact"\nstiffness = "100 kPa/mm"\nsmoothing = "0.2 mm"\n'
ACTIVE = """
[[effect]]
name = "fibre_active"
stress = "300 kPa"
optimal_stretch = 1.0
ramp = [{ frame = 0, amount = 0.0 }, { frame = 4, amount = 1.0 }]
"""
# Of a scene of random_scenes.TEXT whose bones rest.
STILL = {
    "direction": [0, 0, 1],
    "distance": 0.0,
    "centre": "100, 0, 20",
    "radius": 5,
    "mu": 10,
    "bulk": 10_000,
    "every": 1,
    "interval": 1.0,
    "states": "false",
    "slack": 1.1,
    "passive": 300,
}
WEIGHT = """
[[effect]]
name = "gravity"
density = "{density} kg/m3"
acceleration = "0, 0, -9.81 m/s^2"
ramp = [{{ frame = 0, amount = 0.0 }}, {{ frame = 5, amount = 1.0 }}]
"""


def scene_of(folder: Path, more: str, choice: str = "auto"):
    case = small.write(folder / "bar")
    path = case / "case.toml"
    path.write_text(f'effects = "{choice}"\n{path.read_text()}{more}')
    return casefile.read_muscle(case)


def pennate(folder: Path, choice: str, effects: str = ACTIVE) -> MuscleCase:
    """A bar between two fixed plates with fibres at 25 degrees to its axis."""
    case = random_scenes.TEXT.format(**STILL, choice=choice, effects=effects).replace(
        "first_step = 4", "first_step = 1"
    )
    return random_scenes.write(folder, case, random_scenes.lines(np.tan(np.radians(25)), 0.0))


def solved_as(monkeypatch: pytest.MonkeyPatch, moved) -> list[list[str]]:
    """Let the reference put the surface and the tets where ``moved`` says for (points, frame); the effects of each solution."""
    made = []

    def solve(problem, _settings, sink) -> Outcome:
        made.append([effect.title for effect in problem.effects])
        for number in problem.frames:
            places = (
                moved(points, number) for points in (problem.surface.points, problem.fibres.points, problem.mesh.points)
            )
            sink(Frame(number, *places))
        return Outcome("converged", "done", {"seconds": 1.0})

    stand_ins.solve_by(monkeypatch, fenicsx, solve)
    return made
