"""Fibres beside each other where angle, length, share outside and crossings are known."""

import numpy as np
import pytest
import shapes
import small

from fem_reference.foundations.mesh import Polylines
from fem_reference.scenes import casefile
from fem_reference.studies import decompositions
from fem_reference.studies.decompositions import answers, compared, crossings

BOX = shapes.skin(shapes.box((2, 2, 4), (20.0, 20.0, 60.0)))


def _lines(*lines: np.ndarray) -> Polylines:
    return Polylines(np.concatenate(lines), np.cumsum([0, *map(len, lines)]))


def _line(degrees: float, length: float, start: tuple[float, float, float]) -> np.ndarray:
    along = np.array([np.sin(np.radians(degrees)), 0, np.cos(np.radians(degrees))])
    return start + np.linspace(0, length, 31)[:, None] * along


def test_angle_length_and_share_outside_are_those_of_lines() -> None:
    """12 degrees, 30 over 40 mm; of two lines one runs outside."""
    known = _lines(_line(0, 40, (5, 5, 10)), _line(0, 40, (15, 5, 10)))
    lines = _lines(_line(12, 30, (5, 5, 10)), _line(12, 30, (5, 30, 10)))
    found = compared("case", BOX, ("mine", lines), ("theirs", known))
    assert (found.median, found.most) == pytest.approx((12, 12), abs=1e-6)
    assert found.length == pytest.approx(0.75)
    assert found.outside == pytest.approx(0.5)
    assert found.crossings == 0


def test_lines_that_cross_are_counted_once_a_pair() -> None:
    crossing = _lines(_line(0, 40, (10, 5, 0)), _line(20, 40, (3, 5, 0)), _line(0, 40, (10, 15, 0)))
    assert crossings(crossing) == 1
    assert crossings(_lines(_line(0, 40, (10, 5, 0)), _line(20, 40, (10, 5, 0)))) == 0, "their ends may meet"


@pytest.mark.slow
def test_the_same_fibres_change_no_answer_and_others_do(tmp_path, monkeypatch) -> None:
    """The Laplace field under another name; and the template's lines, which in a bar are the field's to a few degrees."""
    case = casefile.read_muscle(small.write(tmp_path / "bar"))
    own = decompositions.variants
    monkeypatch.setattr(decompositions, "variants", lambda one: (found := own(one)) | {"again": found["Laplace field"]})
    found = {one.source: one for one in answers(case, tmp_path / "runs")}
    assert set(found) == {"Kohout and Kukacka", "again"}
    assert found["again"].status == "converged"
    assert max(found["again"].changes.values()) == 0
    assert {"surface_deviation.rms", "fibre_length.max", "joint_moment.force"} <= set(found["again"].changes)
    assert 0 < found["Kohout and Kukacka"].changes["surface_deviation.rms"] < 1
    assert found["again"].bars["surface_deviation.rms"] > 0
