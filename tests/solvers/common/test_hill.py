"""Hill's muscle: his hyperbola, equilibrium, and ramps against an ODE in another unknown."""

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

from fem_reference.foundations.errors import InputError
from fem_reference.foundations.records import parse
from fem_reference.solvers.common import hill
from fem_reference.solvers.common.hill import Hill


def muscle(**changes) -> Hill:
    usual = {"max_force": "1000 N", "optimal_length": "60 mm", "slack_length": "120 mm"}
    return parse(Hill, usual | changes, "hill")


@pytest.mark.parametrize("curvature", [0.15, 0.25, 0.4])
def test_shortening_is_the_hyperbola_of_the_report(curvature: float) -> None:
    """(5.1): (F + a) v = b (F0 - F), with a = curvature F0 and b = curvature vmax, where F0 and vmax are 1. Another a misses it."""
    for force in np.linspace(0, 1, 11):
        velocity = hill.inverse_hyperbola(force, curvature)
        assert (force + curvature) * velocity == pytest.approx(curvature * (1 - force), abs=1e-14)
        assert (force + curvature) * (velocity + curvature) == pytest.approx((1 + curvature) * curvature)  # (5.2)
    assert (hill.inverse_hyperbola(0, curvature), hill.inverse_hyperbola(1, curvature)) == (1, 0)
    velocity, other = hill.inverse_hyperbola(0.4, curvature), curvature + 0.05
    assert abs((0.4 + other) * velocity - other * 0.6) > 0.004


def test_lengthening_is_twice_as_steep_as_shortening_and_has_a_greatest_force() -> None:
    """Thelen 2003: V = Vmax (F - 1) / b with b = (2 + 2 / Af) (1.4 - F) / 0.4, at full activation and optimal length; a force
    steeper by two is a velocity less steep by two. The tangent goes on from 1.38 with the slope of the curve there.
    """
    step = 1e-6
    slopes = [hill.inverse_hyperbola(1 + side * step, 0.25) / (side * step) for side in (-1, 1)]
    assert slopes == pytest.approx([-1 / (1 + 1 / 0.25), -1 / (2 + 2 / 0.25)], rel=1e-4)
    for force in (1.1, 1.2, 1.3, 1.379):
        assert -hill.inverse_hyperbola(force, 0.25) == pytest.approx(
            (force - 1) / ((2 + 2 / 0.25) * (1.4 - force) / 0.4)
        )
    beyond = [hill.inverse_hyperbola(1.38 + one, 0.25) for one in (-step, 0, step, 0.1)]
    assert np.diff(beyond[:3]) == pytest.approx(2 * [(beyond[3] - beyond[1]) / 0.1 * step], rel=1e-3)


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
    with pytest.raises(InputError, match=r"0\.1 to 3 times their optimal length"):
        muscle(slack_length="1 mm").static(7.005, 1.0)
    for far in (1e5, 1e12):  # fibres of 3 l0 pull with 117,000 F0, which strains a tendon by 2,700
        with pytest.raises(InputError, match=r"0\.1 to 3 times their optimal length"):
            muscle(slack_length="1 mm").static(far, 1.0)


@pytest.mark.parametrize(
    "amounts", [(180.0, 186.0), (186.0, 178.0), (182.0, 182.0)], ids=["stretched", "released", "isometric"]
)
def test_a_ramp_is_that_of_an_ode_for_the_force(amounts: tuple[float, float]) -> None:
    """The same with the strain of the tendon as unknown, by another method: its rate is (path rate + fibre velocity) / slack."""
    given = muscle()
    times = np.linspace(0, 0.3, 16)
    paths, activations = np.linspace(*amounts, 16), np.linspace(0.2, 0.8, 16)
    forces, _ = given.follow(times, paths, activations)

    def rate(time: float, strain: np.ndarray) -> list[float]:
        path, activation = np.interp(time, times, paths), np.interp(time, times, activations)
        fibre = (path - 120 * (1 + strain[0])) / 60
        force = (hill.tendon(strain[0]) - hill.passive(fibre)) / (activation * hill.active(fibre))
        shortening = 10 * hill.inverse_hyperbola(force, 0.25)
        return [((paths[-1] - paths[0]) / 0.3 + 60 * shortening) / 120]

    _, fibre = given.static(amounts[0], 0.2)
    first = (amounts[0] - 60 * fibre) / 120 - 1
    other = solve_ivp(rate, (0, 0.3), [first], method="Radau", t_eval=times, rtol=1e-10, atol=1e-12, max_step=0.002)
    np.testing.assert_allclose(forces, [1000 * hill.tendon(strain) for strain in other.y[0]], rtol=1e-6, atol=1e-3)


def test_an_isotonic_contraction_shortens_by_the_hyperbola() -> None:
    """A stiff tendon that yields by the path's own velocity carries the force of (5.1): the path shortens at 0.3 vmax."""
    given = muscle(slack_length="1 mm", max_velocity=5.0)
    times = np.linspace(0, 0.05, 6)
    speed = 0.3 * 5 * 60
    start = 60 * 1.05 + 1.02
    forces, fibres = given.follow(times, start - speed * times, np.ones(6))
    wanted = [1000 * hill.active(one) * 0.7 / (1 + 0.3 / 0.25) for one in fibres[2:]]
    np.testing.assert_allclose(
        forces[2:], np.array(wanted) + [1000 * hill.passive(one) for one in fibres[2:]], rtol=0.01
    )
