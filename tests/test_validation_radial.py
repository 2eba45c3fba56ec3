"""Bodies of a finite bulk modulus against a second method, integration from the inside out, and against their limits."""

from collections.abc import Callable

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

from validation import radial
from validation.laws import MooneyRivlin, neo_hooke
from validation.rivlin import Sphere, Torsion, Tube

MU, BULK = 0.01, 0.4


def slopes(slope: float, r: float, R: float, power: int, twist: float) -> np.ndarray:
    """Of the neo-Hookean energy in r' and in r, from the invariants of each geometry; J^(-2/3) I1 and K/2 (J - 1)^2."""
    around = power * (r / R) ** 2 + (1 + (twist * r) ** 2) * (power == 1)
    I1, J = slope**2 + around, slope * (r / R) ** power
    volume = BULK * (J - 1) - MU / 3 * J ** (-5 / 3) * I1
    by_radius = 2 * power * r / R**2 + 2 * twist**2 * r * (power == 1)
    return MU / 2 * J ** (-2 / 3) * np.array([2 * slope, by_radius]) + volume * J * np.array([1 / slope, power / r])


def march(power: int, twist: float, radii: tuple[float, float], first: tuple[float, float]) -> tuple[float, float]:
    """From the inner face, where r and P_rr R^n are ``first``, to the outer: P_rr there, and the moment, by the Euler-Lagrange
    equation of the energy, ``(P_rr R^n)' = dW/dr R^n``.
    """

    def rise(R: float, at: np.ndarray) -> list[float]:
        r, carried, _ = at
        guess = (R / r) ** power

        def unbalanced(slope: float) -> float:
            return slopes(slope, r, R, power, twist)[0] - carried / R**power

        slope = brentq(unbalanced, 0.7 * guess, 1.4 * guess, xtol=1e-15)
        moment = 2 * np.pi * MU * (slope * r / R) ** (-2 / 3) * twist * r**2 * R
        return [slope, slopes(slope, r, R, power, twist)[1] * R**power, moment]

    end = solve_ivp(rise, radii, [*first, 0.0], rtol=1e-9, atol=1e-13, method="DOP853").y[:, -1]
    return end[1] / radii[1] ** power, end[2]


@pytest.mark.parametrize("inner_stretch", [1.2, 1.6])
@pytest.mark.parametrize("power", [1, 2])
def test_with_the_pressure_found_the_outer_face_is_free(power: int, inner_stretch: float) -> None:
    law, radii = neo_hooke(MU), (4.0, 7.0)
    find: dict[int, Callable[..., float]] = {1: lambda *a: radial.tube(*a)[0], 2: radial.sphere_pressure}
    pressure = find[power](law, BULK, radii, inner_stretch)
    inner = inner_stretch * radii[0]
    left, _ = march(power, 0.0, radii, (inner, -pressure * inner**power))
    assert abs(left) < 1e-7 * pressure  # the tolerance of the march, 1e-9 a step


def test_the_moment_is_that_of_the_march() -> None:
    """From near the axis, where r is a multiple of R that leaves the side free; what is left out is (1e-3)^2 of the whole."""
    radii, twist = (4e-3, 4.0), 0.2

    def start(share: float) -> tuple[float, float]:
        return share * radii[0], slopes(share, share * radii[0], radii[0], 1, twist)[0] * radii[0]

    share = brentq(lambda share: march(1, twist, radii, start(share))[0], 0.95, 1.05, xtol=1e-9)
    truth = march(1, twist, radii, start(share))[1]
    assert radial.torsion(neo_hooke(MU), BULK, 4.0, twist)[0] == pytest.approx(truth, rel=1e-6)


def test_a_stiffer_bulk_tends_to_incompressible_matter_as_one_over_it() -> None:
    law, radii = MooneyRivlin(0.003, 0.002), (4.0, 7.0)
    rod, shell, pipe = Torsion(0.003, 0.002, 4.0, 0.2), Sphere(MU, *radii), Tube(MU, *radii)
    truth = [shell.pressure(1.4), pipe.pressure(1.4), pipe.axial_force(1.4), rod.moment(), rod.axial_force()]
    off = []
    for bulk in (10.0, 100.0):
        found = [radial.sphere_pressure(neo_hooke(MU), bulk, radii, 1.4), *radial.tube(neo_hooke(MU), bulk, radii, 1.4)]
        off.append(np.subtract([*found, *radial.torsion(law, bulk, 4.0, 0.2)], truth) / truth)
    assert (np.abs(off[0]) < 2.5 * MU / 10).all()
    assert off[0] / off[1] == pytest.approx(10, rel=0.01)  # the next term is mu / K of it


def test_a_slight_twist_is_that_of_any_bulk_modulus() -> None:
    """No volume changes at first order: ``M = pi/2 mu A^4 twist``; the next term is of the order of (A twist)^2."""
    moment, _ = radial.torsion(neo_hooke(MU), 0.02, 4.0, 1e-4)
    assert moment == pytest.approx(np.pi / 2 * MU * 4.0**4 * 1e-4, rel=(4e-4) ** 2)


def test_a_wall_at_rest_needs_nothing() -> None:
    found = (
        radial.sphere_pressure(neo_hooke(MU), BULK, (4.0, 7.0), 1.0),
        *radial.tube(neo_hooke(MU), BULK, (4.0, 7.0), 1.0),
    )
    assert found == pytest.approx((0, 0, 0), abs=1e-14)


def test_a_wall_without_balance_is_told() -> None:
    with pytest.raises(ArithmeticError, match="no balance found"):
        radial.sphere_pressure(neo_hooke(MU), 0.0, (4.0, 7.0), 1.4)  # nothing resists a change of volume
