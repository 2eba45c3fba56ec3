"""How many negative modes a state has: columns that buckle when they should, blocks that do not, and when nobody can say."""

from dataclasses import replace

import numpy as np
import pytest
import shapes as bodies
from scipy.optimize import brentq

from fem_reference import effects
from fem_reference.effects import Effect
from fem_reference.foundations.motion import RigidMotion
from fem_reference.foundations.records import parse
from fem_reference.geometry.skins import Skin
from fem_reference.problems import shapes
from fem_reference.problems.body import ELEMENTS, Body, Prescribed
from fem_reference.problems.paths import Affine, Along, Rest
from fem_reference.runs.store import Frame
from fem_reference.solvers import fenicsx
from fem_reference.solvers.fenicsx import BodySettings, Settings
from fem_reference.verification.parts import SYMMETRY

pytestmark = pytest.mark.slow

STILL = ((0.0, 0.0, 0.0),) * 3
THIN, WIDE, LENGTH = 1.0, 1.3, 20.0  # mm


def effect(name: str, **parameters) -> Effect:
    return parse(effects.find(name), parameters, name)


def flesh(element: str) -> tuple[Effect, ...]:
    resistance = "incompressible_penalty" if ELEMENTS[element][2] is None else "incompressible"
    bulk = "0.1 MPa" if ELEMENTS[element][2] is None else "10 MPa"
    return effect("neo_hooke", mu="10 kPa"), effect(resistance, bulk=bulk)


def modes(session, body: Body, element: str, **changes) -> list[float]:
    settings = BodySettings(element=element, first_step=100.0, residual=1e-11, **changes)
    solved = session.solve(body, settings)
    assert solved.outcome.status == "converged", solved.outcome.message
    return [state.scalars["negative_modes"] for state in solved.states]


def critical(width: float) -> float:
    """Euler's shortening of a column with one clamped end and one that slides but does not turn, over its length: pi^2 I / (A L^2);
    a shear modulus of a third of Young's takes away 6/5 of E/G times itself (Timoshenko and Gere 1961, ch. 2.17).
    """
    euler = np.pi**2 * width**2 / 12 / LENGTH**2
    return float(euler / (1 + 3 * 1.2 * euler))


def column(element: str, cells: tuple[int, int, int], shortenings: list[float], size=(THIN, WIDE, LENGTH)) -> Body:
    """Shortened at frame i by ``shortenings[i - 1]`` of its length."""
    mesh = shapes.box(cells, size, ELEMENTS[element][0])
    knots = tuple(enumerate([0.0, *shortenings]))
    moved = Affine(STILL, (0.0, 0.0, -size[2]), knots)
    fixed = Prescribed("foot", "z0", (0, 1, 2), Rest()), Prescribed("head", "z1", (2,), moved)
    return Body(mesh, flesh(element), fixed, tuple(float(frame) for frame, _ in knots))


def test_a_column_buckles_in_one_plane_and_then_in_the_other(session) -> None:
    # The clamped foot and the ten cells of its length matter by less than 3 per cent.
    sides = [share * critical(width) for width in (THIN, WIDE) for share in (0.97, 1.03)]
    assert modes(session, column("Q2/Q1", (1, 1, 10), sides), "Q2/Q1") == [0, 0, 1, 1, 2]


def test_tetrahedra_count_alike(session) -> None:
    # Straight ahead from rest, as the cells' diagonals bend a column that is shortened bit by bit; they are stiffer by 4 per cent.
    sides = [share * critical(width) for width in (THIN, WIDE) for share in (0.94, 1.06)]
    found = [modes(session, column("P2/P1", (1, 1, 20), [side]), "P2/P1")[1] for side in sides]
    assert found == [0, 1, 1, 2]


@pytest.mark.parametrize("element", ELEMENTS)
def test_a_block_at_rest_or_stretched_is_stable(element, session) -> None:
    stretch = Affine(STILL, (0.0, 0.0, 0.5))
    mesh = shapes.box((2, 2, 2), (1.0, 1.0, 1.0), ELEMENTS[element][0])
    body = Body(mesh, flesh(element), (*SYMMETRY, Prescribed("z1", "z1", (2,), stretch)), (0.0, 1.0))
    assert modes(session, body, element) == [0, 0]


HALF, HEIGHT = 2.0, 10.0  # mm


def _surplus(stretch: float, waves: int) -> float:
    """What vanishes where a slab of half-thickness ``HALF`` and height ``HEIGHT`` between smooth plates, in plane strain and of
    incompressible neo-Hookean material, begins to bend by so many half waves (Sawyers and Rivlin 1974, doi
    10.1016/0020-7683(74)90012-7): Biot's exponentials of k x and stretch^2 k x, without traction on the sides. For thin slabs it
    is Euler's shortening, k^2 HALF^2 / 3; for thick ones Biot's 0.5437 for a wrinkling half-space.
    """
    eta = waves * np.pi * HALF / HEIGHT / stretch**2
    return float(np.tanh(stretch**2 * eta) / np.tanh(eta) - (1 + stretch**4) ** 2 / (4 * stretch**2))


@pytest.mark.parametrize("element", ["P2/P1", "Q2/Q1", "Q2"])
def test_a_squeezed_slab_bends_when_it_should(element, session) -> None:
    # 5 cells to a half wave have the stretch of 0.867 within 0.005; K/mu = 1000, or 10 where there is no pressure, stands for
    # incompressible, and a spring that is too soft to matter for what keeps the slab from sliding away.
    stretch = brentq(_surplus, 0.5438, 0.999, args=(1,))
    shares = (0.0, 0.05, 0.1, 1 - stretch - 0.005, 1 - stretch + 0.005)
    mesh = shapes.box((2, 1, 5), (2 * HALF, 1.0, HEIGHT), ELEMENTS[element][0])
    knots = tuple((float(i), float(share)) for i, share in enumerate(shares))
    fixed = (
        *(Prescribed(face, face, ("xyz".index(face[0]),), Rest()) for face in ("y0", "y1", "z0")),
        Prescribed("z1", "z1", (2,), Affine(STILL, (0.0, 0.0, -HEIGHT), knots)),
        Prescribed("slides", "z0", (0,), Rest(), 1e-9),
    )
    body = Body(mesh, flesh(element), fixed, tuple(frame for frame, _ in knots))
    assert modes(session, body, element) == [0, 0, 0, 0, 1]


def test_it_is_reported_where_a_run_is_unstable(session) -> None:
    body = column("Q2/Q1", (1, 1, 10), [0.9 * critical(THIN), 1.1 * critical(THIN), 1.1 * critical(WIDE)])
    solved = session.solve(body, BodySettings(element="Q2/Q1", first_step=100.0))
    printed = "in 2 of them the equilibrium is unstable, first at frame 2"
    counted = "(negative modes: up to 2, at least 2 of them due to the material)"
    assert solved.outcome.message == f"all 4 frames reached; {printed} {counted}"
    assert solved.outcome.cost["factorisations"] >= len(solved.states)
    assert solved.outcome.cost["seconds_stability"] > 0


def test_nobody_counts_where_a_load_may_have_no_energy(session) -> None:
    ramp = [{"frame": 0, "amount": 0.0}, {"frame": 1, "amount": 1.0}]
    body = column("Q2/Q1", (1, 1, 2), [0.0])
    pressed = effect("pressure", on="x1", pressure="0.01 kPa", ramp=ramp)
    solved = session.solve(replace(body, effects=(*body.effects, pressed)), BodySettings(element="Q2/Q1"))
    assert solved.outcome.status == "converged"
    assert not any("negative_modes" in state.scalars for state in solved.states)


def test_a_shallow_arch_that_a_soft_spring_pulls_comes_to_a_limit_point(session) -> None:
    """Its frame is foreseen from a step before it; where smaller steps go on, none is claimed."""
    straight = shapes.box((8, 1, 1), (20.0, 1.0, 1.0), "tetrahedron")
    rise = 2.5 * (1 - np.abs(straight.points[:, [0]] - 10) / 10)
    mesh = replace(straight, points=straight.points + rise * [0, 0, 1])
    top = np.array([[9.9, 0.45, 3.4]])
    cell = np.argmin(np.linalg.norm(mesh.points[mesh.cells].mean(axis=1) - top, axis=1))
    pull = Affine(STILL, (0.0, 0.0, -8.0))
    spring = Prescribed("pull", Skin(np.array([cell]), top, np.ones(1)), (2,), pull, 5e-5)
    ends = tuple(Prescribed(end, end, (0, 1, 2), Rest()) for end in ("x0", "x1"))
    body = Body(mesh, flesh("P2/P1"), (*ends, spring), tuple(np.linspace(0, 1, 11)))
    settings = BodySettings(element="P2/P1", first_step=0.1, largest_step=0.1, residual=1e-10)
    outcomes = [
        session.solve(body, settings.model_copy(update={"smallest_step": smallest})).outcome
        for smallest in (2e-2, 8e-3, 1e-5)
    ]
    assert [outcome.status for outcome in outcomes] == ["diverged", "limit point", "limit point"]
    foreseen, found = (float(one.message.split("at frame ")[1].split(",")[0]) for one in outcomes[1:])
    assert foreseen == pytest.approx(found, abs=2e-3)


@pytest.mark.usefixtures("all_cores")
def test_ranks_count_alike() -> None:
    # A bar of 2 x 2 x 20 mm, shortened by 2 per cent between clamped ends, against Euler's 4 pi^2 / 12 / 100 = 3.3 per cent.
    found = {}
    for ranks in (1, 2):
        moved = {"bottom": None, "top": RigidMotion((0, 0, -1), None, (0.0, 10.0), (0.0, 1.4))}
        problem = bodies.bar((1, 1, 10), (2, 2, 20), moved, flesh("P2/P1"), (0, 5, 10))
        frames: list[Frame] = []
        outcome = fenicsx.solve(problem, Settings(ranks=ranks, first_step=100.0), frames.append)
        found[ranks] = [frame.scalars["negative_modes"] for frame in frames], frames[-1].note, outcome.message
    assert found[1] == found[2]
    assert found[1][0][0] == 0
    assert found[1][0][-1] > 0
    assert "unstable equilibrium (negative modes: " in found[1][1]


def test_modes_of_the_elements_alone_are_told_from_those_of_the_material(session) -> None:
    # Fibres that pull at their optimal length soften nothing. What is stretched along them by e and swells as much changes the
    # energy by (2/3 mu - stress / 9) e^2, as the isochoric stretch has it: elements that may do that do, from 6 mu on.
    mesh = shapes.box((2, 2, 3), (1.0, 1.0, 2.0), "tetrahedron")
    ends = tuple(Prescribed(face, face, (0, 1, 2), Rest()) for face in ("z0", "z1"))
    ramp = [{"frame": i, "amount": i / 4} for i in range(5)]
    pull = effect("fibre_active", stress="160 kPa", optimal_stretch=1.0, ramp=ramp)
    body = Body(mesh, (*flesh("P2/P1"), pull), ends, (0.0, 1.0, 2.0), fibre=Along((0.0, 0.0, 1.0)))
    solved = session.solve(body, BodySettings(first_step=1.0))
    assert solved.outcome.status == "converged"
    counted = [(state.scalars["negative_modes"] > 0, state.scalars["material_modes"]) for state in solved.states]
    assert counted == [(False, 0), (False, 0), (True, 0)]
    assert solved.outcome.message.endswith("at least 0 of them due to the material)")
