"""Laws against their own energies, and homogeneous states against work, limits and equations of one unknown."""

from itertools import pairwise

import numpy as np
import pytest
from scipy.integrate import quad

from validation import homogeneous, loads
from validation.fibre_laws import FibreActive, FibreLaw, FibrePassive, FibrePassiveFebio
from validation.laws import ActiveTension, Guccione, HolzapfelOgden, MooneyRivlin, Prestretched, Together, neo_hooke

FIBRE = np.array([2.0, -1.0, 2.0]) / 3
X = np.array([1.0, 0.0, 0.0])
PASSIVE = FibrePassive(0.3, 0.05, 6.6, 1.06, 1.4)
FEBIO = FibrePassiveFebio(0.02, 6.0, 1.5, 1.3)
ACTIVE = FibreActive(0.3, 1.1, 0.7)
HOLZAPFEL = HolzapfelOgden(0.03, 2.0, 0.7, (0.0, 0.0, 2.0))
MATRIX = MooneyRivlin(0.004, 0.003)
ISOCHORIC = {
    "neo_hooke": neo_hooke(0.01),
    "mooney_rivlin": MATRIX,
    "fibre_passive": PASSIVE,
    "fibre_passive_febio": FEBIO,
    "fibre_active": ACTIVE,
    "holzapfel_ogden": HOLZAPFEL,
    "prestretched": Prestretched(Together((MATRIX, PASSIVE)), 1.1),
    "together": Together((MATRIX, FEBIO, ACTIVE)),
}
LAWS = ISOCHORIC | {"active_tension": ActiveTension(0.06), "guccione": Guccione(0.002, 8.0, 2.0, 4.0)}
MUSCLE = Together((MATRIX, PASSIVE, ACTIVE))


def deformations() -> list[np.ndarray]:
    rng = np.random.default_rng(4)
    return [np.eye(3) + 0.3 * rng.uniform(-1, 1, (3, 3)) for _ in range(12)]


def turn(axis: np.ndarray, angle: float) -> np.ndarray:
    cross = np.cross(np.eye(3), -axis)
    return np.eye(3) + np.sin(angle) * cross + (1 - np.cos(angle)) * cross @ cross


@pytest.mark.parametrize("name", LAWS)
def test_the_stress_is_the_slope_of_the_energy(name: str) -> None:
    law, step = LAWS[name], 1e-4
    for F in deformations():
        slope = np.zeros((3, 3))
        for place in np.ndindex(3, 3):
            nudge = np.zeros((3, 3))
            nudge[place] = step
            near, far = (
                (law.energy(F + k * nudge, FIBRE) - law.energy(F - k * nudge, FIBRE)) / (2 * k * step) for k in (1, 2)
            )
            slope[place] = (4 * near - far) / 3
        stress = law.stress(F, FIBRE)
        # fourth order differences: rounding 1e-16 / 1e-4 of the energy and 1e-16 of the fifth derivative's part
        assert np.allclose(slope, stress, rtol=0, atol=1e-9 * (1 + np.abs(stress).max()))


@pytest.mark.parametrize("name", LAWS)
def test_turning_the_body_costs_nothing(name: str) -> None:
    Q = turn(FIBRE[::-1], 2.0)
    for F in deformations():
        assert LAWS[name].energy(Q @ F, FIBRE) == pytest.approx(LAWS[name].energy(F, FIBRE), rel=1e-11)


@pytest.mark.parametrize("name", ISOCHORIC)
def test_a_change_of_volume_costs_nothing(name: str) -> None:
    for F in deformations():
        assert LAWS[name].energy(1.3 * F, FIBRE) == pytest.approx(LAWS[name].energy(F, FIBRE), rel=1e-11, abs=1e-15)
        assert abs(np.sum(LAWS[name].stress(F, FIBRE) * F)) < 1e-12


@pytest.mark.parametrize(
    "name", ["neo_hooke", "mooney_rivlin", "fibre_passive", "fibre_passive_febio", "holzapfel_ogden", "guccione"]
)
def test_the_rest_state_is_free_of_stress(name: str) -> None:
    assert abs(LAWS[name].energy(np.eye(3), FIBRE)) < 1e-17
    assert np.abs(LAWS[name].stress(np.eye(3), FIBRE)).max() < 1e-16


def test_the_shear_modulus_at_rest_is_twice_the_sum_of_both_constants() -> None:
    sheared = homogeneous.simple_shear(MATRIX, 10.0, 1e-6)
    assert sheared.P[0, 1] / 1e-6 == pytest.approx(2 * (0.004 + 0.003), rel=1e-8)  # rounding of P over the amount


@pytest.mark.parametrize("law", [PASSIVE, FEBIO, ACTIVE], ids=["passive", "febio", "active"])
def test_what_a_fibre_stores_is_the_integral_of_its_slope(law: FibreLaw) -> None:
    joints = [0.44, 0.66, 1.0, 1.06, 1.3, 1.484, 1.54, 1.76]
    for stretch in (0.5, 0.9, 1.2, 1.45, 1.9):
        ends = [0.4, *(joint for joint in joints if joint < stretch), stretch]
        whole = sum(quad(law.slope, low, high, epsabs=1e-15)[0] for low, high in pairwise(ends))
        assert law.stored(stretch) == pytest.approx(whole, rel=1e-12, abs=1e-15)


def test_a_fibre_has_no_jump_at_its_joints() -> None:
    for law, joints in ((PASSIVE, (1.06, 1.484)), (FEBIO, (1.0, 1.3)), (ACTIVE, (0.44, 0.66, 1.54, 1.76))):
        for joint in joints:
            assert law.slope(joint + 1e-12) == pytest.approx(law.slope(joint - 1e-12), abs=1e-10)


def test_the_passive_fibre_straightens_without_a_kink() -> None:
    before, after = ((PASSIVE.slope(1.484 + a) - PASSIVE.slope(1.484 + b)) / 1e-6 for a, b in ((0, -1e-6), (1e-6, 0)))
    assert before == pytest.approx(after, rel=1e-5)  # the slope's own change over 1e-6, 6.6e-6 of it


def test_values_of_the_fibre_laws_by_hand() -> None:
    assert PASSIVE.slope(1.06 * 1.2) == pytest.approx(0.3 / 1.06 * 0.05 * (np.exp(6.6 * 0.2) - 1), rel=1e-12)
    assert FEBIO.slope(1.2) * 1.2 == pytest.approx(0.02 * (np.exp(6.0 * 0.2) - 1), rel=1e-12)
    assert FEBIO.slope(1.5) * 1.5 == pytest.approx(0.02 * (np.exp(6.0 * 0.3) - 1) + 1.5 * 0.2, rel=1e-12)
    assert [
        ACTIVE.slope(1.1 * length) * 1.1 / 0.21 for length in (0.3, 0.5, 0.6, 0.8, 1.0, 1.4, 1.5, 1.7)
    ] == pytest.approx([0, 0.09, 0.36, 0.84, 1, 0.36, 0.09, 0], abs=1e-12)


def test_slack_fibres_carry_exactly_nothing() -> None:
    squeezed = np.eye(3) - 0.2 * np.outer(FIBRE, FIBRE)
    assert not PASSIVE.stress(squeezed, FIBRE).any()
    assert not FEBIO.stress(squeezed, FIBRE).any()
    shortened = np.diag([0.8, 0.8, 1 / 0.64])
    assert not HOLZAPFEL.stress(shortened, X).any()


def test_active_tension_is_a_constant_second_stress_and_a_pressure() -> None:
    # At J = 1; a pressure is a multiple of C^-1.
    for F in deformations():
        F = F / np.cbrt(np.linalg.det(F))
        second = np.linalg.solve(F, ActiveTension(0.06).stress(F, FIBRE))
        rest = (second - 0.06 * np.outer(FIBRE, FIBRE)) @ (F.T @ F)
        assert np.allclose(rest, np.trace(rest) / 3 * np.eye(3), rtol=0, atol=1e-15)


def test_guccione_has_no_preferred_direction_across_the_fibre() -> None:
    law = LAWS["guccione"]
    for F in deformations():
        assert law.energy(F @ turn(FIBRE, 0.9), FIBRE) == pytest.approx(law.energy(F, FIBRE), rel=1e-11)


def test_guccione_along_across_and_between() -> None:
    # At J = 1: longer along one axis and shorter along the other, E = (l^2 - 1)/2 in both;
    # sheared along the fibre, E_fs = g/2, E_ss = g^2/2.
    law = LAWS["guccione"]
    longer, shorter = ((stretch**2 - 1) / 2 for stretch in (1.2, 1 / 1.2))
    along = 8 * longer**2 + 2 * shorter**2
    assert law.energy(np.diag([1.2, 1 / 1.2, 1]), X) == pytest.approx(0.001 * (np.exp(along) - 1), rel=1e-12)
    across = 2 * longer**2 + 2 * shorter**2
    assert law.energy(np.diag([1, 1.2, 1 / 1.2]), X) == pytest.approx(0.001 * (np.exp(across) - 1), rel=1e-12)
    sheared = np.eye(3) + 0.2 * np.outer(X, [0, 1, 0])
    between = 2 * 4 * 0.1**2 + 2 * 0.02**2
    assert law.energy(sheared, X) == pytest.approx(0.001 * (np.exp(between) - 1), rel=1e-12)


def test_the_families_lie_at_their_angle_to_the_fibre_and_across_the_normal() -> None:
    one, other = HOLZAPFEL.families(X)
    assert one @ X == pytest.approx(np.cos(0.7))
    assert one @ other == pytest.approx(np.cos(1.4))
    assert abs(one[2]) < 1e-16
    along = HolzapfelOgden(0.03, 2.0, 0.0, (0.0, 0.0, 1.0))
    stretched = np.diag([1.2, 1.2**-0.5, 1.2**-0.5])
    assert along.energy(stretched, X) == pytest.approx(2 * 0.03 / 4 * (np.exp(2 * 0.44**2) - 1), rel=1e-12)


def test_a_prestretched_body_is_free_where_its_fibres_are_slack_again() -> None:
    law = Prestretched(Together((MATRIX, PASSIVE)), 1.1)
    slack = np.diag([1 / 1.1, 1.1**0.5, 1.1**0.5])
    assert np.abs(law.stress(slack, X)).max() < 1e-16
    assert law.stress(np.eye(3), X)[0, 0] > 0
    assert np.diag(slack) == pytest.approx(homogeneous.pulled(law, 10.0, 0.0).stretches, rel=1e-12)


@pytest.mark.parametrize("law", [neo_hooke(0.01), MATRIX, MUSCLE, LAWS["guccione"], Together((MATRIX, HOLZAPFEL))])
@pytest.mark.parametrize(
    ("mode", "pulling"),
    [("uniaxial", [(0, 0)]), ("equibiaxial", [(0, 0), (1, 1)]), ("planar", [(0, 0)]), ("simple_shear", [(0, 1)])],
)
def test_the_work_of_the_fixed_stresses_is_the_energy(law: MooneyRivlin, mode: str, pulling: list) -> None:
    """What is free does no work, so the energy along the path has the fixed stress as its slope; a wrong free stretch shows."""

    def energy(amount: float) -> float:
        F = getattr(homogeneous, mode)(law, 5.0, amount).F
        return law.energy(F, X) + 5.0 / 2 * (np.linalg.det(F) - 1) ** 2

    state, step = getattr(homogeneous, mode)(law, 5.0, 1.25), 1e-4
    near, far = ((energy(1.25 + k * step) - energy(1.25 - k * step)) / (2 * k * step) for k in (1, 2))
    assert (4 * near - far) / 3 == pytest.approx(sum(state.P[place] for place in pulling), rel=1e-8)


@pytest.mark.parametrize(("mode", "power"), [("uniaxial", -2), ("equibiaxial", -5), ("planar", -3)])
@pytest.mark.parametrize("stretch", [0.6, 1.5])
def test_stresses_tend_to_those_of_incompressible_matter(mode: str, power: int, stretch: float) -> None:
    """``mu (l - l^power)``, Holzapfel 2000, ch. 6.5; the difference falls as mu / K."""
    truth = stretch - stretch**power
    off = [getattr(homogeneous, mode)(neo_hooke(1.0), bulk, stretch).P[0, 0] - truth for bulk in (1e3, 1e4)]
    assert abs(off[1]) < 1e-3 * abs(truth)
    assert off[0] / off[1] == pytest.approx(10, rel=0.05)  # the next term of the series is mu / K smaller


@pytest.mark.parametrize("stretch", [0.3, 0.9, 1.0, 1.2, 2.0])
@pytest.mark.parametrize("bulk", [0.05, 10.0, 1000.0])
def test_two_paths_to_a_uniaxial_state_meet(stretch: float, bulk: float) -> None:
    state = homogeneous.uniaxial(neo_hooke(0.01), bulk, stretch)
    # the bulk modulus multiplies the rounding of J, 1e-16, in the stress
    assert np.linalg.det(state.F) == pytest.approx(loads.squeezed_volume(0.01, bulk, stretch), rel=1e-12)
    assert state.P[0, 0] == pytest.approx(loads.squeeze_force(0.01, bulk, stretch, 1.0), rel=1e-11, abs=1e-15 * bulk)
    assert np.abs(state.P[[1, 2], [1, 2]]).max() < 1e-13 * (bulk + 1)


def test_fibres_in_a_plane_narrow_the_body_in_that_plane() -> None:
    state = homogeneous.uniaxial(Together((neo_hooke(0.01), HOLZAPFEL)), 10.0, 1.3)
    assert state.stretches[1] < 0.9 * state.stretches[2]


def test_fibres_along_any_axis_are_the_same_body_turned() -> None:
    along = homogeneous.planar(MUSCLE, 5.0, 1.2, np.array([0.0, 1.0, 0.0]))
    truth = homogeneous.nominal_stress(MUSCLE, 5.0, np.diag(along.stretches[[1, 0, 2]]), X)
    assert np.diag(along.P)[[1, 0, 2]] == pytest.approx(np.diag(truth), abs=1e-15)


def test_pulling_undoes_stretching() -> None:
    for stretch in (0.8, 1.3):
        stretched = homogeneous.uniaxial(MUSCLE, 5.0, stretch)
        found = homogeneous.pulled(MUSCLE, 5.0, stretched.P[0, 0])
        assert found.stretches == pytest.approx(stretched.stretches, rel=1e-11)


def test_simple_shear_needs_a_normal_stress() -> None:
    """Neo-Hooke, traceless: ``T_11 - T_22 = mu amount^2`` (Rivlin's universal relation: amount times the shear stress)."""
    state = homogeneous.simple_shear(neo_hooke(0.01), 10.0, 0.5)
    T = state.P @ state.F.T  # no volume changes
    assert T[0, 0] - T[1, 1] == pytest.approx(0.5 * T[0, 1], rel=1e-12)
    assert T[0, 1] == pytest.approx(0.005, rel=1e-12)


def test_fibres_that_a_stretch_would_turn_are_refused() -> None:
    with pytest.raises(ValueError, match="want fibres that no stretch along the axes turns"):
        homogeneous.uniaxial(MUSCLE, 5.0, 1.2, FIBRE)


def test_a_body_that_cannot_carry_the_pull_is_reported() -> None:
    with pytest.raises(ArithmeticError, match="no homogeneous state found"):
        homogeneous.pulled(ACTIVE, 1.0, 0.5)  # a fibre alone, that pulls with 0.19 MPa at most


def test_a_law_of_the_fibre_says_what_it_lacks() -> None:
    with pytest.raises(NotImplementedError, match="FibreLaw has no energy"):
        FibreLaw().stored(1.0)
    with pytest.raises(NotImplementedError, match="FibreLaw has no slope"):
        FibreLaw().slope(1.0)
