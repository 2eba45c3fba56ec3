"""Clearance of a spline: never more than the true way, close to it for a plane and a ball, and nothing where nothing is low."""

import numpy as np
import pytest
from scipy.ndimage import spline_filter

from fem_reference.geometry.clearance import Clearance, of_spline

SPACING = 0.5
NODES = np.moveaxis(np.indices((40, 40, 40)), 0, -1) * SPACING - 10.0
POINTS = np.random.default_rng(4).uniform(-14, 14, (3000, 3))


def clearance(values: np.ndarray, level: float) -> Clearance:
    """The clearance of the spline through ``values`` at the nodes."""
    return of_spline(spline_filter(values, order=3), np.full(3, -10.0), SPACING, level)


def test_it_is_a_lower_bound_of_the_way_to_a_ball() -> None:
    found = clearance(np.linalg.norm(NODES, axis=-1) - 4.0, 1.0)(POINTS)
    true = np.linalg.norm(POINTS, axis=1) - 5.0
    assert (found <= np.maximum(true, 0) + 1e-9).all()
    inside = np.abs(POINTS).max(axis=1) < 9  # within the grid it is less by a few cells at most
    assert (found[inside] >= true[inside] - 4 * SPACING).all()


def test_it_knows_the_way_to_a_plane_from_beyond_the_grid() -> None:
    found = clearance(NODES[..., 2] + 3.0, 0.0)(np.array([[0.0, 0, 0], [0, 0, 12], [0, 0, -9]]))
    assert found[0] == pytest.approx(3, abs=4 * SPACING)
    assert found[1] <= 15
    assert found[1] >= 12 - 9.5
    assert found[2] <= 0


def test_there_is_no_end_where_nothing_is_low_and_nothing_is_known_of_no_place() -> None:
    assert (clearance(np.ones(NODES.shape[:3]), 0.5)(POINTS) == np.inf).all()
    found = clearance(NODES[..., 2], 0.0)(np.array([[np.nan, 0, 0], [0, np.inf, 0]]))
    assert np.isnan(found).all()
