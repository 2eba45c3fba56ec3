"""Frames in words: the number, the time and the angles of bones."""

from dataclasses import replace

import pytest

from fem_reference.foundations.motion import RigidMotion
from fem_reference.report.at_frames import label
from tests.report.comparisons import html


@pytest.mark.slow
def test_a_frame_is_its_number_with_what_is_known_there(comparison):
    assert label(comparison.scene, comparison.setup, 20) == "frame 20 (plate 28.6°)"  # half of 1 rad
    text = html(comparison)
    assert "from frame 0 (plate 0°) to frame 40 (plate 57.3°)" in text
    assert '<th>Frame</th><th>plate <span class="unit">°</span></th>' in text
    frames = comparison.scene.frames.model_copy(update={"interval": 0.05})
    timed = comparison.scene.model_copy(update={"frames": frames})
    assert label(timed, comparison.setup, 20) == "frame 20 (time 1 s, plate 28.6°)"
    slid = replace(comparison.setup.bones[0], motion=RigidMotion((1, 0, 0), None, (0, 40), (0.0, 8.0)))
    assert label(comparison.scene, replace(comparison.setup, bones=(slid,)), 10) == "frame 10 (plate 2 mm)"
