"""Surfaces for pictures: few enough triangles, near to the surface, and nothing that no other routine could take apart."""

import numpy as np
import pytest
import shapes

from fem_reference.foundations.mesh import Surface, triangle_areas
from fem_reference.geometry.distance import distances
from fem_reference.geometry.thinning import thin


def test_a_surface_of_few_triangles_stays_itself():
    box = shapes.skin(shapes.box((2, 2, 2), (1, 1, 1)))
    assert thin(box, len(box.triangles)) is box


def test_a_box_keeps_its_flat_sides_edges_and_corners():
    box = shapes.skin(shapes.box((12, 12, 12), (30, 20, 10)))
    few = thin(box, 400)
    assert len(few.triangles) <= 400 < len(box.triangles)
    # Where planes meet is on all of them, so that every point is on the box but for round-off in a pseudo-inverse.
    assert distances(few.points, box).distance.max() < 1e-9
    assert distances(box.points, few).distance.max() < 1e-9
    assert triangle_areas(few.points, few.triangles).sum() == pytest.approx(2 * (600 + 300 + 200), rel=1e-9)


def test_a_rough_triangle_soup_is_thinned_too():
    # An edge of three triangles, one that is turned over, a loose one and one without area; libigl ends in these.
    rng = np.random.default_rng(5)
    points = rng.uniform(0, 10, (900, 3))
    triangles = np.vstack([np.arange(900).reshape(-1, 3), [[0, 1, 5], [1, 0, 9], [2, 2, 7]]])
    few = thin(Surface(points, triangles), 50)
    assert 0 < len(few.triangles) <= 50
    assert np.isfinite(few.points).all()
    assert few.triangles.max() < len(few.points)
