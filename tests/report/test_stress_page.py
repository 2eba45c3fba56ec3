"""The page of hard cases: counts in words, bodies seen from the camera, and quantities over frames."""

import base64
import io
import re

import every_page
import numpy as np
import pytest
from PIL import Image

from fem_reference.assessment.stress import History, Scene
from fem_reference.report import stress_page


def test_the_counts_and_the_sentences_of_what_is_not_ok_are_printed(comparison) -> None:
    found = every_page.stress(comparison)
    counts = "2 hard cases by 3 solvers: 1 ok, 1 degraded, 1 failed, 1 not applicable, 1 no solution, 1 inconclusive"
    assert stress_page.summary(found) == counts
    lines = stress_page.text(found).splitlines()
    assert lines[0] == counts
    assert "  pbd: It is degraded." in lines
    assert not any(line.endswith(("It is ok.", "It is not applicable.", "It is no solution.")) for line in lines)


def test_the_page_has_a_cell_for_every_case_and_solver(comparison) -> None:
    found = every_page.stress(comparison)
    text = stress_page.page(found).html()
    assert all(f'id="{cell.case}--{cell.solver}"' in text for cell in found.cells)
    assert text.count('class="history"') == len(found.cells)
    assert not any("nan" in drawn for drawn in re.findall(r'<svg [^>]*class="history".*?</svg>', text))


def test_a_quantity_over_frames_spans_the_drawing_and_marks_what_is_lost() -> None:
    values = np.array([0.0, 2.0, np.nan, 4.0])
    found = stress_page.history(History("kinetic_energy", "mJ", (0, 10, 20, 30), values), 2.0)
    # The axes go from 52 to 290 along x and from 120 up to 8: 2 of 4 is half way, and frame 10 a third.
    assert found["points"] == [(52, 120), (pytest.approx(52 + 238 / 3), 64), (290, 8)]
    assert found["lost"] == [pytest.approx(52 + 2 * 238 / 3)]
    assert (found["limit"], found["ends"]) == (64, ((0.0, 120), (4.0, 12)))
    assert (found["title"], found["frames"]) == ("kinetic energy, mJ", (0, 30))


def test_what_spans_decades_has_a_logarithmic_axis() -> None:
    found = stress_page.history(History("energy", "", (0, 1), np.array([0.0, 1e6])), 1.0)
    heights = [height for _, height in found["points"]]
    assert heights == [120, 8]
    # From 1/30 to 1e6 the bound of 1 is at log(30) / log(3e7) of the height.
    assert found["limit"] == pytest.approx(8 + 112 * (1 - np.log(30) / np.log(3e7)))


def test_paper_shows_through_beside_a_body_in_light_and_dark() -> None:
    corners = np.array([[0, 0, 0], [1, 0, 0], [0, 0, 1.0]])
    source = stress_page.picture(Scene(corners, np.array([[0, 1, 2]]), None))
    opaque = np.asarray(Image.open(io.BytesIO(base64.b64decode(source.split(",")[1]))).convert("RGBA"))[:, :, 3]
    assert opaque[0, 0] == 0
    assert 0.1 < np.mean(opaque == 255) < 0.5  # half of a square that the picture leaves a margin around


def test_the_inner_side_of_a_body_is_blue_and_its_outer_side_is_not() -> None:
    corners = np.array([[0, 0, 0], [1, 0, 0], [0, 0, 1.0]])  # the camera looks along +y
    for triangle, inner in (([0, 1, 2], False), ([0, 2, 1], True)):
        source = stress_page.picture(Scene(corners, np.array([triangle]), None))
        pixels = np.asarray(Image.open(io.BytesIO(base64.b64decode(source.split(",")[1]))).convert("RGB")).astype(int)
        body = pixels[np.ptp(pixels, axis=2) > 40]
        assert len(body) > 1000
        assert (np.median(body[:, 2] - body[:, 0]) > 0) == inner
