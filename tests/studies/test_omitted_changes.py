"""What leaving an effect out changes is what it changes at the worst frame."""

import numpy as np
import pytest
import shapes

from fem_reference.foundations.mesh import Polylines
from fem_reference.metrics import MeasurementContext
from fem_reference.runs.store import Outcome, Run
from fem_reference.studies import omissions
from fem_reference.studies.campaign import Made

BALL = shapes.sphere(1, 10.0)
LINE = Polylines(np.array([[0.0, 0, -8], [0, 0, 8]]), np.array([0, 2]))


def run(name: str, *shifts: float, status: str = "converged") -> Run:
    """The ball, displaced along x by ``shifts`` [mm] frame by frame."""
    moved = np.array(shifts)[:, None, None] * [1.0, 0, 0]
    points = BALL.points + moved
    return Run(name, "fenicsx", Outcome(status, "", {}), (0, 5, 10, 15), BALL, points, LINE, LINE.points + moved)


def test_a_change_in_the_middle_counts() -> None:
    """All vertices are 3 mm off at frame 5 and 1 mm at the last."""
    whole = run("whole", 0, 1, 2, 3)
    context = MeasurementContext.of(whole, LINE, (), np.ones(len(BALL.points), bool))
    found = omissions.changes(Made(None, run("without", 0, -2, 2, 2)), whole, context)
    assert found["surface_deviation.rms"] == pytest.approx(3.0, rel=1e-12)
    assert found["surface_deviation.max"] == pytest.approx(3.0, rel=1e-12)
    assert found["volume.deviation"] == pytest.approx(0.0, abs=1e-10)
    assert omissions.changes(Made(None, run("without", 0, 1, 2, 3, status="diverged")), whole, context) == {}
    assert omissions.changes(Made(None, run("without", 0, np.nan, 2, 3)), whole, context) == {}
