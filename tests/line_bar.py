"""A bar with two fibres, and its lines of action."""

import math
from dataclasses import replace

import numpy as np
import shapes

from fem_reference.foundations.mesh import Polylines
from fem_reference.foundations.motion import RigidMotion
from fem_reference.foundations.records import parse
from fem_reference.problems.muscle import MuscleProblem
from fem_reference.problems.setup import Joint
from fem_reference.runs.store import Frame, Outcome
from fem_reference.solvers import line_of_action

SWING = RigidMotion((1, 0, 0), (5, 25, 15), (0.0, 10.0), (0.0, 1.2))


def bar(motion=SWING, points: int = 41, bottom=None) -> MuscleProblem:
    """The bar of the contract, 30 mm long, with one fibre of many points that is bent at rest, and one straight."""
    given = shapes.bar((2, 2, 4), (10, 10, 30), {"bottom": bottom, "top": motion}, (), (0, 5, 10))
    heights = np.linspace(0, 30, points)
    bent = np.column_stack([np.full(points, 5.0), 5 + 4 * np.sin(math.pi * heights / 30), heights])
    straight = np.column_stack([np.full(points, 4.0), np.full(points, 5.0), heights[::-1]])
    counter = Joint(
        "counter", given.bones[0], np.array([1.0, 0, 0]), np.zeros(3), float
    )  # its angle is the frame's number
    fibres = Polylines(np.vstack([bent, straight]), np.array([0, points, 2 * points]))
    return replace(given, fibres=fibres, joints=(counter,))


def solved(given: MuscleProblem, **settings: object) -> tuple[Outcome, list[Frame]]:
    frames: list[Frame] = []
    record = parse(line_of_action.LineSettings, settings, "candidate[0]")
    return line_of_action.solve(given, record, frames.append), frames


def lengths(given: MuscleProblem, frames: list[Frame]) -> np.ndarray:
    return np.array([given.fibres.lengths(frame.fibres) for frame in frames])
