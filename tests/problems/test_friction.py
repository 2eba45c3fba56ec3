"""Coulomb's law by return mapping: its values by hand, and its derivatives by differences."""

import numpy as np
import pytest

from fem_reference.foundations.errors import InputError
from fem_reference.problems.friction import check, returned, since_entry

STEP = 1e-6


def test_a_spring_pulls_up_to_the_limit() -> None:
    slip = np.array([0.0, 0.1, 0.2, 0.201, 0.5])
    found = returned(slip, np.full(5, 0.4), 2.0)
    assert found.stiffness * slip == pytest.approx([0, 0.2, 0.4, 0.4, 0.4], abs=1e-15)
    assert returned(slip, np.zeros(5), 2.0).stiffness * slip == pytest.approx(np.zeros(5), abs=1e-15)


def test_derivatives_are_those_of_the_values() -> None:
    slip, limit = np.array([0.1, 0.5, 0.7]), np.array([0.4, 0.4, 0.1])
    found = returned(slip, limit, 2.0)
    by_slip = (returned(slip + STEP, limit, 2.0).stiffness - returned(slip - STEP, limit, 2.0).stiffness) / (2 * STEP)
    by_limit = (returned(slip, limit + STEP, 2.0).stiffness - returned(slip, limit - STEP, 2.0).stiffness) / (2 * STEP)
    # Central differences: the square of the step, and rounding over it.
    assert found.by_slip == pytest.approx(by_slip, abs=1e-8)
    assert found.by_limit == pytest.approx(by_limit, abs=1e-8)


def test_the_share_of_a_path_in_contact() -> None:
    gap, before = np.array([-0.1, 0.05]), np.array([0.3, 0.1])
    share, by_gap = since_entry(gap, before, 0.1)
    assert share == pytest.approx([0.5, 1.0])  # 0.2 of 0.4 mm, and all of a path that begins at the smoothing
    ahead, behind = (since_entry(gap + step, before, 0.1)[0] for step in (STEP, -STEP))
    assert by_gap == pytest.approx((ahead - behind) / (2 * STEP), abs=1e-8)


def test_a_coefficient_that_is_none_is_refused() -> None:
    check([None, 0.3], begun=False)
    check([None], begun=True)
    for wrong in (0.0, -0.1, float("nan"), float("inf")):
        with pytest.raises(InputError, match=f"friction: got {wrong}, want a number above 0, or None"):
            check([0.3, wrong], begun=False)
    with pytest.raises(
        InputError, match=r"friction: got 0\.3, want no friction in a body that starts deformed or under tension"
    ):
        check([0.3], begun=True)
