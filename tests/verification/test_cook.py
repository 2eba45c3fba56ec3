"""The mesh of Cook's membrane in the catalogue."""

import numpy as np
import pytest

from fem_reference.verification import cook


def test_cells_crowd_towards_the_clamped_corners() -> None:
    """The area of a quadrilateral of corners a, b, c, d is half the cross product of its diagonals: 1440 mm2, 2 mm thick."""
    mesh = cook.Panel("FINITE", "Q2/Q1").body(4).mesh
    corners = mesh.points[mesh.cells]
    edges = np.linalg.norm(corners[:, 1] - corners[:, 0], axis=1)
    assert edges.max() > 2 * edges.min()
    flat = corners[:, [0, 1, 3, 2], :2]
    across, along = flat[:, 2] - flat[:, 0], flat[:, 3] - flat[:, 1]
    areas = (across[:, 0] * along[:, 1] - across[:, 1] * along[:, 0]) / 2
    assert abs(areas).sum() == pytest.approx(1440, rel=1e-12)
    assert np.ptp(mesh.points[:, 2]) == cook.THICKNESS
