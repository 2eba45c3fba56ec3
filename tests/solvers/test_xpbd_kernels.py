"""One projection of a soft constraint, and a hinge that carries a weight."""

import math

import numpy as np
import pytest
from scipy.optimize import brentq

from fem_reference.solvers import xpbd
from fem_reference.solvers.xpbd import XpbdConstraints, XpbdStep
from tests.solvers.test_xpbd import GRAVITY, graph, settle


def test_one_projection_leaves_what_the_spring_yields():
    # After one constraint's projection C = -a l: the spring is as long as its multiplier, a force times dt^2, stretches it.
    pair = graph([1e5, 2e5], [[0, 1]], 10, 0.5)
    multipliers, points = np.zeros(1), np.array([[0.0, 0, 0], [13, 0, 0]])
    xpbd.pull_distances(points, pair.inverse_masses, pair.edges, pair.lengths, pair.edge_softness / 1e-6, multipliers)
    assert multipliers[0] < 0
    assert points[1, 0] - points[0, 0] - 10 == pytest.approx(-0.5e6 * multipliers[0], rel=1e-12)
    assert points[:, 0] @ [2, 1] == pytest.approx(13, rel=1e-12)  # the centre of mass stays


@pytest.mark.parametrize(("seconds", "sweeps"), [(1e-3, 20), (2e-3, 40)])
def test_a_flap_hangs_where_its_weight_and_its_hinge_agree(seconds, sweeps):
    # One triangle is attached in the plane z = 0; the free corner of the other, 10 mm from the edge on stiff springs, sinks by the
    # angle t at which the hinge's moment k (change of angle) is the weight's m g 10 cos(t). It rests lifted by 0.5 rad. Directions
    # are those on the path to the end of a step: 0.0003 off with a step of 1 ms, four times that with 2 ms.
    lift, stiffness, mass = 0.5, 2.0, 5e-6
    points = np.array([[0.0, -5, 0], [0, 5, 0], [-10, 0, 0], [10 * math.cos(lift), 0, 10 * math.sin(lift)]])
    springs = graph([0, 0, 0, 1 / mass], [[0, 3], [1, 3]], math.hypot(5, 10), 0.0)
    hinge = {
        "hinges": np.array([[0, 1, 2, 3]]),
        "angles": np.array([math.pi - lift]),
        "hinge_softness": np.array([1 / stiffness]),
    }
    flap = XpbdConstraints(**(vars(springs) | hinge))
    end = settle(points, flap, XpbdStep(seconds, sweeps, 100.0, (0, 0, -GRAVITY)), 1.0)
    angle = brentq(lambda t: stiffness * (lift - t) - mass * GRAVITY * 10 * math.cos(t), -1.5, 1.5)
    assert 0.1 < angle < lift - 0.1  # dihedral angles cannot distinguish the two sides of a fold
    assert math.atan2(end[3, 2], end[3, 0]) == pytest.approx(angle, rel=2e-3)
