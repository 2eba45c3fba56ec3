"""Quantities of cubes on laws for which they are known, and the shipped material as it is shipped."""

import math

import numpy as np
import pytest

import fem_reference as fr
from fem_reference.assessment import muscle_cubes
from fem_reference.assessment.muscle_cubes import (
    QUANTITIES,
    SHIPPED,
    SQUEEZED,
    VOLUME,
    Material,
    both_orders,
    cube,
    stiffness_ratio,
    with_collagen,
)
from fem_reference.effects import make
from fem_reference.problems.body import Body, ByCell, Prescribed
from fem_reference.problems.paths import Affine, Rest
from fem_reference.problems.shapes import box
from fem_reference.scenes import casefile

OF = {one.name: one for one in QUANTITIES}
ISOTROPIC = SHIPPED[:2]
MU, C = 0.01, 0.3 * 0.05 * 6.6  # of the matrix and, in small strain, of the fibres [MPa]
COLLAGEN = with_collagen(0.3, 0.2, 1.5)
RESIDUAL = 1e-12  # [N] of nodal forces in a cube of 1 mm, which ends Newton's iteration


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


def squeezed(material: Material, degrees: float, boxes: int, steps: int, *, confined: bool, lean: float) -> Body:
    """A cube of 1 mm, of six tetrahedra in each of ``boxes`` along each side, between frictionless plates: those at both ends of x
    close in equal load ``steps`` and ``lean`` by so much per mm of y.
    """
    mesh, angle = box((boxes,) * 3, (1.0, 1.0, 1.0), "tetrahedron"), math.radians(degrees)
    path = Affine(((SQUEEZED - 1, lean, 0), (0, 0, 0), (0, 0, 0)), knots=((0, 0), (steps, 1)))
    plates = [Prescribed("floor", "x0", (0,), path), Prescribed("lid", "x1", (0,), path)]
    walls = [("y0", 1), ("z0", 2), *([("z1", 2)] if confined else [])]
    plates += [Prescribed(on, on, (axis,), Rest()) for on, axis in walls]
    effects = tuple(make("incompressible", bulk=VOLUME.bulk) if one is VOLUME else one for one in material)
    fibre = ByCell(np.tile([math.cos(angle), math.sin(angle), 0.0], (len(mesh.cells), 1)))
    return Body(mesh, effects, tuple(plates), tuple(range(steps + 1)), fibre)


def solved(body: Body) -> fr.Run:
    """The run of the reference; no load step can be halved or grow."""
    steps = {"first_step": 1.0, "smallest_step": 1.0, "largest_step": 1.0}
    run = fr.solve_body(body, element="P2/P1", residual=RESIDUAL, **steps)
    assert run.outcome.status == "converged"
    return run


@pytest.mark.slow
@pytest.mark.parametrize("steps", [1, 5])
@pytest.mark.parametrize("boxes", [1, 2])
@pytest.mark.parametrize(
    ("material", "degrees", "confined"),
    [(SHIPPED, 0, False), (SHIPPED, 45, False), (SHIPPED, 90, False), (SHIPPED, 90, True), (COLLAGEN, 45, False)],
    ids=["along", "midway", "across", "confined", "leaning"],
)
def test_neither_mesh_nor_steps_matter(fem_lab, material, degrees, confined, boxes, steps) -> None:  # noqa: ARG001
    """Every point and the stress on the plates are those of the material point, a root exact to 1e-14 of stretch (1e-13 MPa).

    A residual moves the force on a plate by its work in the homogeneous field per mm of compression: by less than its norm times
    the root of 4 n, as at each of n nodes displacements are below 1 mm along each axis and pressures below 1 MPa. It moves nodes
    by less than its norm over the least stiffness, mu / n or more (the lowest mode, a quarter wave in a cube of 1 mm, has
    mu / 2 (pi / 2)^2 / n).

    At 45 degrees the shipped fibres are slack, and the cube stays straight; with collagen it leans, as plates do here.
    """
    known = cube(material, SQUEEZED, degrees, confined=confined)
    lean = float(known.F[0, 1])
    assert (abs(lean) > 1e-3) == (material is COLLAGEN)
    body = squeezed(material, degrees, boxes, steps, confined=confined, lean=lean)
    last, nodes = solved(body).states[-1], (2 * boxes + 1) ** 3
    assert last.forces["lid"] == pytest.approx([known.P[0, 0], 0, 0], abs=RESIDUAL * math.sqrt(4 * nodes))
    assert last.points == pytest.approx(body.mesh.points @ known.F.T, abs=RESIDUAL * nodes / MU)


@pytest.mark.slow
def test_plates_that_cannot_lean_are_another_problem(fem_lab) -> None:  # noqa: ARG001
    """At 45 degrees with collagen they hinder the cube: it is stiffer, by less than the 1 % that an order asks for, and bends."""
    known = cube(COLLAGEN, SQUEEZED, 45)
    body = squeezed(COLLAGEN, 45, 2, 1, confined=False, lean=0.0)
    last = solved(body).states[-1]
    assert 1.001 < last.forces["lid"][0] / known.P[0, 0] < 1.01
    assert np.ptp(last.points[np.unique(body.mesh.facets["y1"]), 1]) > 1e-3
