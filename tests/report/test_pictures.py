"""The program that draws: its pictures show the candidate in the colours of the bar."""

import io

import numpy as np
import pytest

from fem_reference.foundations.errors import MissingSoftware
from fem_reference.report import gallery


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
