"""Curves over frames: bands as wide as error bars, crosses for what is not a number, one axis for all candidates."""

from dataclasses import replace

import numpy as np
import pytest

from fem_reference.foundations.motion import Rotation
from fem_reference.metrics import Measure
from fem_reference.problems.setup import Bone, Joint
from fem_reference.report import gallery
from fem_reference.report.curves import curves, surface_limits
from tests.report.comparisons import NUMBERS, alone, measured, with_bars


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


def test_moment_arms_are_drawn_over_the_angle_of_the_joint_too(comparison):
    """1 rad is 57 degrees. A joint that rests has no angle to draw over."""
    arm, title = (
        Measure("moment_arm", "mean", "mm", np.linspace(10, 20, 5), NUMBERS),
        "Moment arm, mean over the fibres",
    )
    for last in (1.0, 0.0):
        turn = Rotation((0, 0, 1), (0, 0, 0), (0.0, 40.0), (0.0, last))
        bone = Bone("plate", comparison.reference.surface, turn)
        joint = Joint("hinge", bone, np.array([0.0, 0, 1]), np.zeros(3), lambda n, last=last: n / 40 * last)
        context = replace(comparison.context, bones=(bone,), joints=(joint,))
        changes = {name: (*found, arm) for name, found in comparison.changes.items()}
        drawn = {one.title: one.markup for one in curves(replace(comparison, context=context, changes=changes))}
        assert ">frame<" in drawn[title]
        assert (f"{title}, over the angle of hinge" in drawn) is (last > 0)
        if last:
            over = drawn[f"{title}, over the angle of hinge"]
            assert ">angle of hinge [deg]<" in over
            assert ">50<" in over
            assert ">60<" not in over


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
