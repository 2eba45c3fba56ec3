"""Curves over frames: bands as wide as error bars, crosses for what is not a number, one axis for all candidates."""

import re
from dataclasses import replace

import numpy as np
import pytest

from fem_reference.assessment.comparison import Comparison
from fem_reference.metrics import Measure
from fem_reference.problems.setup import Joint
from fem_reference.report import gallery
from fem_reference.report.curves import curves, surface_limits
from tests.report.comparisons import alone, html, measured, with_bars


def test_curves_show_where_a_run_is_not_a_number(comparison):
    drawn = {curve.title: curve.markup for curve in curves(comparison)}
    assert len(drawn) == 5
    assert "not a number" in drawn["Surface of torn: distance to the reference"]
    assert "not a number" not in drawn["Surface of quick: distance to the reference"]
    assert all(svg.startswith("<svg viewBox=") for svg in drawn.values())


@pytest.mark.slow
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


@pytest.mark.slow
@pytest.mark.usefixtures("without_curves")
def test_each_of_nine_candidates_has_a_colour_of_its_own_in_the_key_and_in_the_curves(comparison):
    quick = comparison.candidates[0]
    many = tuple(replace(quick, name=f"quick{i}") for i in range(9))
    deviations = {run.name: comparison.deviations["quick"] for run in many}
    changes = {run.name: comparison.changes["quick"] for run in many} | {"reference": comparison.changes["reference"]}
    wide = replace(comparison, candidates=many, deviations=deviations, changes=changes)
    key = re.search("Curves:.*?Lengths", html(wide), re.DOTALL)
    assert key is not None
    colours = re.findall(r"color:var\(--c-(\w+)", key[0])
    assert len(colours) == len(set(colours)) == 10
    (volume,) = (one.markup for one in curves(wide) if one.title == "Change of volume from rest")
    assert {f"--c-{colour}" for colour in colours} <= set(re.findall(r"--c-\w+", volume))
    surfaces = [one.markup for one in curves(wide) if one.title.startswith("Surface of")]
    assert len({re.search(r"stroke: var\((--c-\w+)", markup)[1] for markup in surfaces}) == 9


def with_joint(comparison: Comparison, angles: tuple[float, ...]) -> Comparison:
    """The comparison with a joint "knee" at ``angles`` [rad] and moment arms of the reference and of "quick"."""
    numbers, bone = comparison.reference.numbers, comparison.setup.bones[0]
    joint = Joint(
        "knee", bone, np.array([0.0, 0, 1]), np.zeros(3), lambda frame: float(np.interp(frame, numbers, angles))
    )
    arms = {"mean": 30.0, "least": 20.0, "greatest": 45.0}
    found = tuple(Measure("moment_arm", name, "mm", arm + np.arange(5.0)) for name, arm in arms.items())
    changes = comparison.changes | {name: comparison.changes[name] + found for name in ("reference", "quick")}
    return replace(comparison, changes=changes, context=replace(comparison.context, bones=(bone,), joints=(joint,)))


@pytest.mark.slow
def test_moment_arms_stand_over_the_angle_of_the_joint_in_degrees(comparison):
    drawn = {one.title: one.markup for one in curves(with_joint(comparison, (0, 0.25, 0.5, 0.75, 1.0)))}
    arms = "Moment arm, mean over the fibres"
    over_frames, over_angle = drawn[arms], drawn[f"{arms}, over the angle"]
    assert len(drawn) == 7
    assert "angle of knee [°]" in over_angle
    assert "minimum and maximum over the fibres" in over_angle
    ticks = [float(text) for text in re.findall(r">([\d.]+)</text>", over_angle)]
    assert {10, 50} <= set(ticks)  # 57.3 degrees at the end
    assert max(ticks) < 60
    assert "angle" not in over_frames
    assert "torn" not in over_angle  # has no arms


@pytest.mark.slow
def test_no_curve_over_an_angle_that_does_not_change(comparison):
    drawn = [one.title for one in curves(with_joint(comparison, (0.5,) * 5))]
    assert "Moment arm, mean over the fibres" in drawn
    assert not any("over the angle" in title for title in drawn)
