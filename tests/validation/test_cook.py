"""The second solver of our own against closed forms, differences and published numbers; and what it found for Cook's membrane."""

import numpy as np
import pytest

from validation import cook, plane_strain
from validation.plane_strain import Floats, Law

SHEAR, LAME = 3.0, 5.0


def isochoric(slope: Floats) -> Floats:
    F = np.eye(2) + slope
    return SHEAR / 2 * (np.linalg.det(F) ** (-2 / 3) * ((F**2).sum(axis=(-1, -2)) + 1) - 3)


def coupled(slope: Floats) -> Floats:
    F = np.eye(2) + slope
    J = np.linalg.det(F)
    return SHEAR / 2 * (F**2).sum(axis=(-1, -2)) + LAME / 4 * J**2 - (LAME / 2 + SHEAR) * np.log(J)


def deviatoric(slope: Floats) -> Floats:
    strain = np.zeros((3, 3))
    strain[:2, :2] = (slope + slope.T) / 2
    strain -= np.eye(3) * np.trace(strain) / 3
    return SHEAR * (strain**2).sum()


LAWS = [
    (plane_strain.neo_hooke(SHEAR), isochoric),
    (plane_strain.coupled_neo_hooke(SHEAR, LAME), coupled),
    (plane_strain.small_strain(SHEAR), deviatoric),
]


@pytest.mark.parametrize(("law", "energy"), LAWS)
def test_stress_and_tangent_are_slopes(law: Law, energy) -> None:
    """By central differences of step 1e-5, whose error is some 1e-10 of numbers of size 10."""
    slope = np.array([[0.2, -0.3], [0.1, -0.15]])
    answer = law(slope)
    for i, k in np.ndindex(2, 2):
        step = np.zeros((2, 2))
        step[i, k] = 1e-5
        up, down = law(slope + step), law(slope - step)
        assert (energy(slope + step) - energy(slope - step)) / 2e-5 == pytest.approx(answer.stress[i, k], abs=1e-7)
        assert (up.volume - down.volume) / 2e-5 == pytest.approx(answer.area[i, k], abs=1e-9)
        np.testing.assert_allclose((up.stress - down.stress) / 2e-5, answer.tangent[:, :, i, k], atol=1e-6)
        np.testing.assert_allclose((up.area - down.area) / 2e-5, answer.turn[:, :, i, k], atol=1e-9)


def test_a_clamped_beam_bends_as_timoshenko_says() -> None:
    """``P l^3 / 3 E' I + P l / (k G h)`` with E' = E / (1 - nu^2), k = 5/6. The clamped end lets the section stretch less across
    than the formula, as if the beam were some hundredth of its height shorter: 5e-4 of a beam 80 times as long as high.
    """
    length, young, poisson = 80.0, 1000.0, 0.3
    shear, bulk = young / 2 / (1 + poisson), young / 3 / (1 - 2 * poisson)
    body = plane_strain.grid(
        [(0, 0), (length, 0), (length, 1), (0, 1)], plane_strain.graded(6, 0.4), np.array([0.0, 1.0]), 6
    )
    found = plane_strain.rest(body, plane_strain.small_strain(shear), bulk, (0.0, 0.01))
    bending = 0.01 * length**3 / 3 / (young / (1 - poisson**2) / 12)
    assert found.displacement[-1, 1] == pytest.approx(bending + 0.01 * length / (5 / 6 * shear), rel=8e-4)


def test_a_stretched_strip_thins_as_a_single_equation_says() -> None:
    """A strip 40 long and 1 high, pulled by T: away from the ends the stress across vanishes. Its stretches solve two equations
    here; what the clamped end hinders dies out as exp(-pi x): from the middle to the end the stretch is even.
    """
    shear, bulk, pull = 1.0, 20.0, 0.5
    body = plane_strain.grid(
        [(0, 0), (40, 0), (40, 1), (0, 1)],
        np.array([0, 0.01, 0.03, 0.06, 0.1, 0.15, 0.25, 0.5, 1]),
        np.array([0.0, 1.0]),
        5,
    )
    found = plane_strain.rest(body, plane_strain.neo_hooke(shear), bulk, (pull, 0.0), steps=2)
    place = body.nodes + found.displacement
    corners = np.flatnonzero((body.nodes[:, 1] == 0) & np.isin(body.nodes[:, 0], (20.0, 40.0)))
    top = np.flatnonzero((body.nodes[:, 1] == 1) & (body.nodes[:, 0] == 20))
    along = (place[corners[1], 0] - place[corners[0], 0]) / 20
    across = (place[top, 1] - place[corners[0], 1])[0]
    J, third = along * across, (along**2 + across**2 + 1) / 3
    assert shear * J ** (-2 / 3) * (along - third / along) + bulk * (J - 1) * across == pytest.approx(pull, abs=1e-6)
    assert shear * J ** (-2 / 3) * (across - third / across) + bulk * (J - 1) * along == pytest.approx(0, abs=1e-6)


def test_reaction_equals_load() -> None:
    found = cook.solve(plane_strain.neo_hooke(80.194), 400889.8, 6.25, order=3, layers=1, steps=2)
    np.testing.assert_allclose(found.fixed, (0, -100), atol=1e-6)


def test_a_load_too_large_for_one_step_is_reported() -> None:
    with pytest.raises(ArithmeticError, match="got a cell turned inside out, want smaller steps"):
        cook.solve(plane_strain.neo_hooke(1.0), 1000.0, -3.0, order=2, layers=1)


def test_a_newton_without_end_is_reported() -> None:
    """A law that answers every question with a stress of the other sign of its tangent drives Newton away."""
    right = plane_strain.small_strain(1.0)

    def law(slope: Floats) -> plane_strain.Response:
        answer = right(slope)
        return answer._replace(stress=-3 * answer.stress)

    with pytest.raises(ArithmeticError, match=r"got a last step of .* mm after 30"):
        cook.solve(law, 1.0, 0.1, order=2, layers=1)


@pytest.mark.parametrize("membrane", [cook.COMPRESSIBLE, cook.NEARLY_INCOMPRESSIBLE])
def test_small_strain_tip(membrane: cook.Membrane) -> None:
    """Measured at degree 4 with 2 layers: 1.9e-4 too stiff; and the error falls with the degree and with the layers."""
    coarse, higher, graded = (cook.small_strain_tip(membrane, *level) for level in ((3, 2), (4, 2), (4, 3)))
    assert graded == pytest.approx(membrane.tip, rel=5e-5)
    assert coarse < higher < graded < membrane.tip


def test_finite_strain_tips() -> None:
    """Measured at degree 4 with 2 layers: 1.2e-4 and 2.1e-4 too stiff."""
    assert cook.finite_strain_tip(cook.FINITE_QUARTER, 4, 2, steps=1) == pytest.approx(
        cook.FINITE_QUARTER.tip, rel=2e-4
    )
    assert cook.finite_strain_tip(cook.FINITE, 4, 2, steps=3) == pytest.approx(cook.FINITE.tip, rel=4e-4)


def test_linear_at_the_start_as_small_strain_says() -> None:
    """At 1e-4 of the load, by the small strain solution of the same moduli: terms of second order are some 1e-4."""
    small = cook.Membrane(cook.FINITE.shear, cook.FINITE.bulk, 0.01, tip=np.nan, error=np.nan)
    assert cook.finite_strain_tip(small, 3, 1, steps=1) == pytest.approx(cook.small_strain_tip(small, 3, 1), rel=2e-4)


def test_published_tips_are_near() -> None:
    """CoFEA's quadratic meshes are up to 0.3 % stiffer than ours; linear cells of OpenGeoSys, 30 along a side and still rising,
    1 %.
    """
    ours = cook.COMPRESSIBLE.tip * 100 / 70
    for theirs in cook.COFEA:
        assert 0 < ours - theirs < 0.004 * ours
    nearly = cook.NEARLY_INCOMPRESSIBLE.tip * 100 / 240.565
    assert 0 < nearly - cook.OPENGEOSYS_SMALL < 0.01 * nearly
    assert 0 < cook.FINITE.tip - cook.OPENGEOSYS_FINITE < 0.01 * cook.FINITE.tip


def test_a_published_tip_at_finite_strain_is_met() -> None:
    """Five published digits; degree 4 with 2 layers gives 6.1457, 2e-4 too stiff (degree 6 with 3 layers 6.1473)."""
    shear, lame = 200 / 2 / 1.35, 200 * 0.35 / 1.35 / 0.3
    found = cook.solve(plane_strain.coupled_neo_hooke(shear, lame), 1e-9, 4.0, order=4, layers=2, steps=2)
    assert found.displacement[-1, 1] == pytest.approx(cook.MUELLER, rel=3e-4)
