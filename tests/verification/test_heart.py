"""The bodies of the heart benchmark in the catalogue are those of Land et al. 2015."""

import numpy as np
import pytest

from fem_reference.problems import shapes
from fem_reference.verification import heart
from fem_reference.verification.parts import find


def test_the_crowded_ventricle_is_the_same_body() -> None:
    """Its nodes stay at their depth, the base and the apices where they are; cells at the apex are ``APEX`` times as long."""
    land, mesh = find("land"), heart.Heart("Q1/P0", degree=1).contracting(2).mesh
    depth = land.depth(mesh.points)
    np.testing.assert_allclose(depth, np.round(2 * depth) / 2, atol=1e-9)
    base = mesh.points[np.unique(mesh.facets["base"])]
    np.testing.assert_allclose(base[:, 2], land.BASE, atol=1e-9)
    for apex in (heart.ENDO, heart.EPI):
        assert np.linalg.norm(mesh.points - apex, axis=1).min() < 1e-9
    plain = shapes.ventricle((2, 7, 2), "hexahedron", 1).points
    from_apex = [np.sort(np.linalg.norm(points - heart.ENDO, axis=1))[2] for points in (mesh.points, plain)]
    assert from_apex[0] / from_apex[1] == pytest.approx(heart.APEX, rel=0.05)


def test_fibres_turn_through_the_wall() -> None:
    """Along the meridian inside and outside, around in the middle: at y = 0, x > 0 in the x-z plane and along y."""
    land = find("land")
    middle = land.wall(np.full(3, -2.0), np.zeros(3), np.array([0.0, 0.5, 1.0]))
    fibres = heart.helix(np.zeros(3, np.int64), middle)
    np.testing.assert_allclose(np.abs(fibres[:, 1]), [0, 1, 0], atol=1e-9)
