"""Sizes of differences between two runs: what one frame or one place says by chance counts as it does on average."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from fem_reference.assessment.differences import greatest, ratio, typical, typical_changes

APART = np.array([0.0, 1.0, 2.0])


def test_the_greatest_is_of_what_is_finite_and_of_nothing_it_is_no_number() -> None:
    assert greatest(np.array([np.nan, -2.0, -3.0, np.inf])) == -2.0
    assert np.isnan(greatest(np.array([np.nan, np.inf])))


def test_a_ratio_is_of_root_mean_squares_over_the_frames_that_are_known() -> None:
    assert ratio(np.array([3.0, np.nan, 4.0]), np.array([6.0, 1.0, 8.0])) == pytest.approx(0.5)
    assert np.isnan(ratio(np.ones(2), np.zeros(2)))


def test_a_difference_that_crosses_zero_counts_as_it_does_on_average() -> None:
    """It is half of what the surfaces are apart on average, and 0 where these are the same."""
    differences = np.array([0.0, 0.0, np.sqrt(5) / 2])
    assert_allclose(typical(differences, APART), [0, 0.5, np.sqrt(5) / 2], atol=1e-12)


def test_surfaces_that_agree_by_chance_in_a_pose_count_with_the_share_of_the_median_frame() -> None:
    apart, moved = np.array([0.0, 1.0, 0.1]), np.array([0.0, 10.0, 10.0])
    # In the two frames that moved they are apart by 10 % and 1 % of that: 5.5 % in the median.
    assert_allclose(typical(apart, apart, moved), [0, 1, 0.55])


def test_a_change_is_known_no_better_than_its_metric_is_on_average() -> None:
    names = [("surface_deviation", "rms"), ("surface_deviation", "max")]
    changes, deviations = [0.5 * APART, 0.0 * APART], [APART, 4 * APART]
    rms, largest = typical_changes(changes, deviations, names)
    share = np.sqrt((0.5**2 + 0.0**2) / 2)
    assert_allclose(rms, 0.5 * APART)
    # Of the worst place: the share of its own deviation, and at least what any one place is known to.
    assert_allclose(largest, np.maximum(share * 4, 1) * APART)
