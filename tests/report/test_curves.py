"""Curves over frames: bands as wide as error bars, crosses for what is not a number, one axis for all candidates."""

from dataclasses import replace

import pytest

from fem_reference.report import gallery
from fem_reference.report.curves import curves, surface_limits
from tests.report.comparisons import alone, measured, with_bars


def test_curves_show_where_a_run_is_not_a_number(comparison):
    drawn = {curve.title: curve.markup for curve in curves(comparison)}
    assert len(drawn) == 5
    assert "not a number" in drawn["Surface of torn: distance to the reference"]
    assert "not a number" not in drawn["Surface of quick: distance to the reference"]
    assert all(svg.startswith("<svg viewBox=") for svg in drawn.values())


def test_curves_have_a_band_as_wide_as_the_error_bar(comparison):
    bare, banded = curves(comparison), curves(with_bars(comparison))
    printed = {curve.title: "error bar" in curve.markup for curve in banded}
    assert printed == {curve.title: not curve.title.startswith("Smallest det F") for curve in banded}
    assert not any("error bar" in curve.markup for curve in bare)


def test_candidates_share_one_colour_scale_and_one_axis(comparison):
    # quick is 4 mm away at its worst, torn 1.5 mm.
    wanted = gallery.shots(comparison)
    assert gallery.top(wanted) == pytest.approx(4.0)
    assert gallery.top(wanted[:1]) == 0
    assert surface_limits(comparison) == (0.0, pytest.approx(1.04 * 4), False)
    far = comparison.deviations | {
        "torn": tuple(
            replace(one, values=1e4 * one.values)
            for one in measured(comparison.candidates[1], comparison.reference.positions)
        )
    }
    low, high, logarithmic = surface_limits(replace(comparison, deviations=far))
    assert logarithmic
    assert (low, high) == (pytest.approx(4e-3), pytest.approx(1.3 * 1.5e4))
    assert surface_limits(alone(comparison)) == (0.0, 1.04, False)
