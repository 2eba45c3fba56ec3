"""The second opinion on bodies: homogeneous states, balance, invariance, tangents, and what it says where it fails."""

import numpy as np
import pytest
from scipy.optimize import brentq

from fem_reference import effects
from fem_reference.foundations.errors import InputError
from fem_reference.foundations.records import parse
from fem_reference.problems import shapes
from fem_reference.problems.body import ELEMENTS, Body, Cells, Prescribed, reference_nodes
from fem_reference.runs.store import Run
from fem_reference.solvers.scikit_fem import ScikitBodySettings, solve_body
from fem_reference.solvers.scikit_fem.body import March
from fem_reference.solvers.scikit_fem.spaces import Space

MU, BULK = 0.5, 20.0
FACES = ("x0", "x1", "y0", "y1", "z0", "z1")
ALL = (0, 1, 2)
RAMP = [{"frame": 0.0, "amount": 0.0}, {"frame": 1.0, "amount": 1.0}]


def effect(name: str, **keys) -> effects.Effect:
    return parse(effects.find(name), keys, name)


def law(element: str) -> tuple[effects.Effect, ...]:
    """The same elastic law for every element: with a pressure where it has one."""
    volumetric = "incompressible_penalty" if ELEMENTS[element][2] is None else "incompressible"
    return effect("neo_hooke", mu="0.5 MPa"), effect(volumetric, bulk="20 MPa")


def energy(along: float, across: float) -> float:
    """The energy [MPa] of that law, stretched along an axis and across it."""
    J = along * across**2
    return MU / 2 * (J ** (-2 / 3) * (along**2 + 2 * across**2) - 3) + BULK / 2 * (J - 1) ** 2


def slopes(along: float, across: float) -> tuple[float, float]:
    """Its derivatives by hand."""
    J = along * across**2
    squares, pressure = along**2 + 2 * across**2, BULK * (J - 1)
    by_along = MU / 2 * J ** (-2 / 3) * (2 * along - 2 / 3 * squares / along) + pressure * across**2
    return by_along, MU / 2 * J ** (-2 / 3) * (4 * across - 4 / 3 * squares / across) + pressure * 2 * along * across


def nowhere(points, frame):
    return 0 * points * frame


def moved(name: str, on: str, components: tuple[int, ...], by=nowhere, **keys) -> Prescribed:
    return Prescribed(name, on, components, by, **keys)


SLIDING = (moved("x", "x0", (0,)), moved("y", "y0", (1,)), moved("z", "z0", (2,)))


def solved(body: Body, element: str, **settings) -> Run:
    solution = solve_body(body, ScikitBodySettings(element=element, **settings))
    assert solution.outcome.status == "converged", solution.outcome.message
    return solution


def box(element: str, count: int = 1, degree: int = 1) -> Cells:
    return shapes.box((count, count, count), (2.0, 3.0, 4.0), ELEMENTS[element][0], degree)


@pytest.mark.parametrize("element", ELEMENTS)
def test_a_uniaxial_stretch_is_that_of_the_scalar_equation(element) -> None:
    stretch = 1.4
    pull = moved("pull", "z1", (2,), lambda points, frame: points * 0 + [0, 0, 4.0 * (stretch - 1) * frame])
    given = Body(box(element), law(element), (*SLIDING, pull), (0.0, 0.5, 1.0))
    solution = solved(given, element, residual=1e-11)
    across = brentq(lambda a: slopes(stretch, a)[1], 0.5, 1.5, xtol=1e-14)
    state = solution.last
    # A linear field is in every space; Newton ends with out-of-balance forces of 1e-11 N.
    assert state.points == pytest.approx(given.mesh.points * [across, across, stretch], abs=1e-9)
    force = slopes(stretch, across)[0] * 6.0
    assert state.forces["pull"] == pytest.approx(np.array([0, 0, force]), abs=1e-9)
    assert state.forces["z"] == pytest.approx(np.array([0, 0, -force]), abs=1e-9)
    arm = np.array([across * 1.0, across * 1.5, stretch * 4.0])
    assert state.moments["pull"] == pytest.approx(np.cross(arm, [0, 0, force]), abs=1e-8)
    determinant = stretch * across**2
    for name in ("min_det_F_quadrature", "min_det_F_vertices", "volume_ratio"):
        assert state.scalars[name] == pytest.approx(determinant, abs=1e-10)
    assert state.scalars["energy"] == pytest.approx(24 * energy(stretch, across), abs=1e-9)
    assert [one.number for one in solution.states] == [0.0, 0.5, 1.0]
    assert solution.states[0].points == pytest.approx(given.mesh.points, abs=0)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("element", "degree"), [("P1", 1), ("P1/P1", 1), ("P2", 2), ("P2/P1", 1), ("Q1/P0", 1), ("Q2/Q1", 2)]
)
def test_patch_test_on_crooked_cells(element, degree) -> None:
    gradient = np.array([[0.2, 0.1, 0.0], [-0.1, 0.1, 0.3], [0.05, 0.0, -0.2]])
    mesh = shapes.warped_box((2, 2, 2), (2.0, 3.0, 4.0), ELEMENTS[element][0], degree)
    fixed = tuple(moved(face, face, ALL, lambda points, frame: frame * points @ gradient.T) for face in FACES)
    state = solved(Body(mesh, law(element), fixed, (0.0, 1.0)), element).last
    # An affine field is in the space of isoparametric elements; the forces are in balance to 1e-8 N at 0.5 N/mm.
    assert state.points == pytest.approx(mesh.points + mesh.points @ gradient.T, abs=1e-7)
    assert state.scalars["volume_ratio"] == pytest.approx(np.linalg.det(np.eye(3) + gradient), abs=1e-8)


@pytest.mark.slow
@pytest.mark.parametrize("element", ["P2/P1", "Q1/P0"])
def test_rotating_costs_nothing_and_reactions_balance(element) -> None:

    def turn(angle):
        return np.array([[np.cos(angle), -np.sin(angle), 0], [np.sin(angle), np.cos(angle), 0], [0, 0, 1]])

    def place(points, frame, shift=0.0):
        return points @ turn(0.6 * frame).T - points + shift * frame * np.array([0.3, 0.2, 0.5])

    def fixed(shift: float) -> tuple[Prescribed, ...]:
        return (
            moved("bottom", "z0", ALL, place),
            moved("top", "z1", ALL, lambda points, frame: place(points, frame, shift)),
        )

    rigid = solved(Body(box(element, 2), law(element), fixed(0.0), (0.0, 1.0)), element).last
    assert rigid.points == pytest.approx(box(element, 2).points @ turn(0.6).T, abs=1e-7)
    assert rigid.forces["top"] == pytest.approx(np.zeros(3), abs=1e-7)
    assert rigid.scalars["energy"] == pytest.approx(0, abs=1e-9)
    pulled = solved(Body(box(element, 2), law(element), fixed(1.0), (0.0, 1.0)), element).last
    assert np.linalg.norm(pulled.forces["top"]) > 0.1
    # Rigid velocities are in the space, so that forces and moments are in balance as far as Newton's residual goes.
    assert pulled.forces["top"] + pulled.forces["bottom"] == pytest.approx(np.zeros(3), abs=1e-6)
    assert pulled.moments["top"] + pulled.moments["bottom"] == pytest.approx(np.zeros(3), abs=1e-6)


@pytest.mark.parametrize("element", ["P2/P1", "Q1"])
def test_the_ground_carries_the_weight(element) -> None:
    weight = effect("gravity", ramp=RAMP, density="1000 kg/m^3", acceleration="0, 0, -1000 m/s^2")
    given = Body(box(element, 2), (*law(element), weight), (moved("ground", "z0", ALL),), (0.0, 0.5, 1.0))
    states = solved(given, element).states
    # 1e-9 tonne/mm3 x 24 mm3 x 1e6 mm/s2.
    assert states[1].forces["ground"] == pytest.approx([0, 0, 0.012], abs=1e-7)
    assert states[2].forces["ground"] == pytest.approx([0, 0, 0.024], abs=1e-7)
    assert states[2].points[:, 2].max() < 4.0


@pytest.mark.slow
@pytest.mark.parametrize(("element", "degree"), [("P2/P1", 1), ("Q1/P0", 1), ("P2", 2), ("Q2/Q1", 2)])
def test_a_fluid_all_around_compresses_by_its_pressure_over_the_bulk_modulus(element, degree) -> None:
    pressure = [effect("pressure", ramp=RAMP, on=face, pressure="2 MPa") for face in ("x1", "y1", "z1")]
    given = Body(box(element, 1, degree), (*law(element), *pressure), SLIDING, (0.0, 1.0))
    state = solved(given, element, residual=1e-10).last
    assert state.scalars["volume_ratio"] == pytest.approx(1 - 2 / BULK, abs=1e-10)
    assert state.points == pytest.approx(given.mesh.points * np.cbrt(1 - 2 / BULK), abs=1e-9)
    # What it slides on bears the pressure on the present area of the face opposite, 2 x 3 mm2 at rest.
    assert state.forces["z"] == pytest.approx([0, 0, 2 * 6 * (1 - 2 / BULK) ** (2 / 3)], abs=1e-8)


def test_a_dead_load_stretches_springs_and_body() -> None:
    pull = effect("traction", ramp=RAMP, on="z1", force="0, 0, 0.4 MPa")
    springs = moved("springs", "z0", (2,), lambda points, frame: points * 0 + frame, stiffness=0.8)
    given = Body(box("P2/P1"), (*law("P2/P1"), pull), (*SLIDING[:2], springs), (0.0, 1.0))
    state = solved(given, "P2/P1", residual=1e-11).last

    def across(along: float) -> float:
        return brentq(lambda a: slopes(along, a)[1], 0.5, 1.5, xtol=1e-14)

    along = brentq(lambda stretch: slopes(stretch, across(stretch))[0] - 0.4, 1.0, 2.0, xtol=1e-14)
    bottom = given.mesh.points[:, 2] == 0
    # The springs pull towards 1 mm and are drawn out by 0.4 MPa / 0.8 MPa/mm.
    assert state.points[bottom, 2] == pytest.approx(np.full(bottom.sum(), 1.5), abs=1e-9)
    assert state.points[:, 2].max() == pytest.approx(1.5 + 4 * along, abs=1e-9)
    assert state.forces["springs"] == pytest.approx([0, 0, -2.4], abs=1e-8)


def loaded(element: str) -> Body:
    """Everything at once: weight, fluid, springs, and taut fibres that pull and turn from place to place."""

    def fibre(_, points):
        return np.stack([np.cos(points[:, 2]), np.sin(points[:, 2]), 0 * points[:, 2]], axis=1)

    acting = (
        *law(element),
        effect("active_tension", ramp=RAMP, tension="0.1 MPa"),
        effect("prestretch", ramp=RAMP, stretch=1.1),
        effect("gravity", ramp=RAMP, density="1000 kg/m^3", acceleration="0, 90, 9 m/s^2"),
        effect("pressure", ramp=RAMP, on="x1", pressure="0.1 MPa"),
    )
    fixed = (moved("ground", "z0", ALL), moved("springs", "z1", (0, 2), stiffness=0.3))
    return Body(box(element), acting, fixed, (0.0, 1.0), fibre)


def test_newton_converges_quadratically() -> None:
    found = March(loaded("P2/P1"), ScikitBodySettings(newton_iterations=20)).attempt(1.0)
    assert found.converged
    assert len(found.residuals) == found.iterations + 1
    # The last step that ends above rounding at least squares the error, as far as the constant before it allows.
    *_, first, second, third = [size for size in found.residuals if size > 1e-12]
    assert np.log(second / third) / np.log(first / second) > 1.7


def test_a_load_step_that_fails_is_cut_back() -> None:
    lid = moved("lid", "z1", ALL, lambda points, frame: points * 0 + [0, 0, -2.4 * frame])
    given = Body(box("Q1/P0", 2), law("Q1/P0"), (moved("ground", "z0", ALL), lid), (0.0, 1.0))
    state = solved(given, "Q1/P0", newton_iterations=3).last
    assert state.scalars["cut_backs"] >= 1
    whole = solved(given, "Q1/P0", newton_iterations=30, first_step=0.1).last
    assert state.points == pytest.approx(whole.points, abs=1e-7)


def test_cells_turned_inside_out_are_a_status() -> None:
    # All eight corners are prescribed, so that there is nothing to solve: past half a step the top is below the bottom.
    lid = moved("lid", "z1", ALL, lambda points, frame: points * 0 + [0, 0, -8.0 * frame])
    given = Body(box("Q1"), law("Q1"), (moved("ground", "z0", ALL), lid), (0.0, 0.25, 1.0))
    solution = solve_body(given, ScikitBodySettings(element="Q1"))
    assert solution.outcome.status == "inverted"
    assert "det F fell to -" in solution.outcome.message
    assert [state.number for state in solution.states] == [0.0, 0.25]


def test_equations_without_a_solution_are_a_status() -> None:
    # A body on which a force pulls is prescribed nowhere.
    pull = effect("traction", ramp=RAMP, on="z1", force="0, 0, 0.4 MPa")
    given = Body(box("P1"), (*law("P1"), pull), (), (0.0, 1.0))
    solution = solve_body(given, ScikitBodySettings(element="P1"))
    assert solution.outcome.status == "diverged"
    assert len(solution.states) == 1


def test_what_cannot_be_solved_is_named() -> None:
    curved, straight = box("P1", degree=2), box("P1")
    settings = ScikitBodySettings(element="P1")
    with pytest.raises(
        InputError,
        match='element: got "P1", want an element for curved tetrahedron cells without a pressure, which no effect needs: P2',
    ):
        solve_body(Body(curved, law("P1"), (), (0.0, 1.0)), settings)
    with pytest.raises(InputError, match='on: got "lid", want a region of the body: x0, x1'):
        solve_body(Body(straight, law("P1"), (moved("lid", "lid", ALL),), (0.0, 1.0)), settings)
    pulling = effect("active_tension", ramp=RAMP, tension="0.1 MPa")
    with pytest.raises(InputError, match="fibre: got nothing, want fibre directions"):
        solve_body(Body(straight, (*law("P1"), pulling), (), (0.0, 1.0)), settings)
    corners = reference_nodes("tetrahedron", 1)
    strange = Cells(corners, np.arange(4)[None], "tetrahedron", 1, {"lid": np.array([[0, 1, 5]])})
    with pytest.raises(InputError, match=r"mesh\.facets\['lid'\]: got index 0 to 5, want indices from 0 to 3"):
        solve_body(Body(strange, law("P1"), (moved("lid", "lid", ALL),), (0.0, 1.0)), settings)
    with pytest.raises(InputError, match=r"facets\.lid: got facets of no cell or of two cells"):
        Space(strange, "P1", 2).facets("lid")
    with pytest.raises(InputError, match="element: got"):
        solve_body(Body(straight, law("P1"), (), (0.0, 1.0)), ScikitBodySettings(element="P2/P1"))
