"""Points of a study: the worst frame speaks, and the truth is no point of its own study."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import shapes

from fem_reference.assessment.error_bars import ErrorBar, ErrorBars
from fem_reference.foundations.mesh import Polylines
from fem_reference.metrics import MeasurementContext
from fem_reference.runs.store import Outcome, Run
from fem_reference.studies import cost

BALL = shapes.sphere(1, 10.0)
LINE = Polylines(np.array([[0.0, 0, -8], [0, 0, 8]]), np.array([0, 2]))


def run(folder: str, *shifts: float) -> Run:
    """The ball, displaced along x by ``shifts`` [mm] frame by frame."""
    moved = np.array(shifts)[:, None, None] * [1.0, 0, 0]
    numbers = tuple(range(len(shifts)))
    fibres = LINE.points + moved
    outcome = Outcome("converged", "", {})
    return Run("one", "fenicsx", outcome, numbers, BALL, BALL.points + moved, LINE, fibres, folder=Path(folder))


def test_the_bar_of_a_statistic_is_that_of_its_worst_frame() -> None:
    bars = [
        ErrorBar("deviation", "surface_deviation", name, "mm", np.array(values), {})
        for name, values in (("rms", [0.0, 0.4, 0.1]), ("max", [0.0, np.nan, np.nan]), ("p95", [0.3, 0.2, 0.1]))
    ]
    change = replace(bars[0], of="change", values=np.array([0.0, 9.0, 9.0]))
    found = cost.known(ErrorBars((0, 1, 2), (1.0, 2.0), 1.5, (*bars, change)))
    assert found["surface_deviation.rms"] == 0.4
    assert found["surface_deviation.p95"] == 0.3
    assert cost.known(None) == {}


def test_errors_are_those_of_the_worst_frame_and_none_of_the_truth_itself() -> None:
    truth = run("truth", 0, 1, 2, 3)
    context = MeasurementContext.of(truth, LINE, ())
    found = cost.errors(run("other", 0, -1, 2, 2.5), truth, context)
    assert found["surface_deviation.rms"] == pytest.approx(2.0, rel=1e-12)
    assert cost.errors(run("truth", 0, 1, 2, 3), truth, context) == {}
