"""Patches that landmarks span: fans about their middle, laid on a bone in small triangles."""

import numpy as np
import pytest
import shapes

from fem_reference.foundations.errors import InputError
from fem_reference.foundations.mesh import triangle_areas
from fem_reference.geometry.distance import distances
from fem_reference.geometry.patches import draped, fan
from fem_reference.geometry.skins import edge_lengths

BALL = shapes.sphere(3, 30.0)
ANGLES = np.linspace(0, 2 * np.pi, 9)[:-1]
RING = 10 * np.column_stack([np.cos(ANGLES), np.sin(ANGLES), np.zeros(8)])


def test_a_fan_covers_the_polygon_of_its_points_in_any_order() -> None:
    order = np.random.default_rng(0).permutation(8)
    patch = fan(RING[order] @ np.linalg.qr(np.arange(9.0).reshape(3, 3) + np.eye(3))[0] + [5, 6, 7])
    assert len(patch.triangles) == 8
    assert triangle_areas(patch.points, patch.triangles).sum() == pytest.approx(8 * 50 * np.sin(np.pi / 4))


def test_a_patch_lies_on_the_bone_in_small_triangles() -> None:
    patch = draped(fan(RING + [0, 0, 25]), BALL)
    assert distances(patch.points, BALL).distance.max() < 1e-9
    assert edge_lengths(patch.points[patch.triangles]).max() < 3
    # The cap of a sphere of 30 mm within 10 mm of its axis, and a little less of a polygon.
    cap = 2 * np.pi * 30 * (30 - np.sqrt(30**2 - 10**2))
    assert triangle_areas(patch.points, patch.triangles).sum() == pytest.approx(cap, rel=0.2)


@pytest.mark.parametrize(("far", "apart"), [(1e6, r"1e\+06"), (1e200, "inf")])
def test_landmarks_a_kilometre_apart_are_refused(far: float, apart: str) -> None:
    points = np.array([[0, 0, 0], [30, 0, 0], [0, 30, 0], [far, 0, 0.0]])
    with pytest.raises(InputError, match=rf"got landmarks {apart} mm apart, want those around one attachment"):
        draped(fan(points), BALL)
