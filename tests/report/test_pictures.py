"""The program that draws: its pictures show the candidate in the colours of the bar."""

import io

import numpy as np
import pytest
import shapes

from fem_reference.foundations.errors import MissingSoftware
from fem_reference.foundations.mesh import Surface, triangle_areas
from fem_reference.geometry.distance import distances
from fem_reference.report import gallery, pictures


@pytest.mark.slow
def test_pictures_show_the_candidate_in_the_colours_of_the_bar(comparison, monkeypatch):
    from PIL import Image

    monkeypatch.undo()
    try:
        drawn = gallery.draw(comparison.setup, comparison.reference.surface, gallery.shots(comparison)[2:3])
    except MissingSoftware as error:
        pytest.skip(str(error))
    for picture in drawn[0]:
        pixels = np.asarray(Image.open(io.BytesIO(picture)).convert("RGB")).astype(int)
        assert pixels.shape == (840, 840, 3)
        assert (pixels[0, 0] > 250).all()
        # Every vertex is 4 mm away, the top of the bar: yellow, so red and green are far above blue. The body fills at
        # least an ellipse of half axes 20 and 10 in a window of half side 1.06 * 34: 0.12 of the picture.
        yellow = (pixels[:, :, 0] > pixels[:, :, 2] + 80) & (pixels[:, :, 1] > pixels[:, :, 2] + 80)
        assert yellow.mean() > 0.1
        assert (pixels.max(axis=2) < 60).any()


def test_a_surface_of_few_triangles_stays_itself():
    box = shapes.skin(shapes.box((2, 2, 2), (1, 1, 1)))
    assert pictures.thinned(box.points, box.triangles, len(box.triangles))[1] is box.triangles


def test_a_box_keeps_its_flat_sides_edges_and_corners():
    box = shapes.skin(shapes.box((12, 12, 12), (30, 20, 10)))
    few = Surface(*pictures.thinned(box.points, box.triangles, 400))
    assert len(few.triangles) <= 400 < len(box.triangles)
    # Collapses within a plane and along an edge have no error but round-off.
    assert distances(few.points, box).distance.max() < 1e-9
    assert distances(box.points, few).distance.max() < 1e-9
    assert triangle_areas(few.points, few.triangles).sum() == pytest.approx(2 * (600 + 300 + 200), rel=1e-9)


def test_a_rough_triangle_soup_is_thinned_too():
    # An edge of three triangles, one that is turned over, a loose one and one without area; libigl ends in these.
    rng = np.random.default_rng(5)
    points = rng.uniform(0, 10, (900, 3))
    triangles = np.vstack([np.arange(900).reshape(-1, 3), [[0, 1, 5], [1, 0, 9], [2, 2, 7]]])
    few, left = pictures.thinned(points, triangles, 50)
    assert 0 < len(left) <= 50
    assert np.isfinite(few).all()
    assert left.max() < len(few)
