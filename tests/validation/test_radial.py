"""Bodies of a finite bulk modulus against a second method, integration from the inside out, and against their limits."""

from collections.abc import Callable

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

from validation import radial
from validation.laws import neo_hooke
from validation.rivlin import Sphere

MU, BULK = 0.01, 0.4


def slopes(slope: float, r: float, R: float, power: int) -> np.ndarray:
    """Of the neo-Hookean energy in r' and in r, from the invariants of each geometry; J^(-2/3) I1 and K/2 (J - 1)^2."""
    I1, J = slope**2 + power * (r / R) ** 2 + (power == 1), slope * (r / R) ** power
    volume = BULK * (J - 1) - MU / 3 * J ** (-5 / 3) * I1
    return MU * J ** (-2 / 3) * np.array([slope, power * r / R**2]) + volume * J * np.array([1 / slope, power / r])


def march(power: int, radii: tuple[float, float], first: tuple[float, float]) -> float:
    """From the inner face, where r and P_rr R^n are ``first``, to the outer: P_rr there, by the Euler-Lagrange equation of the
    energy, ``(P_rr R^n)' = dW/dr R^n``.
    """

    def rise(R: float, at: np.ndarray) -> list[float]:
        r, carried = at
        guess = (R / r) ** power

        def unbalanced(slope: float) -> float:
            return slopes(slope, r, R, power)[0] - carried / R**power

        slope = brentq(unbalanced, 0.7 * guess, 1.4 * guess, xtol=1e-15)
        return [slope, slopes(slope, r, R, power)[1] * R**power]

    end = solve_ivp(rise, radii, list(first), rtol=1e-9, atol=1e-13, method="DOP853").y[:, -1]
    return float(end[1] / radii[1] ** power)


@pytest.mark.parametrize("inner_stretch", [1.2, 1.6])
@pytest.mark.parametrize("power", [1, 2])
def test_with_the_pressure_found_the_outer_face_is_free(power: int, inner_stretch: float) -> None:
    law, radii = neo_hooke(MU), (4.0, 7.0)
    find: dict[int, Callable[..., float]] = {1: lambda *a: radial.tube(*a)[0], 2: radial.sphere_pressure}
    pressure = find[power](law, BULK, radii, inner_stretch)
    inner = inner_stretch * radii[0]
    left = march(power, radii, (inner, -pressure * inner**power))
    assert abs(left) < 1e-7 * pressure  # the tolerance of the march, 1e-9 a step


def incompressible_tube(inner: float, outer: float, stretch: float) -> tuple[float, float]:
    """Pressure [MPa] and force in the wall [N] of a neo-Hookean tube fixed at its length, ``r^2 = R^2 + k`` (Rivlin 1949; Ogden
    1984, ch. 5.3.3): ``p = mu (log(a B / (A b)) + k/2 (1/a^2 - 1/b^2))`` and ``pi a^2 p - pi mu k log(a B / (A b))``.
    """
    a, k = stretch * inner, inner**2 * (stretch**2 - 1)
    b = np.sqrt(outer**2 + k)
    thinned = np.log(a * outer / (inner * b))
    pressure = MU * (thinned + k / 2 * (1 / a**2 - 1 / b**2))
    return pressure, np.pi * a**2 * pressure - np.pi * MU * k * thinned


def test_a_stiffer_bulk_tends_to_incompressible_material_as_one_over_it() -> None:
    law, radii = neo_hooke(MU), (4.0, 7.0)
    truth = [Sphere(MU, *radii).pressure(1.4), *incompressible_tube(*radii, 1.4)]
    off = []
    for bulk in (10.0, 100.0):
        found = [radial.sphere_pressure(law, bulk, radii, 1.4), *radial.tube(law, bulk, radii, 1.4)]
        off.append(np.subtract(found, truth) / truth)
    assert (np.abs(off[0]) < 2.5 * MU / 10).all()
    assert off[0] / off[1] == pytest.approx(10, rel=0.01)  # the next term is mu / K of it


def test_a_wall_at_rest_needs_nothing() -> None:
    found = (
        radial.sphere_pressure(neo_hooke(MU), BULK, (4.0, 7.0), 1.0),
        *radial.tube(neo_hooke(MU), BULK, (4.0, 7.0), 1.0),
    )
    assert found == pytest.approx((0, 0, 0), abs=1e-14)


def test_a_wall_without_balance_is_reported() -> None:
    with pytest.raises(ArithmeticError, match="no balance found"):
        radial.sphere_pressure(neo_hooke(MU), 0.0, (4.0, 7.0), 1.4)  # nothing resists a change of volume
