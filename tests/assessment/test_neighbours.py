"""Muscles in each other: the greatest depth of two at each frame, and none where one is not known."""

from dataclasses import replace

import numpy as np
import pytest
import shapes

from fem_reference.assessment.neighbours import depths
from fem_reference.runs.store import Outcome, Run


def test_depths_of_two_cubes_by_frame() -> None:
    cube = shapes.skin(shapes.box((2, 2, 2), (1.0, 1.0, 1.0)))
    heights = (1.5, 0.9, np.nan)
    still = Run("one", "x", Outcome("converged", ""), (0, 1, 2), cube, np.stack([cube.points] * 3))
    moved = replace(still, positions=np.stack([cube.points + [0, 0, height] for height in heights]))
    ((one, other, found),) = depths({"still": still, "moved": moved})
    assert (one, other) == ("still", "moved")
    assert found == pytest.approx([0.0, 0.1, np.nan], nan_ok=True)
