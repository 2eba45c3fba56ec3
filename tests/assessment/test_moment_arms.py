"""Arms by a polynomial fit, shares and overlaps whose values are known."""

import numpy as np
import pytest

from fem_reference.assessment.moment_arms import (
    ArmRange,
    ArmsBeside,
    fitted_arms,
    overlap,
    poses,
    range_of,
    share_inside,
)
from fem_reference.foundations.errors import InputError

ANGLES = np.linspace(0, 57.3, 11)


def flat(angles: np.ndarray, low: float, high: float) -> ArmRange:
    return ArmRange(angles, np.full(len(angles), low), np.full(len(angles), high))


def test_poses_are_even_angles_within_those_of_the_frames() -> None:
    assert poses(ANGLES).tolist() == list(range(0, 58, 2))
    assert poses(np.array([-3.0, 5.0])).tolist() == [-2, 0, 2, 4]


def test_a_length_of_fourth_degree_has_its_own_slope() -> None:
    """With l = 100 - 30 t + 5 t^2 - 2 t^4 of t in radians the arm is 30 - 10 t + 8 t^3: the fit is exact but for rounding."""
    t = np.radians(ANGLES)
    lengths = np.stack([100 - 30 * t + 5 * t**2 - 2 * t**4, 90 + 0 * t], axis=1)
    at = poses(ANGLES)
    angle = np.radians(at)
    assert fitted_arms(ANGLES, lengths, at)[:, 0] == pytest.approx(30 - 10 * angle + 8 * angle**3, rel=1e-9)
    assert fitted_arms(ANGLES, lengths, at)[:, 1] == pytest.approx(0, abs=1e-9)


def test_a_line_around_a_circle_has_its_radius() -> None:
    lengths = 200 - 25 * np.radians(ANGLES)[:, None]
    assert fitted_arms(ANGLES, lengths, poses(ANGLES)) == pytest.approx(25, rel=1e-10)


def test_too_few_angles_are_refused() -> None:
    with pytest.raises(InputError, match="want more than 4"):
        fitted_arms(np.array([0.0, 10, 20, 30, 30]), np.ones((5, 1)), np.array([0.0]))


def test_a_curve_is_inside_in_a_known_share_of_poses() -> None:
    at = np.arange(4.0)
    found = flat(at, 10, 20)
    assert share_inside(np.array([10.0, 20.0, 21.0, 9.0]), found) == 0.5
    assert share_inside(np.array([15.0, np.nan, np.nan, 30.0]), found) == 0.5, "of those that are known"
    assert np.isnan(share_inside(np.full(4, np.nan), found))
    assert share_inside(np.full(4, 15.0), flat(at, np.nan, np.nan)) == 0, "nothing is inside what is not a number"


def test_an_overlap_is_the_covered_part_of_the_published_range() -> None:
    at = np.arange(3.0)
    published = ArmRange(at, np.array([10.0, 10.0, 10.0]), np.array([20.0, 20.0, 20.0]))
    found = ArmRange(at, np.array([0.0, 15.0, 30.0]), np.array([100.0, 30.0, 40.0]))
    assert overlap(found, published) == pytest.approx((1 + 0.5 + 0) / 3)
    assert overlap(flat(at, np.nan, np.nan), published) == 0
    assert np.isnan(overlap(found, flat(at, np.nan, np.nan)))


def test_a_published_range_is_unknown_beyond_its_angles() -> None:
    known = flat(np.array([0.0, 10.0]), 1, 2).at(np.array([-2.0, 0.0, 4.0, 12.0]))
    assert np.isnan(known.low).tolist() == [True, False, False, True]


def test_bias_and_scatter_are_of_the_mean_arm_from_the_middle() -> None:
    at = np.arange(2.0)
    arms = np.array([[10.0, 30.0], [12.0, 40.0]])
    found = range_of(at, arms)
    assert (found.low.tolist(), found.high.tolist()) == ([10, 12], [30, 40])
    names = ("case", "muscle", "flexion", "someone", "coarse")
    beside = ArmsBeside(*names, found, arms.mean(axis=1), flat(at, 10, 20), 0.0, "model")
    assert (beside.bias, beside.scatter, beside.is_curve) == (8.0, 3.0, False)  # 20 - 15 and 26 - 15
    lost = ArmsBeside(*names, found, np.array([20.0, np.nan]), flat(at, 10, 20), 0.0, "model")
    assert np.isnan(lost.bias), "an arm of ours that is not a number is no pose to leave out"
    partly = ArmRange(at, np.array([10.0, np.nan]), np.array([20.0, np.nan]))
    assert ArmsBeside(*names, found, arms.mean(axis=1), partly, 0.0, "model").bias == 5.0
    assert ArmsBeside(*names, found, arms.mean(axis=1), partly, 0.0, "model").known == 1
    assert np.isnan(ArmsBeside(*names, found, arms.mean(axis=1), flat(at, np.nan, np.nan), 0.0, "model").bias)
    curve = ArmsBeside(*names, found, arms.mean(axis=1), flat(at, 11, 11), 0.0, "measurement")
    assert (curve.is_curve, curve.share) == (True, 0.5)
