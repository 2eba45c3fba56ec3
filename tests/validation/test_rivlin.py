"""Closed forms of incompressible bodies against the work done on them, local balance of forces, and quadrature."""

import numpy as np
import pytest
from scipy.integrate import quad

from validation.rivlin import Flexure, Sphere, Torsion

MU = 0.01
ROD = Torsion(0.003, 0.002, 4.0, 0.15)
SPHERE = Sphere(MU, 5.0, 8.0)
BENT = Flexure(MU, 6.0, 20.0, 1.8)


def slope(function, at: float, step: float = 1e-3) -> float:
    """Fourth order central difference."""
    near, far = ((function(at + k * step) - function(at - k * step)) / (2 * k * step) for k in (1, 2))
    return (4 * near - far) / 3


def rod_energy(twist: float, stretch: float) -> float:
    """Per length [N] of a Mooney-Rivlin rod, ``r = R / sqrt(stretch)``, from I1 and I2 at each radius."""

    def density(R: float) -> float:
        shear = twist * R / np.sqrt(stretch)
        F = np.diag([stretch**-0.5, stretch**-0.5, stretch])
        F[1, 2] = shear
        C = F.T @ F
        I1, I2 = np.trace(C), (np.trace(C) ** 2 - np.trace(C @ C)) / 2
        return (ROD.c1 * (I1 - 3) + ROD.c2 * (I2 - 3)) * 2 * np.pi * R

    return quad(density, 0, ROD.radius, epsrel=1e-13)[0]


def test_the_moment_does_the_work_of_twisting() -> None:
    assert slope(lambda twist: rod_energy(twist, 1.0), ROD.twist) == pytest.approx(ROD.moment(), rel=1e-9)


def test_the_axial_force_does_the_work_of_stretching_the_twisted_rod() -> None:
    assert slope(lambda stretch: rod_energy(ROD.twist, stretch), 1.0) == pytest.approx(ROD.axial_force(), rel=1e-9)


def test_the_stress_on_the_end_sums_to_the_axial_force() -> None:
    force = quad(lambda r: ROD.end_stress(r) * 2 * np.pi * r, 0, ROD.radius)[0]
    assert force == pytest.approx(ROD.axial_force(), rel=1e-12)


def shell_energy(la: float) -> float:
    """Of the spherical shell [N mm], from the stretches at each radius."""

    def density(R: float) -> float:
        around = SPHERE.radius(la, R) / R
        return MU / 2 * (2 * around**2 + around**-4 - 3) * 4 * np.pi * R**2

    return quad(density, SPHERE.inner, SPHERE.outer, epsrel=1e-13)[0]


@pytest.mark.parametrize("la", [0.7, 1.2, 2.5])
def test_the_pressure_does_the_work_of_inflating_the_sphere(la: float) -> None:
    swept = 4 * np.pi * SPHERE.inner**3 * la**2
    assert slope(shell_energy, la) / swept == pytest.approx(SPHERE.pressure(la), rel=1e-9)


def test_the_pressure_is_the_integral_over_the_wall() -> None:
    """``p = integral of W'(l) / (l^3 - 1)`` from the outer to the inner stretch, W' = 2 mu (l - l^-5)."""
    la, lb = 1.7, SPHERE.outer_stretch(1.7)
    whole = quad(lambda a: 2 * MU * (a - a**-5) / (a**3 - 1), lb, la, epsrel=1e-13)[0]
    assert SPHERE.pressure(la) == pytest.approx(whole, rel=1e-12)


def test_the_wall_of_the_sphere_keeps_its_volume() -> None:
    a, b = SPHERE.radius(1.7, np.array([5.0, 8.0]))
    assert (a, b) == pytest.approx((5 * 1.7, 8 * SPHERE.outer_stretch(1.7)), rel=1e-14)
    assert b**3 - a**3 == pytest.approx(8**3 - 5**3, rel=1e-13)


def test_beyond_the_limit_point_the_pressure_falls() -> None:
    stretch, pressure = SPHERE.limit_point()
    assert pressure > max(SPHERE.pressure(stretch - 1e-3), SPHERE.pressure(stretch + 1e-3))
    assert (
        abs(slope(SPHERE.pressure, stretch)) < 1e-12
    )  # the difference's own rounding, 1e-17 / 1e-3, and a fifth derivative


def test_a_thin_balloon_has_its_limit_at_the_sixth_root_of_seven() -> None:
    """``p ~ l^-1 - l^-7`` of a membrane, so ``l^6 = 7`` (Holzapfel 2000, ch. 6.5); the wall is 1e-4 of the radius."""
    assert Sphere(MU, 1.0, 1.0001).limit_point()[0] == pytest.approx(7 ** (1 / 6), rel=3e-4)


def test_a_body_at_rest_needs_nothing() -> None:
    assert SPHERE.pressure(1.0) == 0


def test_a_bent_block_keeps_its_volume_and_its_lines_meet_at_right_angles() -> None:
    points = np.random.default_rng(1).uniform(-1, 1, (20, 3)) * [3, 10, 5]
    ticks = 1e-4 * np.eye(3)
    F = np.stack([(BENT.positions(points + t) - BENT.positions(points - t)) / 2e-4 for t in ticks], axis=2)
    C = np.einsum("nik,nim->nkm", F, F)
    around = C[:, 1, 1]
    assert np.linalg.det(F) == pytest.approx(1, abs=1e-8)  # second differences of 1e-4, times the curvature squared
    assert np.allclose(C, np.stack([np.diag([1 / c, c, 1]) for c in around]), rtol=0, atol=1e-7)


def test_the_bent_block_lies_between_its_radii() -> None:
    inner, outer = BENT.radii()
    centre = -np.sqrt((inner**2 + outer**2) / 2)
    for X, truth in ((-3.0, inner), (3.0, outer)):
        place = BENT.positions(np.array([[X, 4.0, 1.0]]))[0] - [centre, 0, 0]
        assert np.hypot(*place[:2]) == pytest.approx(truth, rel=1e-13)
        assert np.arctan2(place[1], place[0]) == pytest.approx(4.0 * 1.8 / 20, rel=1e-13)
        assert place[2] == 1.0
    assert (outer**2 - inner**2) * 1.8 / 2 == pytest.approx(6 * 20, rel=1e-13)  # the area of the block


def test_the_curved_faces_are_free_and_each_arc_is_in_balance() -> None:
    inner, outer = BENT.radii()
    assert BENT.radial_stress(np.array([inner, outer])) == pytest.approx(0, abs=1e-16)
    for r in np.linspace(inner, outer, 7)[1:-1]:
        pulled = (BENT.hoop_stress(r) - BENT.radial_stress(r)) / r
        assert slope(BENT.radial_stress, r) == pytest.approx(pulled, abs=1e-12)


def test_the_stress_on_an_end_has_a_moment_and_no_resultant() -> None:
    inner, outer = BENT.radii()
    assert quad(BENT.hoop_stress, inner, outer)[0] == pytest.approx(0, abs=1e-14)
    assert quad(lambda r: BENT.hoop_stress(r) * r, inner, outer)[0] == pytest.approx(BENT.moment(), rel=1e-10)


def test_the_moment_does_the_work_of_bending() -> None:
    def energy(angle: float) -> float:
        block = Flexure(MU, 6.0, 20.0, angle)
        middle = sum(r**2 for r in block.radii()) / 2

        def density(X: float) -> float:
            square = block.curvature**2 * (middle + 2 * X / block.curvature)
            return MU / 2 * (square + 1 / square - 2) * 20.0

        return quad(density, -3, 3, epsrel=1e-13)[0]

    assert slope(energy, 1.8) == pytest.approx(BENT.moment(), rel=1e-9)


def test_a_thin_block_bends_like_a_plate() -> None:
    """``mu h^3 c / 3``, which is ``E h^3 c / (12 (1 - nu^2))`` with E = 3 mu and nu = 1/2; next term 0.3 (h c)^2 of it."""
    thin = Flexure(MU, 1.0, 20.0, 0.2)
    assert thin.moment() == pytest.approx(MU * 0.01 / 3, rel=0.3 * 0.01**2)


def test_a_block_that_is_hardly_bent_hardly_moves() -> None:
    points = np.random.default_rng(2).uniform(-3, 3, (20, 3))
    assert Flexure(MU, 6.0, 20.0, 1e-9).positions(points) == pytest.approx(points, abs=1e-8)
    assert np.array_equal(Flexure(MU, 6.0, 20.0, 0.0).positions(points), points)
