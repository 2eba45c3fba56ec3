"""Drawings of scalar examples: lines over an interval, maps and views of triangles."""

import fields
import numpy as np
import pytest

from fem_reference.report import field_figures
from tests.report.examples import example_of, rod

pytestmark = pytest.mark.slow


def test_without_an_exact_solution_the_reference_is_the_base(tmp_path):
    made = rod(tmp_path / "rod", lambda base: base + 0.5, exact=None)
    titles = [drawing.title for drawing in field_figures.drawings(made)]
    assert titles == ["Solution at the nodes", "Difference from the reference at nodes"]
    same = rod(tmp_path / "same", exact=None)
    assert field_figures.drawings(same)[1].missing == "the difference is zero everywhere, or not a number"


def test_a_flat_surface_in_space_is_drawn(tmp_path):
    # Seen along z it is a line: no window may be without extent, and a field without differences still has a scale.
    def flat(folder):
        points = np.array([[0, 0, 0], [1, 0, 0], [1, 0, 1], [0, 0, 1.0]])
        return fields.mesh(folder, points, np.array([[0, 1, 2], [0, 2, 3]]))

    made = example_of(tmp_path / "flat", domain=flat, boundary=[{"on": "rim", "value": "0"}])
    assert all(drawing.markup for drawing in field_figures.drawings(made))
