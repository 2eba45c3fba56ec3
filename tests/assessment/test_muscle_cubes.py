"""Quantities of cubes on laws for which they are known, and the shipped material as it is shipped."""

import pytest

from fem_reference.assessment import muscle_cubes
from fem_reference.assessment.muscle_cubes import QUANTITIES, SHIPPED, both_orders, stiffness_ratio, with_collagen
from fem_reference.effects import make
from fem_reference.scenes import casefile

OF = {one.name: one for one in QUANTITIES}
ISOTROPIC = SHIPPED[:2]
MU, C = 0.01, 0.3 * 0.05 * 6.6  # of the matrix and, in small strain, of the fibres [MPa]


def test_the_material_is_that_of_a_shipped_case() -> None:
    shipped = {type(one): one for one in casefile.read_muscle("hip_flexion").effects}
    matrix, volume, fibres = SHIPPED
    assert shipped[type(matrix)] == matrix
    assert shipped[type(fibres)] == fibres
    assert (
        next(one for name, one in ((type(e).__name__, e) for e in shipped.values()) if name == "Incompressible").bulk
        == volume.bulk
    )


def test_an_isotropic_cube_has_no_direction() -> None:
    """Poisson ratios of 0.5 but for mu / K = 1e-3 of it, stresses alike in all directions, and no order."""
    for name in ("cube_poisson_along", "cube_poisson_fibre", "cube_poisson_across"):
        assert OF[name].of(ISOTROPIC) == pytest.approx(0.5, abs=1e-3)
    assert stiffness_ratio(0.9)(ISOTROPIC) == pytest.approx(1, abs=1e-9)
    assert [OF[name].of(ISOTROPIC) for name in ("cube_softest_midway", "cube_stiffest_across")] == [0, 0]


def test_confinement_of_an_isotropic_cube_is_that_of_pure_shear() -> None:
    """Nominal stresses ``mu (l - l^-3)`` and ``mu (l - l^-2)`` of an incompressible neo-Hookean cube; mu / K is 1e-3."""
    assert OF["cube_confinement"].of(ISOTROPIC) == pytest.approx((0.9 - 0.9**-3) / (0.9 - 0.9**-2), rel=2e-3)


def test_small_strains_are_those_of_linear_elasticity() -> None:
    """Across ``nu = 1 / (2 + c / 2 mu)`` and E = 2 mu (2 - nu); along 3 mu, as fibres are slack. 1e-3 of strain leaves p2 of it."""
    poisson = 1 / (2 + C / (2 * MU))
    assert muscle_cubes.poisson(0.999, 90, 1)(SHIPPED) == pytest.approx(poisson, rel=0.01)
    assert stiffness_ratio(0.999)(SHIPPED) == pytest.approx(3 / (2 * (2 - poisson)), rel=0.01)


def test_fibres_in_tension_only_meet_neither_order_and_collagen_across_meets_both() -> None:
    assert both_orders(SHIPPED) == both_orders(ISOTROPIC) == 0
    assert both_orders(with_collagen(0.3, 0.2, 1.5)) == 1
    assert (
        both_orders(
            (*ISOTROPIC, make("fibre_passive", **muscle_cubes.FIBRES), make("collagen_across", k1=1e-6, k2=1.5))
        )
        == 0
    )


def test_ratios_do_not_depend_on_the_scale_of_the_stress() -> None:
    twice = (
        make("neo_hooke", mu=2 * MU),
        make("incompressible_penalty", bulk="20 MPa"),
        make("fibre_passive", **muscle_cubes.FIBRES | {"stress": 0.6}),
    )
    for one in QUANTITIES:
        assert one.of(twice) == pytest.approx(one.of(SHIPPED), rel=1e-6), one.name


def test_every_quantity_has_facts_a_reason_and_an_uncertainty() -> None:
    for one in QUANTITIES:
        assert one.within > 0
        assert one.because
        assert one.facts
        assert {fact.experiment for fact in one.facts} == {one.experiment}
