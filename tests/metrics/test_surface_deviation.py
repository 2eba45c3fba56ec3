"""The worst vertex of a material deviation and that of a geometric one are told apart."""

import numpy as np
import shapes
from scipy.spatial.transform import Rotation

from fem_reference.foundations.mesh import Polylines
from fem_reference.metrics import MeasurementContext, find, measure
from fem_reference.runs.store import Outcome, Run

BALL = shapes.sphere(2, 10.0)
LINE = Polylines(np.array([[0.0, 0, -8], [0, 0, 8]]), np.array([0, 2]))


def run(name: str, points: np.ndarray) -> Run:
    return Run(name, "pbd", Outcome("converged", "", {}), (0,), BALL, points[None], LINE, LINE.points[None])


def test_a_ball_that_turned_in_itself_is_worst_where_something_sticks_out() -> None:
    """Turned by a quarter about z its equator went 14 mm along itself; its vertex nearest to the pole stands out by 3 mm."""
    turned = Rotation.from_rotvec([0, 0, np.pi / 2]).apply(BALL.points)
    pole = int(np.argmax(BALL.points[:, 2]))
    turned[pole] *= 1.3
    reference = run("reference", BALL.points)
    context = MeasurementContext.of(reference, LINE, (), np.ones(len(BALL.points), bool))
    found = measure(run("mine", turned), reference, context, ["surface_deviation"])
    for statistic in ("hausdorff", "distance_mean", "distance_rms"):
        assert find(found, "surface_deviation", statistic).where[0].startswith(f"vertex {pole} at ")
    for statistic in ("max", "rms", "p95"):
        assert not find(found, "surface_deviation", statistic).where[0].startswith(f"vertex {pole} at ")
