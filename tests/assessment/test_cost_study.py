"""What a study keeps of a run: its errors, and the settings that distinguish it."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import shapes
import small

from fem_reference.foundations.mesh import Polylines
from fem_reference.metrics import MeasurementContext
from fem_reference.runs.store import Outcome, Run
from fem_reference.scenes import casefile
from fem_reference.scenes.case import SolverChoice
from fem_reference.studies.cost import errors, settings_of
from fem_reference.studies.ladders import Trial

BOX = shapes.skin(shapes.box((2, 2, 2), (10, 10, 10)))
FIBRE = Polylines(np.array([[5.0, 5, 1], [5, 5, 9]]), np.array([0, 2]))


def run(folder: str, *scales: float) -> Run:
    """A box that grows by ``scales`` about its corner, a frame each."""
    positions = np.array([scale * BOX.points for scale in scales])
    return Run(
        "run", "recorded", Outcome("converged", ""), tuple(range(len(scales))), BOX, positions, folder=Path(folder)
    )


def test_an_error_is_the_greatest_magnitude_of_either_sign() -> None:
    truth = run("truth", 1.0, 2.0)
    context = MeasurementContext.of(replace(truth, fibres=FIBRE, fibre_positions=None), FIBRE, ())
    found = errors(run("mine", 1.0, 1.8), truth, context)
    assert found["volume.deviation"] == pytest.approx(100 * (1 - 0.9**3), rel=1e-9)  # 1.8 for 2, in % of the truth
    assert errors(run("truth", 1.0, 1.8), truth, context) == {}  # the truth has none


def test_a_setting_that_is_its_solvers_own_is_no_setting(tmp_path) -> None:
    scene = casefile.read_muscle(small.write(tmp_path / "bar"))
    choice = SolverChoice(solver="fenicsx", element="P2/P1", newton_iterations=7)
    assert settings_of(Trial(scene, choice, "reference")) == {"newton_iterations": 7}
