"""Laws outside the range that they are meant for, and bodies that collapse: nothing of it passes in silence."""

from dataclasses import replace

import numpy as np
import pytest
import shapes as bodies
from scipy.optimize import brentq, minimize_scalar

from fem_reference import effects
from fem_reference.effects import Effect, State
from fem_reference.foundations.limits import Limit
from fem_reference.foundations.loads import RampPoint
from fem_reference.foundations.mesh import Surface
from fem_reference.foundations.motion import RigidMotion
from fem_reference.foundations.records import parse
from fem_reference.geometry.regions import Around, Blended
from fem_reference.problems import shapes
from fem_reference.problems.body import ELEMENTS, Body, ByCell, Prescribed
from fem_reference.problems.paths import Affine, Along, Rest
from fem_reference.solvers import fenicsx
from fem_reference.solvers.fenicsx import BodySettings, Settings
from fem_reference.verification import squeeze
from fem_reference.verification.homogeneous import everywhere
from fem_reference.verification.parts import resistance
from fem_reference.verification.squeeze import MU, POISSON, bulk_modulus, squeezed
from validation.loads import squeezed_volume

pytestmark = pytest.mark.slow

ONCE = [{"frame": 0, "amount": 0.0}, {"frame": 1, "amount": 1.0}]
COLLAPSED = 0.2  # V/V0 of a cell


def effect(name: str, **parameters) -> Effect:
    return parse(effects.find(name), parameters, name)


ACTIVE = effect("fibre_active", stress="10 kPa", optimal_stretch=1.1, ramp=ONCE)
PASSIVE = effect("fibre_passive", stress="10 kPa", p1=0.05, p2=6.6, optimal_stretch=1.1, linear_from=1.4)


def limit(one: Effect) -> Limit:
    (found,) = one.limits()
    return found


def along(one: Effect, stretch: float, **changes) -> float:
    """The energy [MPa] of fibres along x at a stretch without change of volume."""
    F = np.diag([stretch, stretch**-0.5, stretch**-0.5])
    return float(one.energy(State(F=F, fibre=(1.0, 0.0, 0.0), **changes)))


@pytest.mark.parametrize("name", ["incompressible", "incompressible_penalty"])
def test_the_volume_law_ends_where_its_resistance_to_shrinking_is_greatest(name) -> None:
    law = effect(name, bulk="2 MPa")

    def slope(J: float) -> float:
        """``dU / d(log J)`` [MPa] by central differences; the pressure is that of balance, K (J - 1)."""
        step, pressure = 1e-6, 2 * (J - 1) if law.unknowns else None
        one, other = (
            law.energy(State(F=np.eye(3) * (J * np.exp(sign * step)) ** (1 / 3), pressure=pressure)) for sign in (1, -1)
        )
        return (one - other) / (2 * step)

    ladder = np.linspace(0.05, 1, 96)
    found = limit(law)
    assert found.measure == "V/V0"
    assert ladder[np.argmin([slope(J) for J in ladder])] == pytest.approx(found.low, abs=0.011)
    assert found.low * found.high == pytest.approx(1)


def test_active_fibres_end_where_they_pull_no_more() -> None:
    found = limit(ACTIVE)

    def tension(stretch: float) -> float:
        return (along(ACTIVE, stretch + 1e-6) - along(ACTIVE, stretch - 1e-6)) / 2e-6

    assert [abs(tension(end + step)) < 1e-9 for end, step in ((found.low, -0.01), (found.high, 0.01))] == [True, True]
    assert [tension(end + step) > 1e-6 for end, step in ((found.low, 0.01), (found.high, -0.01))] == [True, True]


def test_passive_fibres_end_with_the_active_ones_or_where_their_line_begins() -> None:
    assert limit(PASSIVE) == Limit("fibre stretch", high=limit(ACTIVE).high)
    late = PASSIVE.model_copy(update={"linear_from": 1.8})
    assert limit(late).high == pytest.approx(1.8 * 1.1)


def test_an_effect_is_without_limits_unless_it_has_some() -> None:
    assert effect("neo_hooke", mu="10 kPa").limits() == ()


@pytest.mark.parametrize("element", ["Q1/P0", "Q1", "P2/P1"])
def test_means_over_cells_are_those_of_a_homogeneous_state(element, fem_lab) -> None:
    solved = squeezed(fem_lab, element, POISSON, (1.0, 0.6, 0.41))
    assert solved.outcome.status == "converged"
    for stretch, state in zip((1.0, 0.6, 0.41), solved.states, strict=True):
        wanted = squeezed_volume(MU, bulk_modulus(POISSON), stretch)
        # Newton's residual of 1e-11 over 1e-3 N/mm, on a branch that falls by 10 in J per stretch.
        assert state.scalars["min_cell_volume_ratio"] == pytest.approx(wanted, abs=1e-6)
        assert state.scalars["max_cell_volume_ratio"] == pytest.approx(wanted, abs=1e-6)
    cells = 8 if ELEMENTS[element][0] == "hexahedron" else 48
    assert [state.scalars["outside_law"] for state in solved.states] == [0, 0, cells]
    law = "incompressible" if ELEMENTS[element][2] is not None else "incompressible_penalty"
    words = f"; {law} is outside its range of validity in 1 of the states reached, first at frame 0.59: V/V0 is 0.47"
    assert words in solved.outcome.message
    assert solved.outcome.message.endswith(" mm, below 0.5")


def test_a_mean_over_a_cell_weighs_by_volume(session) -> None:
    """A frustum of 2 x 2 mm below, 1 x 1 mm above and 1 mm height, whose top is widened until it is a box: V/V0 is 4 to 7/3."""
    mesh = shapes.box((1, 1, 1), (2.0, 2.0, 1.0), "hexahedron")
    slanted = np.array(mesh.points)
    slanted[mesh.points[:, 2] == 1, :2] = 1 + (mesh.points[mesh.points[:, 2] == 1, :2] - 1) / 2
    widened = Affine(((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 0.0)), (-1.0, -1.0, 0.0))
    fixed = Prescribed("z0", "z0", (0, 1, 2), Rest()), Prescribed("z1", "z1", (0, 1, 2), widened)
    flesh = (effect("neo_hooke", mu="10 kPa"), resistance("Q1/P0", 1.0))
    solved = session.solve(
        Body(replace(mesh, points=slanted), flesh, fixed, (0.0, 1.0)), BodySettings(element="Q1/P0", first_step=0.25)
    )
    assert solved.last.scalars["min_cell_volume_ratio"] == pytest.approx(12 / 7, abs=1e-9)


@pytest.mark.parametrize("frames", [1, 9])
def test_a_squeeze_to_collapse_is_no_result(frames, fem_lab) -> None:
    """In one frame or in many: no state of it is kept, and the law that ended is named."""
    solved = squeezed(fem_lab, "Q1/P0", POISSON, tuple(np.linspace(1, 0.1, frames + 1).tolist()))
    # On the steep branch towards it, which folds back, Newton's method may find nothing.
    assert solved.outcome.status in ("collapsed", "diverged", "limit point")
    assert "is outside its range of validity" in solved.outcome.message
    assert all(state.scalars["min_cell_volume_ratio"] >= COLLAPSED for state in solved.states)


def test_a_limit_point_is_where_the_closed_form_folds_back(fem_lab) -> None:
    solved = squeezed(fem_lab, "Q1/P0", POISSON, (1.0, 0.1))
    assert solved.outcome.status == "limit point"
    bulk = bulk_modulus(POISSON)

    def stretch(J: float) -> float:
        """At which a block of the volume ``J`` is in balance, as in ``loads.squeezed_volume``."""
        return brentq(lambda s: MU / 3 * J ** (-2 / 3) * (J / s - s**2) + bulk * J * (J - 1), 0.05, 1.0)

    fold = minimize_scalar(stretch, bounds=(0.25, 0.35), method="bounded")
    assert fold.x == pytest.approx(0.285, abs=0.01)
    found = float(solved.outcome.message.split("limit point at frame ")[1].split(",")[0])
    assert found == pytest.approx(1 - fold.fun, abs=1e-3)  # which the smallest load step is


@pytest.mark.parametrize("element", ["Q1/P0", "P2"])
def test_a_body_that_collapses_ends_as_collapsed(element, session) -> None:
    """Its whole surface drawn together to ``s`` of its size: J = s^3 is a half at 0.794 and a fifth at 0.585."""
    gradient = ((-1.0, 0.0, 0.0), (0.0, -1.0, 0.0), (0.0, 0.0, -1.0))
    flesh = (effect("neo_hooke", mu="10 kPa"), resistance(element, 1.0))
    mesh = shapes.box((2, 2, 2), (1.0, 1.0, 1.0), ELEMENTS[element][0])
    body = Body(mesh, flesh, everywhere(gradient), (0.0, 0.2, 0.3, 0.4, 0.5))
    solved = session.solve(body, BodySettings(element=element, first_step=0.1, smallest_step=1e-3, residual=1e-11))
    message = solved.outcome.message
    assert solved.outcome.status == "collapsed"
    assert [state.number for state in solved.states] == [0.0, 0.2, 0.3, 0.4]
    assert message.startswith("Newton's method converged, but 100 % of the body collapsed: V/V0 is 0.")
    assert ", below 0.2 beyond frame 0.41 with load steps down to 0.001; in the last good state" in message
    # At frame 0.2 J is 0.512; then 0.343, 0.216, and 0.2 in the last good state.
    law = "incompressible" if ELEMENTS[element][2] is not None else "incompressible_penalty"
    assert f"{law} is outside its range of validity in 3 of the states reached, first at frame 0.3" in message
    assert message.endswith("mm, below 0.5; try a smaller motion or a larger bulk modulus")
    with pytest.raises(ArithmeticError, match="collapsed: Newton's method converged, but"):
        _ = solved.last


def test_a_low_determinant_at_a_vertex_is_no_collapse(fem_lab) -> None:
    solved = squeeze.glued(fem_lab, "P2/P1", 2, squeeze.GLUED_TO)
    assert solved.outcome.status == "converged"
    assert "outside" not in solved.outcome.message
    scalars = solved.last.scalars
    assert scalars["min_det_F_vertices"] < COLLAPSED
    assert scalars["min_cell_volume_ratio"] > 0.5
    assert scalars["outside_law"] == 0


@pytest.mark.parametrize(("layer", "status"), [(0.004, "converged"), (0.02, "collapsed")])
def test_next_to_nothing_of_a_body_may_collapse(layer, status, session) -> None:
    """A bottom layer of a cube of 1 mm, flattened to a tenth and fixed at its sides: named, and it counts from a hundredth."""
    mesh = shapes.box((1, 1, 3), (1.0, 1.0, 1.0), "hexahedron")
    levels = np.array([0.0, layer, 0.5, 1.0])
    points = np.column_stack([mesh.points[:, :2], levels[np.rint(3 * mesh.points[:, 2]).astype(int)]])
    sides = np.concatenate([mesh.facets[face] for face in ("x0", "x1", "y0", "y1")])
    low = sides[(points[sides, 2] <= layer).all(axis=1)]
    mesh = replace(mesh, points=points, facets=mesh.facets | {"low": low})
    flat = Affine(((0.0, 0.0, 0.0), (0.0, 0.0, 0.0), (0.0, 0.0, -0.9)))
    fixed = Prescribed("low", "low", (0, 1, 2), flat), Prescribed("top", "z1", (0, 1, 2), Rest())
    flesh = (effect("neo_hooke", mu="10 kPa"), resistance("Q1/P0", 1.0))
    body = Body(mesh, flesh, fixed, (0.0, 1.0))
    solved = session.solve(body, BodySettings(element="Q1/P0", first_step=0.1, smallest_step=1e-2, residual=1e-10))
    assert solved.outcome.status == status, solved.outcome.message
    assert "incompressible is outside its range of validity" in solved.outcome.message
    if status == "converged":
        assert solved.last.scalars["min_cell_volume_ratio"] == pytest.approx(0.1, abs=1e-9)
        assert solved.last.scalars["outside_law"] == 1
    else:
        assert "2 % of the body collapsed" in solved.outcome.message


PLANE = Surface(np.array([[-9.0, -9, 0], [19, -9, 0], [-9, 19, 0]]), np.array([[0, 1, 2]]))  # z = 0


def drawn(session, acting: tuple[Effect, ...], stretch: float):
    """A block with fibres along x, all of its surface drawn along them without change of volume."""
    across = stretch**-0.5
    gradient = ((stretch - 1, 0.0, 0.0), (0.0, across - 1, 0.0), (0.0, 0.0, across - 1))
    flesh = (effect("neo_hooke", mu="10 kPa"), resistance("Q1/P0", 1.0), *acting)
    mesh = shapes.box((2, 2, 2), (1.0, 1.0, 1.0), "hexahedron")
    half = {"half": Blended(Around(PLANE, 0.5), 0.0)}
    body = Body(mesh, flesh, everywhere(gradient), (0.0, 1.0), Along((1.0, 0.0, 0.0)), regions=half)
    return session.solve(body, BodySettings(element="Q1/P0", first_step=0.25, residual=1e-11))


@pytest.mark.parametrize(("stretch", "beyond"), [(1.7, ""), (1.8, "above 1.76"), (0.4, "below 0.44")], ids=str)
def test_fibres_outside_their_range_are_named(stretch, beyond, session) -> None:
    solved = drawn(session, (ACTIVE,), stretch)
    assert solved.outcome.status == "converged"
    assert solved.last.scalars["min_cell_fibre_stretch"] == pytest.approx(stretch, abs=1e-9)
    assert solved.last.scalars["max_cell_fibre_stretch"] == pytest.approx(stretch, abs=1e-9)
    assert solved.last.scalars["outside_law"] == (8 if beyond else 0)
    words = "fibre_active is outside its range of validity in 1 of the states reached, first at frame 1: fibre stretch"
    assert (words in solved.outcome.message) == bool(beyond)
    assert solved.outcome.message.endswith(beyond or "all 2 frames reached")


def test_only_laws_that_act_have_a_range(session) -> None:
    resting = ACTIVE.model_copy(update={"ramp": (RampPoint(frame=0, amount=0.0),)})
    solved = drawn(session, (resting,), 1.8)
    assert solved.last.scalars["outside_law"] == 0
    assert solved.outcome.message == "all 2 frames reached"


def test_a_law_has_its_range_where_it_acts(session) -> None:
    """Of eight cells half are in the region of the law: these are outside its range."""
    solved = drawn(session, (ACTIVE.model_copy(update={"region": "half"}),), 1.8)
    assert solved.last.scalars["outside_law"] == 4
    assert "fibre_active is outside its range" in solved.outcome.message


def test_fibres_are_as_long_as_their_prestretch_has_them(session) -> None:
    prestretch = effect("prestretch", stretch=1.5, ramp=ONCE)
    solved = drawn(session, (PASSIVE, prestretch), 1.2)
    assert solved.last.scalars["max_cell_fibre_stretch"] == pytest.approx(1.2 * 1.5, abs=1e-9)
    assert "fibre_passive is outside its range" in solved.outcome.message


@pytest.mark.usefixtures("all_cores")
def test_ranks_agree_on_what_is_outside(session) -> None:  # noqa: ARG001 - it skips where there is no FEniCSx
    flesh = (effect("neo_hooke", mu="10 kPa"), effect("incompressible", bulk="1 MPa"), ACTIVE)
    pull = RigidMotion((0.0, 0.0, 1.0), None, (0.0, 1.0), (0.0, 17.0))
    problem = bodies.bar((1, 1, 2), (10, 10, 20), {"bottom": None, "top": pull}, flesh, (0, 1))
    problem = replace(problem, fibre=ByCell(np.tile([0.0, 0.0, 1.0], (len(problem.mesh.tets), 1))))
    found = []
    for ranks in (1, 2):
        frames = []
        outcome = fenicsx.solve(problem, Settings(ranks=ranks, first_step=0.25), frames.append)
        assert outcome.status == "converged"
        assert "fibre_active is outside its range" in outcome.message
        assert f"a law outside its range in {frames[-1].scalars['outside_law']:.0f} cells" in frames[-1].note
        found.append({name: value for name, value in frames[-1].scalars.items() if "cell" in name or "law" in name})
    assert found[1] == pytest.approx(found[0], abs=1e-6)
    assert found[0]["outside_law"] > 0
