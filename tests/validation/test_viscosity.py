"""Viscous material, against the balance of its power and an equation integrated by scipy."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from validation import viscosity


def test_the_power_of_the_plates_is_stored_or_lost() -> None:
    # Per rest volume d/dt mu/2 (l^2 + 2/l - 3), by differences that err by 1e-10, and 2 eta D:D, whatever the area.
    mu, eta, speed, dt = 0.01, 0.2, -0.3, 1e-5
    for stretch in (0.2, 0.5, 1.0, 1.7):
        ends = (stretch + sign * speed * dt for sign in (1, -1))
        after, before = (mu / 2 * (end**2 + 2 / end - 3) for end in ends)
        D = np.diag([-0.5, 1.0, -0.5]) * speed / stretch
        power = viscosity.squeeze_force(mu, eta, stretch, speed, 2.0) / 2.0 * speed
        assert power == pytest.approx((after - before) / (2 * dt) + 2 * eta * np.sum(D**2), rel=1e-8)


def test_a_free_body_creeps_back_at_the_rate_of_small_strain() -> None:
    # The stretch whose force vanishes: its last part goes by exp(-mu t / eta), but for strains of 1e-4.
    mu, eta = 0.01, 0.2

    def speed(_: float, stretch: np.ndarray) -> np.ndarray:
        return -viscosity.squeeze_force(mu, 0.0, stretch, 0.0, 1.0) * stretch**2 / (3 * eta)

    path = solve_ivp(speed, (0, 200), [1.5], t_eval=[180, 200], rtol=1e-11, atol=1e-14).y[0] - 1
    assert np.log(path[0] / path[1]) / 20 == pytest.approx(viscosity.creep_rate(mu, eta), rel=1e-4)
