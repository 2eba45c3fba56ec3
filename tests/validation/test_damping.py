"""What the ground brakes, against the equations integrated by scipy."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from validation import damping


def test_a_body_that_falls_reaches_its_terminal_velocity() -> None:
    # With a little inertia m: m dv/dt = f - c v.
    path = solve_ivp(lambda _, v: (3.0 - 2.0 * v) / 0.1, (0, 5), [0.0], rtol=1e-10, atol=1e-12)
    assert damping.terminal_velocity(3.0, 2.0) == pytest.approx(path.y[0, -1], rel=1e-9)


def test_a_bar_relaxes_at_the_rate_of_its_slowest_mode() -> None:
    # The smallest eigenvalue of second differences with u = 0 at one end and no slope at the other errs by (k h)^2 / 12.
    count, length, mu, bulk, coefficient = 400, 3.0, 0.01, 0.05, 0.2
    second = 2 * np.eye(count) - np.eye(count, k=1) - np.eye(count, k=-1)
    second[-1, -1] = 1.0  # h/2 beyond the last point
    h = length / (count + 0.5)
    slowest = np.linalg.eigvalsh(second)[0] / h**2 * (bulk + 4 / 3 * mu) / coefficient
    assert damping.relaxation_rate(mu, bulk, coefficient, length) == pytest.approx(slowest, rel=2e-6)
