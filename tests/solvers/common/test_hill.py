"""A muscle of Hill's type: its curves, and equilibrium with its tendon."""

import math

import numpy as np
import pytest
from scipy.optimize import brentq

from fem_reference.foundations.errors import InputError
from fem_reference.foundations.records import parse
from fem_reference.solvers.common import hill
from fem_reference.solvers.common.hill import Hill


def muscle(**changes) -> Hill:
    usual = {"max_force": "1000 N", "optimal_length": "60 mm", "slack_length": "120 mm"}
    return parse(Hill, usual | changes, "hill")


def test_curves_pass_their_published_points() -> None:
    """Thelen 2003: 1 at the optimum; F0 of the parallel element at a strain of 0.6; 0.33 where the tendon's toe ends."""
    assert hill.active(1.0) == 1
    assert hill.active(1.45) == pytest.approx(math.exp(-0.45))
    assert (hill.passive(0.9), hill.passive(1.6)) == (0, pytest.approx(1))
    assert (hill.tendon(-0.01), hill.tendon(0.04)) == (0, pytest.approx(1))
    toe = brentq(lambda strain: hill.tendon(strain) - 0.33, 1e-4, 0.04)
    assert toe / 0.04 == pytest.approx(0.609, abs=0.002)
    slopes = [(hill.tendon(toe + side * 1e-8) - hill.tendon(toe)) / (side * 1e-8) for side in (-1, 1)]
    assert slopes[0] == pytest.approx(slopes[1], rel=1e-3)


def test_isometric_at_the_optimum_gives_the_greatest_force() -> None:
    """Where the tendon is strained by 0.04 and the fibre is optimal the force is F0 cos(pennation)."""
    for pennation in (0.0, 0.35):
        given = muscle(pennation=f"{pennation} rad")
        strain = brentq(lambda one, angle=pennation: hill.tendon(one) - math.cos(angle), 0.001, 0.06)
        path = 60 * math.cos(pennation) + 120 * (1 + strain)
        force, fibre = given.static(path, 1.0)
        assert force == pytest.approx(1000 * math.cos(pennation), rel=1e-9)
        assert fibre == pytest.approx(1, rel=1e-9)


def test_a_static_state_balances_and_slack_pulls_nothing() -> None:
    given = muscle(pennation="15 deg")
    for path in (150.0, 170.0, 185.0, 200.0, 400.0):
        for activation in (0.0, 0.3, 1.0):
            force, fibre = given.static(path, activation)
            if force > 0:
                assert abs(given.imbalance(path, fibre, activation)) < 1e-10 * max(1, force / 1000)
                shorter = np.linspace(max(0.1, 1.0001 * given.thickness), fibre - 1e-4, 200)
                assert all(given.imbalance(path, one, activation) < 0 for one in shorter)  # the first of its kind
    assert given.static(100.0, 1.0)[0] == 0
    with pytest.raises(InputError, match="a tenth of their optimal length"):
        muscle(slack_length="1 mm").static(7.005, 1.0)
