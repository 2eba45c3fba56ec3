"""Muscles in each other: the greatest depth over all others by frame, nothing for one alone, and none where one is not known."""

from dataclasses import replace

import numpy as np
import pytest
import shapes

from fem_reference.foundations.mesh import Polylines
from fem_reference.metrics import MeasurementContext, neighbour_penetration
from fem_reference.runs.store import Outcome, Run
from fem_reference.runs.views import beside


def test_the_deepest_of_all_others_by_frame() -> None:
    """Cubes of 1 mm: one lifted by 1.5 and 0.9 mm, the other moved aside by 0.8 mm in both frames, and lost in the last."""
    cube = shapes.skin(shapes.box((2, 2, 2), (1.0, 1.0, 1.0)))
    still = Run("one", "x", Outcome("converged", ""), (0, 1, 2), cube, np.stack([cube.points] * 3))
    lifted = replace(still, positions=np.stack([cube.points + [0, 0, height] for height in (1.5, 0.9, 0.9)]))
    aside = replace(still, positions=np.stack([cube.points + [x, 0, 0] for x in (0.95, 0.8, np.nan)]))
    context = MeasurementContext.of(still, Polylines(cube.points[:2], np.array([0, 2])), ())
    runs = beside({"still": still, "lifted": lifted, "aside": aside})
    (found,) = neighbour_penetration.measure(runs["still"], still, context)
    assert (found.metric, found.statistic, found.unit) == ("neighbour_penetration", "deepest", "mm")
    assert found.values == pytest.approx([0.05, 0.2, np.nan], abs=1e-9, nan_ok=True)
    assert found.where[0].startswith("aside at")
    assert neighbour_penetration.measure(still, still, context) == ()
