"""The reference solves bodies: what it refuses, springs, balance, the order of nodes, and processes that die."""

import itertools
from dataclasses import replace

import numpy as np
import pytest

from fem_reference import effects
from fem_reference.effects import Effect
from fem_reference.foundations.errors import InputError
from fem_reference.foundations.records import parse
from fem_reference.problems import shapes
from fem_reference.problems.body import ELEMENTS, Body, Cells, Prescribed, outer_facets
from fem_reference.problems.checks import check
from fem_reference.problems.paths import Affine, Rest, Turn
from fem_reference.solvers import fenicsx, scikit_fem
from fem_reference.solvers.fenicsx import BodySettings

pytestmark = pytest.mark.slow

ALL = (0, 1, 2)
ONCE = [{"frame": 0, "amount": 0.0}, {"frame": 1, "amount": 1.0}]
BOTH = pytest.mark.parametrize("element", ["P2/P1", "Q1/P0"])


def effect(name: str, **parameters) -> Effect:
    return parse(effects.find(name), parameters, name)


FLESH = (effect("neo_hooke", mu="10 kPa"), effect("incompressible", bulk="1 MPa"))
PENALTY = (effect("neo_hooke", mu="10 kPa"), effect("incompressible_penalty", bulk="1 MPa"))


def box(element: str, counts=(2, 2, 2), size=(1.0, 1.0, 1.0)) -> Cells:
    return shapes.box(counts, size, ELEMENTS[element][0])


def turned(mesh: Cells, top, bottom=None) -> Body:
    fixed = (Prescribed("bottom", "z0", ALL, bottom or Rest()), Prescribed("top", "z1", ALL, top))
    return Body(mesh, FLESH, fixed, (0.0, 1.0))


def settings(element: str, **changes) -> BodySettings:
    return BodySettings(**{"element": element, "first_step": 0.5, "residual": 1e-12} | changes)


def test_an_element_must_exist_and_fit_the_cells_and_the_effects() -> None:
    body = Body(box("P1"), FLESH, (), (0.0, 1.0))
    with pytest.raises(
        InputError, match='element: got "P3", want one of P1, P1/P1, P2, P2/P0, P2/P1, Q1, Q2, Q1/P0, Q2/Q1'
    ):
        check(body, "P3")
    with pytest.raises(
        InputError,
        match=r'element: got "Q1/P0", want an element for tetrahedron cells with a pressure, which .* needs: P1/P1, P2/P0, P2/P1',
    ):
        check(body, "Q1/P0")
    with pytest.raises(
        InputError, match=r'got "P1", want an element for .* with a pressure, which .* needs: P1/P1, P2/P0, P2/P1'
    ):
        check(body, "P1")
    free = Body(box("Q1"), PENALTY, (), (0.0, 1.0))
    with pytest.raises(
        InputError, match=r'got "Q2/Q1", want an element for .* without a pressure, which no effect needs: Q1, Q2'
    ):
        check(free, "Q2/Q1")
    for element in ELEMENTS:
        check(Body(box(element), PENALTY if ELEMENTS[element][2] is None else FLESH, (), (0.0, 1.0)), element)


def test_a_stabilised_pressure_needs_quadrature_that_sees_it(session) -> None:
    body = Body(box("P1/P1"), FLESH, (), (0.0, 1.0))
    given = {"element": "P1/P1", "quadrature_degree": 1}
    with pytest.raises(InputError, match="quadrature_degree: got 1, want 2 or more for P1/P1"):
        session.solve(body, BodySettings(**given))
    with pytest.raises(InputError, match="quadrature_degree: got 1, want 2 or more for P1/P1"):
        scikit_fem.solve_body(body, scikit_fem.ScikitBodySettings(**given))
    with pytest.raises(InputError, match=r"case\.toml: reference\.quadrature_degree: got 1, want 2 or more for P1/P1"):
        fenicsx.check_effects(fenicsx.Settings(**given), FLESH, "case.toml: reference")


@pytest.mark.parametrize(
    ("laws", "kind"),
    [
        ((effects.make("incompressible", bulk="10 MPa"),), "shape"),
        ((effects.make("neo_hooke", mu="10 kPa"),), "volume"),
        ((effects.make("squared_invariants", mu="10 kPa", lame="90 kPa"),), "shape"),
        (
            (
                effects.make("incompressible", bulk="10 MPa"),
                effects.make("fibre_passive", **effects.example("fibre_passive")),
            ),
            "shape",
        ),
    ],
)
def test_a_muscle_has_laws_that_resist_shear_and_a_change_of_volume(laws, kind) -> None:
    """Fibres alone do neither: it was "can be solved", and diverged with the advice to take smaller cells."""
    with pytest.raises(InputError, match=f"reference: got effects that do not resist a change of {kind} at rest"):
        fenicsx.check_effects(fenicsx.Settings(), laws, "case.toml: reference")


@BOTH
def test_both_ends_turned_alike_is_a_rigid_motion(element, session) -> None:
    mesh, turn = box(element, (2, 2, 4), (1.0, 1.0, 2.0)), Turn((1.0, 2.0, 3.0), 1.0, (3.0, 0.0, 1.0))
    state = session.solve(turned(mesh, turn, turn), settings(element)).last
    # A rigid motion is in the space: Newton's residual of 1e-12 N over a stiffness of 1e-2 N/mm.
    assert state.points == pytest.approx(mesh.points + turn(mesh.points, 1.0), abs=1e-9)
    assert state.scalars["energy"] == pytest.approx(0, abs=1e-12)
    assert state.scalars["volume_ratio"] == pytest.approx(1, abs=1e-9)


def test_a_body_that_is_prescribed_everywhere_is_where_it_is_prescribed(session) -> None:
    """Though no force is out of balance where nothing may move."""
    mesh = box("Q1", (1, 1, 1))
    shift = Affine(((0.0, 0.0, 0.0),) * 3, (0.0, 0.2, 0.1))
    body = replace(turned(mesh, shift), effects=PENALTY)
    state = session.solve(body, settings("Q1")).last
    assert state.points - mesh.points == pytest.approx(np.where(mesh.points[:, 2:] == 1, [0, 0.2, 0.1], 0.0), abs=1e-14)


def test_what_was_reached_is_kept_where_a_body_inverts(session) -> None:
    # All corners are prescribed, so that there is nothing to solve but the pressure. The top is turned about the x axis: det F at
    # two of its corners is cos - sin / 2, zero at 63 degrees, where three quarters of the volume are left: it is no collapse.
    turn = Turn((1.0, 0.0, 0.0), 2.3, (0.5, 0.5, 1.0))
    body = replace(turned(box("Q1/P0", (1, 1, 1)), turn), frames=(0.0, 0.25, 1.0))
    solved = session.solve(body, settings("Q1/P0", first_step=0.25))
    assert solved.outcome.status == "inverted"
    assert "Newton's method converged, but det F fell to" in solved.outcome.message
    assert solved.outcome.message.endswith("try a smaller motion or smaller cells")  # a body has no keys
    assert [state.number for state in solved.states] == [0.0, 0.25]
    with pytest.raises(ArithmeticError, match=r"inverted: Newton's method converged, but det F fell to"):
        _ = solved.last


@pytest.mark.parametrize(("largest", "steps"), [(None, 1), (0.25, 4), (0.2, 5)])
def test_no_load_step_of_a_solve_is_above_the_largest(largest, steps, session) -> None:
    # From frame 0 to 1 without a cut-back: as many steps as the largest goes into it, where the first one may take all of it.
    pull = Affine(((0.0, 0.0, 0.0),) * 3, (0.0, 0.0, 0.05))
    solved = session.solve(turned(box("Q1/P0"), pull), settings("Q1/P0", first_step=1.0, largest_step=largest))
    assert solved.outcome.status == "converged"
    assert solved.outcome.cost["cut_backs"] == 0
    assert solved.outcome.cost["load_steps"] == steps


def test_regions_and_fibres_that_a_body_lacks_are_named() -> None:
    lost = Body(box("Q1/P0"), FLESH, (Prescribed("lid", "lid", (0,), Rest()),), (0.0, 1.0))
    with pytest.raises(InputError, match='on: got "lid", want a region of the body: x0, x1'):
        check(lost, "Q1/P0")
    pressed = effect("pressure", on="roof", pressure="1 kPa", ramp=ONCE)
    with pytest.raises(InputError, match='on: got "roof"'):
        check(Body(box("Q1/P0"), (*FLESH, pressed), (), (0.0, 1.0)), "Q1/P0")
    active = effect("fibre_active", stress="10 kPa", optimal_stretch=1.0, ramp=ONCE)
    with pytest.raises(InputError, match="fibre: got nothing, want fibre directions"):
        check(Body(box("Q1/P0"), (*FLESH, active), (), (0.0, 1.0)), "Q1/P0")


def test_forces_have_names_of_their_own() -> None:
    fixed = (Prescribed("end", "z0", (2,), Rest()), Prescribed("end", "z1", (2,), Rest()))
    with pytest.raises(InputError, match='prescribed: got "end" twice, want a different name for each'):
        check(Body(box("Q1/P0"), FLESH, fixed, (0.0, 1.0)), "Q1/P0")


@pytest.mark.parametrize("stiffness", [0.0, -1.0, float("nan")])
def test_springs_pull(stiffness) -> None:
    fixed = (Prescribed("end", "z0", (2,), Rest(), stiffness),)
    with pytest.raises(
        InputError, match=r"prescribed\.end\.stiffness: got .*, want a stiffness above 0, or None if exact"
    ):
        check(Body(box("Q1/P0"), FLESH, fixed, (0.0, 1.0)), "Q1/P0")


def shared_facet(mesh: Cells) -> list[int]:
    """The corners of a facet between two cells."""
    count = 4 if mesh.kind == "tetrahedron" else 8
    pairs = itertools.combinations(mesh.cells[:, :count].tolist(), 2)
    shared = (sorted({*one} & {*two}) for one, two in pairs)
    return next(facet for facet in shared if len(facet) == len(mesh.facets["x0"][0]))


@pytest.mark.parametrize("element", ["P2/P1", "P2", "Q1/P0", "Q2/Q1"])
def test_regions_are_on_the_boundary_of_the_cells(element) -> None:
    acting = PENALTY if ELEMENTS[element][2] is None else FLESH
    mesh = shapes.box((2, 2, 2), (1.0, 1.0, 1.0), ELEMENTS[element][0], 2 if element in ("P2", "Q2/Q1") else 1)
    every = np.concatenate(list(mesh.facets.values()))
    assert {tuple(sorted(facet)) for facet in outer_facets(mesh)[0].tolist()} == {
        tuple(sorted(f)) for f in every.tolist()
    }

    fixed = (Prescribed("end", "lid", (2,), Rest()),)

    def checked(facets, acting=acting, fixed=fixed) -> None:
        other = replace(mesh, facets={"lid": np.asarray(facets), "unused": np.zeros_like(every[:1])})
        check(Body(other, acting, fixed, (0.0, 1.0)), element)

    checked(np.flip(every, axis=1))  # in whatever order
    lost = shared_facet(mesh)
    with pytest.raises(InputError, match=r"facets\.lid: got facets that do not belong to one cell each \(1 of 3"):
        checked([every[0], every[1], lost])
    pressed = effect("pressure", on="lid", pressure="1 kPa", ramp=ONCE)
    with pytest.raises(InputError, match=r"facets\.lid: got facets that do not belong to one cell each \(1 of 1"):
        checked([lost], (*acting, pressed), ())
    with pytest.raises(InputError, match=r"facets\.lid: got none, want at least one facet on the boundary"):
        checked(every[:0])
