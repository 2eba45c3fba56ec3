"""The second check of runs that a solver reports as converged: a correct run passes, and each kind of mistake is rejected."""

from collections.abc import Callable
from dataclasses import replace
from weakref import WeakKeyDictionary

import numpy as np
from scipy.spatial import cKDTree

from fem_reference import effects
from fem_reference.assessment.body_balance import balance
from fem_reference.assessment.catalogue import Entry, Finding, Lab
from fem_reference.assessment.run_checks import of_body, of_muscle
from fem_reference.foundations.records import parse
from fem_reference.geometry.rigid_bodies import Vector
from fem_reference.problems.muscle import MuscleProblem
from fem_reference.runs.store import Run
from fem_reference.studies.hard import blocks
from fem_reference.studies.hard.records import Hard
from fem_reference.verification.parts import control
from fem_reference.verification.touching import BLOCK_STIFFNESS, pressed_blocks

CORNER, FAR_SIDE = (0.0, 0.0, 0.0), (10.0, 5.0, 20.0)  # of the bar at rest [mm]; the corner is attached
Mistake = Callable[[MuscleProblem, Run], tuple[MuscleProblem, Run]]


def _slides(direction: list[float], distance: str) -> dict[str, object]:
    stops = [{"frame": 0, "distance": "0 mm"}, {"frame": 10, "distance": distance}]
    return {"direction": direction, "keyframes": stops}


def bar(ball: str = "2 mm") -> MuscleProblem:
    """A bar of 10 x 10 x 40 mm between two bones, one of which moves by 3 mm. A sphere of radius 3 mm moves into it by ``ball``."""
    ball_bone = {"sphere": {"centre": "-3.2, 5, 20 mm", "radius": "3 mm"}, "motion": _slides([1, 0, 0], ball)}
    hold = [{"face": "z0"}, {"face": "z1", "motion": _slides([0, 1, 0], "3 mm")}]
    table = {
        "title": "a bar",
        "healthy": "it passes",
        "bound": [{"quantity": "volume", "at_most": 1}],
        "block": {"size": "10, 10, 40 mm", "cells": [2, 2, 6]},
        "hold": hold,
        "bone": [{"name": "ball"} | ball_bone],
        "frames": {"first": 0, "last": 10, "every": 5},
    }
    contact = effects.make("contact", stiffness="100 kPa/mm", bones=("ball",))
    place = "the bar of the second check"
    acting = (*blocks.MATERIAL, contact)
    return blocks.problem(parse(Hard, table | {"name": "bar", "place": place, "effect": acting}, place))


_SOLVED = WeakKeyDictionary[Lab, tuple[MuscleProblem, Run]]()


def solved(lab: Lab) -> tuple[MuscleProblem, Run]:
    """The bar as a muscle problem, and its run, which is solved once for each lab."""
    if lab in _SOLVED:
        return _SOLVED[lab]
    problem = bar()
    found = lab.solve(problem.body, "P2/P1", first_step=5.0)
    _, nodes = cKDTree(problem.mesh.points).query(problem.surface.points)
    positions = np.array([state.points[nodes] for state in found.states])
    numbers = tuple(int(state.number) for state in found.states)
    pressures = np.array([state.scalars["contact_pressure"] for state in found.states])
    scalars = {"contact_pressure": pressures}
    _SOLVED[lab] = problem, Run("bar", "fenicsx", found.outcome, numbers, problem.surface, positions, scalars=scalars)
    return _SOLVED[lab]


def denials(lab: Lab, mistake: Mistake | None = None) -> Finding:
    """The number of checks that the run fails, after a deliberate ``mistake`` if one is given."""
    problem, run = solved(lab)
    lost = [str(one) for one in of_muscle(*(mistake(problem, run) if mistake else (problem, run))) if not one.met]
    return Finding(float(len(lost)), note="; ".join(lost))


def missing(problem: MuscleProblem, run: Run) -> tuple[MuscleProblem, Run]:
    """The run without its last frame."""
    return problem, replace(run, positions=run.positions[:2], numbers=run.numbers[:2])


def moved(frame: int, place: Vector, by: Vector) -> Mistake:
    """A mistake: in one ``frame``, the vertex that is at ``place`` at rest is displaced ``by`` a vector [mm]."""

    def mistake(problem: MuscleProblem, run: Run) -> tuple[MuscleProblem, Run]:
        positions = run.positions.copy()
        positions[frame, (problem.surface.points == place).all(axis=1)] += by
        return problem, replace(run, positions=positions)

    return mistake


MISTAKES = (
    ("order", "two frames exchanged", lambda it, run: (it, replace(run, positions=run.positions[[0, 2, 1]]))),
    ("frames", "its last frame missing", missing),
    ("finite", "a coordinate that is not a number", moved(2, CORNER, (0.0, np.nan, 0.0))),
    ("attached", "an attached vertex 0.01 mm off its bone", moved(1, CORNER, (0.01, 0.0, 0.0))),
    ("bone", "the sphere 3 mm deeper in the bar", lambda it, run: (replace(it, bones=bar("5 mm").bones), run)),
    ("itself", "a vertex of one side of the bar beyond the other side", moved(1, FAR_SIDE, (-12.0, 0.0, 0.0))),
)


def touching_denials(lab: Lab, farther: float = 0.0) -> Finding:
    """The number of checks that two blocks pressed together fail if the face of one is moved ``farther`` [mm] into the other."""
    body = pressed_blocks(BLOCK_STIFFNESS)
    run = lab.solve(body, "P2/P1", first_step=0.5)
    points = run.last.points.copy()
    points[np.unique(body.mesh.facets["high_z0"]), 2] -= farther
    run = replace(run, states=(*run.states[:-1], replace(run.last, points=points)))
    lost = [str(one) for one in of_body(body, run) if not one.met]
    return Finding(float(len(lost)), note="; ".join(lost))


def unbalanced(lab: Lab, lost: float = 0.0) -> Finding:
    """The number of balance checks that fail for the pressed blocks if the fraction ``lost`` of the driving force is missing."""
    body = pressed_blocks(BLOCK_STIFFNESS)
    run = lab.solve(body, "P2/P1", first_step=0.5)
    forces = run.last.forces | {"high_z1": (1 - lost) * run.last.forces["high_z1"]}
    run = replace(run, states=(*run.states[:-1], replace(run.last, forces=forces)))
    checks = [one for one in balance(body, run) if one.frame == body.frames[-1]]
    wrong = [str(one) for one in checks if not one.met]
    return Finding(float(len(wrong)) if checks else np.nan, note="; ".join(wrong))


def _entry(name: str, what: str, words: str, measure: Callable[..., Finding], **mistake: object) -> Entry:
    return Entry(
        name=f"second_check_{name}",
        group="second check",
        title=f"A run of {what} passes the second check; it fails with {words}",
        unit="1",
        measure=measure,
        given={},
        **control(words, **mistake),
        truth=0.0,
        within=0.5,
        because="the value is a whole number, the number of failed checks",
        kind="property",
        source="fem_reference/assessment/run_checks.py",
    )


BAR = "a bar between two bones, into which a sphere is pressed,"
BLOCKS = "two blocks pressed together"
ENTRIES = (
    *(_entry(name, BAR, words, denials, mistake=mistake) for name, words, mistake in MISTAKES),
    _entry("touching", BLOCKS, "the face of one 0.1 mm deeper in the other", touching_denials, farther=0.1),
    _entry("balance", BLOCKS, "one recorded force too small by a thousandth", unbalanced, lost=1e-3),
)
