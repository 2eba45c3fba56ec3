"""The balloon: the largest pressure where the textbook has it, and small strain as that of a thin spherical shell."""

import pytest
from scipy.optimize import minimize_scalar

from validation.balloon import pressure


def test_the_pressure_is_largest_at_the_seventh_sixth_root() -> None:
    found = minimize_scalar(lambda stretch: -pressure(1.0, 0.1, 10.0, stretch), bounds=(1, 3), options={"xatol": 1e-9})
    assert found.x == pytest.approx(7 ** (1 / 6), abs=1e-6)


def test_in_small_strain_it_is_a_shell() -> None:
    """``p = 2 E/(1 - nu) e H / R`` (Timoshenko and Woinowsky-Krieger 1959, ch. 14), with E = 3 mu and nu = 1/2."""
    assert pressure(1.0, 0.1, 10.0, 1 + 1e-7) == pytest.approx(2 * 6 * 1e-7 * 0.1 / 10, rel=1e-5)
