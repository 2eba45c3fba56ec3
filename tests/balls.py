"""A ball that is moved, as a candidate and its reference, and baselines of it."""

import json
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import shapes

from fem_reference import metrics
from fem_reference.assessment import baseline, regression
from fem_reference.assessment.error_bars import ErrorBar, ErrorBars
from fem_reference.assessment.measured import CurrentMeasures
from fem_reference.foundations.mesh import Polylines
from fem_reference.problems.setup import Setup
from fem_reference.runs.store import Outcome, Run

# On the digits of a baseline, so that nothing is rounded.
REST = shapes.sphere(2, 30.0).moved_to(np.round(shapes.sphere(2, 30.0).points, 2))


FIBRE = Polylines(np.array([[0.0, 0, -15], [0, 0, 15]]), np.array([0, 2]))


NUMBERS = (0, 10, 20)


SETUP = Setup(REST, (), (), NUMBERS, None)


SCENE = SimpleNamespace(name="ball", key="0123456789abcdef0123", place="case.toml", numbers=NUMBERS)


BAR = 0.5


def run(name: str, shifts) -> Run:
    """A ball that is moved by ``shifts`` (f, 3) [mm]."""
    positions = REST.points + np.asarray(shifts, float)[:, None]
    inside = FIBRE.points + np.asarray(shifts, float)[:, None]
    return Run(name, "test", Outcome("converged", "done"), NUMBERS, REST, positions, FIBRE, inside)


REFERENCE = run("reference", [(0, 0, 0), (0, 0, 5), (0, 0, 10)])


# 12 mm aside of the reference at the last frame.
SHIFTS = [(0, 0, 0), (6, 0, 5), (12, 0, 10)]


def bars(value: float = BAR) -> ErrorBars:
    """The same error bar for every statistic of a deviation, but none in the first frame."""
    made = [
        ErrorBar("deviation", *name.split("."), unit, value * np.array([0.0, 1, 1]), {})
        for name, unit in metrics.units().items()
        if not metrics.of_itself(name.split(".")[0])
    ]
    return ErrorBars(NUMBERS, (4.0, 8.0), 1.5, tuple(made))


def current(shifts=SHIFTS, known: ErrorBars | None = None, **changes) -> CurrentMeasures:
    return replace(CurrentMeasures.of(SCENE, SETUP, run("mine", shifts), REFERENCE, known), **changes)


def edited(path, change) -> None:
    table = json.loads(path.read_text())
    change(table)
    path.write_text(json.dumps(table))


def checked(path, now: CurrentMeasures) -> regression.Check:
    return regression.check(baseline.read(path, SCENE, "mine"), now)


def asked(check: regression.Check, question: str, name: str) -> regression.Judgement:
    (found,) = (one for one in check.judgements if (one.question, one.name) == (question, name))
    return found
