"""Hertz's formulas against each other and against Boussinesq's half-space under a spread load."""

import math
from itertools import pairwise

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.special import ellipk

from validation.hertz import Hertz, Side, force_at, rigid_sphere

PRESSED = rigid_sphere(10.0, 0.03, 0.3, 0.02)


def test_the_pressure_carries_the_force() -> None:
    a = PRESSED.contact_radius
    force = quad(lambda r: PRESSED.pressure(r) * 2 * math.pi * r, 0, a)[0]
    assert force == pytest.approx(PRESSED.force, rel=1e-8)  # quadrature beside the root at the edge
    assert PRESSED.pressure(np.array([0.0, a, 2 * a])) == pytest.approx([PRESSED.peak_pressure, 0, 0], abs=1e-15)


def test_force_and_approach_undo_each_other() -> None:
    assert force_at(10.0, 0.03, 0.3, PRESSED.approach) == pytest.approx(0.02, rel=1e-13)


def test_the_work_of_pressing_is_half_of_what_the_pressure_moved() -> None:
    """The work, the integral of the force over the approach, is stored: half of pressure times displacement (Clapeyron)."""
    a = PRESSED.contact_radius
    work = quad(lambda d: force_at(10.0, 0.03, 0.3, d), 0, PRESSED.approach)[0]
    stored = quad(lambda r: PRESSED.pressure(r) * PRESSED.sunk(PRESSED.second, r) * math.pi * r, 0, a)[0]
    assert stored == pytest.approx(work, rel=1e-8)  # quadrature beside the root at the edge


def test_inside_the_contact_the_surface_has_the_shape_of_the_sphere() -> None:
    """``u(r) = approach - r^2 / (2 R)``: both bodies touch everywhere inside, and outside the gap is open."""
    distance = np.linspace(0, 3, 31) * PRESSED.contact_radius
    gap = PRESSED.sunk(PRESSED.second, distance) - (PRESSED.approach - distance**2 / 20)
    assert gap[:11] == pytest.approx(0, abs=1e-15)
    assert (gap[11:] > 0).all()


@pytest.mark.parametrize("share", [0.0, 0.6, 1.5, 4.0])
def test_the_surface_sinks_as_boussinesq_says(share: float) -> None:
    """``u(r) = (1 - nu^2)/(pi E)`` times the integral over the contact of pressure / distance, rings of ``4 s K(m) / (r + s)``."""
    a, r = PRESSED.contact_radius, share * PRESSED.contact_radius

    def ring(s: float) -> float:
        return PRESSED.pressure(s) * 4 * s / (r + s) * ellipk(4 * r * s / (r + s) ** 2)

    ends = [0.0, r, a] if 0 < r < a else [0.0, a]
    whole = sum(quad(ring, low, high, limit=200)[0] for low, high in pairwise(ends))
    truth = PRESSED.second.compliance / math.pi * whole
    assert PRESSED.sunk(PRESSED.second, r) == pytest.approx(truth, rel=1e-7)  # quadrature up to a logarithm


def test_two_spheres_share_the_approach_by_their_compliance() -> None:
    both = Hertz(Side(8.0, 2.0, 0.3), Side(24.0, 5.0, 0.45), 0.7)
    assert both.radius == pytest.approx(6.0)
    assert sum(both.sunk(side, 0.0) for side in (both.first, both.second)) == pytest.approx(both.approach, rel=1e-13)
    assert both.sunk(both.first, 0.0) / both.sunk(both.second, 0.0) == pytest.approx((0.91 / 2) / (0.7975 / 5))
