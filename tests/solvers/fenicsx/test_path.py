"""States that do not belong to one path are not taken; those under the same loads are taken up again, as far as memory goes."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

pytest.importorskip("fem_reference.solvers.fenicsx.dolfinx_door", reason="FEniCSx is not installed")

from mpi4py import MPI

from fem_reference import effects
from fem_reference.foundations import limits
from fem_reference.foundations.motion import RigidMotion
from fem_reference.problems import shapes
from fem_reference.problems.body import Body, Prescribed
from fem_reference.problems.paths import Follows, Rest, Turn
from fem_reference.solvers.fenicsx import BodySettings, path
from fem_reference.studies import workflow
from tests.solvers.fenicsx.test_stability import flesh

pytestmark = pytest.mark.slow


def twisted(angle: float, frames: tuple[float, ...]) -> Body:
    """A bar whose end turns by ``angle`` [rad] from frame 0 to 1."""
    mesh = shapes.box((1, 1, 3), (1.0, 1.0, 3.0), "hexahedron")
    turn = Follows(RigidMotion((0, 0, 1), (0.5, 0.5, 0.0), (0.0, 1.0), (0.0, angle)).pose)
    fixed = Prescribed("foot", "z0", (0, 1, 2), Rest()), Prescribed("head", "z1", (0, 1, 2), turn)
    return Body(mesh, flesh("Q2/Q1"), fixed, frames)


@pytest.mark.parametrize("frames", [(0.0, 1.0), (0.0, 0.25, 0.5, 0.75, 1.0)])
def test_a_bar_that_is_twisted_by_a_whole_turn_is_not_at_rest(frames, session) -> None:
    """All that is prescribed is as at rest, which one step, or the state of before, would take for the answer."""
    solved = session.solve(twisted(2 * np.pi, frames), BodySettings(element="Q2/Q1", first_step=1.0))
    half = session.solve(twisted(np.pi, (0.0, 0.5, 1.0)), BodySettings(element="Q2/Q1", first_step=0.5))
    assert solved.outcome.status == half.outcome.status == "converged"
    assert solved.last.scalars["energy"] > 3 * half.last.scalars["energy"] > 0
    assert abs(solved.last.scalars["energy_gap"]) < 0.2


# A whole turn by frame 1, as a function of a caller's own.
WHIRLED = lambda points, frame: Turn((0, 0, 1), 2 * np.pi, (0.5, 0.5, 0.0))(points, min(frame, 1.0))  # noqa: E731


def knotted(*knots: tuple[float, float]) -> Follows:
    """A turn by angles [rad] at frames."""
    frames, angles = zip(*knots, strict=True)
    return Follows(RigidMotion((0, 0, 1), (0.5, 0.5, 0.0), frames, angles).pose)


@pytest.mark.parametrize(
    ("head", "last", "step"),
    [
        (knotted((0, 0), (2, 2 * np.pi)), 5.0, 5.0),  # it ends before the step's middle
        (knotted((0, 0), (1, 2 * np.pi)), 20.0, 20.0),
        (knotted((0, 0), (3, 0), (3.5, 2 * np.pi)), 20.0, 20.0),  # and begins after it
        (WHIRLED, 20.0, 20.0),
    ],
)
def test_a_whole_turn_within_a_load_step_is_not_left_out(head, last, step, session) -> None:
    """Whichever load steps lead there, the end is that of a turn by quarters, or the other state into which the bar buckles under
    a whole turn: they store 0.01126 and 0.01120 N mm, and one that is not twisted nothing.
    """
    quarters = session.solve(twisted(2 * np.pi, (0.0, 0.25, 0.5, 0.75, 1.0)), BodySettings(element="Q2/Q1"))
    body = twisted(0.0, (0.0, last))
    body = replace(body, prescribed=(body.prescribed[0], replace(body.prescribed[1], path=head)))
    solved = session.solve(body, BodySettings(element="Q2/Q1", first_step=step))
    assert solved.outcome.status == quarters.outcome.status == "converged"
    assert solved.outcome.cost["load_steps"] >= 4
    assert solved.last.scalars["energy"] == pytest.approx(quarters.last.scalars["energy"], rel=0.01)
    assert quarters.last.scalars["energy"] > 0.01


def test_drag_feels_a_way_there_and_back_within_a_load_step(session) -> None:
    """A bar that is moved there and back within one step of its own is behind afterwards."""
    slide = Follows(RigidMotion((1, 0, 0), None, (0.0, 0.4, 0.8), (0.0, 1.0, 0.0)).pose)
    acting = (*flesh("Q2/Q1"), effects.make("damping", coefficient=1e-3))
    body = replace(twisted(0.0, (0.0, 0.8)), effects=acting, interval=1.0)
    body = replace(body, prescribed=(replace(body.prescribed[0], path=slide),))
    assert body.stops == (0.4,)
    solved = session.solve(body, BodySettings(element="Q2/Q1", first_step=1.0))
    assert solved.outcome.status == "converged"
    assert np.abs(solved.last.points - body.mesh.points).max() > 1e-3


SHEET = effects.make(
    "membrane", on="x1", thickness=0.1, mu=0.1
)  # stores as much as the bar, whose mu is 0.01 MPa, or more


@pytest.mark.parametrize(("element", "sheets"), [("P2/P1", ()), ("P1/P1", ()), ("P2/P1", (SHEET,))])
def test_what_the_energy_grows_by_is_the_work_of_the_forces(element, sheets, session) -> None:
    """By the trapezoidal rule, whose error of a step falls with its cube and the energy with its square; where pressures are
    stabilised too, whose energy is a part of it, and of a membrane, whose force is from inside as well.
    """
    mesh = shapes.box((2, 2, 4), (1.0, 1.0, 3.0), "tetrahedron")
    turn = Follows(RigidMotion((0, 1, 0), (0.5, 0.5, 1.5), (0.0, 1.0), (0.0, 0.6)).pose)
    fixed = Prescribed("foot", "z0", (0, 1, 2), Rest()), Prescribed("head", "z1", (0, 1, 2), turn)
    gaps = []
    for steps in (4, 8):
        frames = tuple(np.linspace(0.0, 1.0, steps + 1).tolist())
        body = Body(mesh, (*flesh(element), *sheets), fixed, frames)
        solved = session.solve(body, BodySettings(element=element, first_step=1.0))
        gaps.append(abs(solved.last.scalars["energy_gap"]))
    assert gaps[0] / gaps[1] > 4
    assert gaps[1] < 2e-3


class Springs:
    """What ``path.Path`` asks of a system, with an ``energy`` of its unknowns."""

    owned: int

    def __init__(self, slope, unknowns: list[float]) -> None:
        world = SimpleNamespace(comm=SimpleNamespace(allreduce=lambda value, _: value))
        values = SimpleNamespace(array=np.array(unknowns))
        self.unknowns = SimpleNamespace(x=values, function_space=SimpleNamespace(mesh=world))
        self.owned = len(unknowns)
        self.reactions = lambda **_: np.array(slope(*values.array))


def gap(energy, slope, states: list[list[float]], *, looked: bool = True) -> float:
    """The energy gap of a step from the first of ``states`` to the last, that in between being the one halfway."""
    system = Springs(slope, states[0])
    followed = path.Path(system, None)
    followed.settle(energy(*states[0]), connected=False)

    def halfway() -> bool:
        system.unknowns.x.array[:] = states[1]
        return True

    system.unknowns.x.array[:] = states[2]
    followed.settle(energy(*states[2]), halfway if looked else None)
    assert system.unknowns.x.array.tolist() == states[2]
    return followed.take_gap()


def test_a_spring_that_stiffens_loses_no_energy_in_its_first_step() -> None:
    # Force u + 3 u^2: at u = 1 mm the energy is 1.5 N mm, the trapezoid over one step has 2, Simpson's rule 1.5: it is of a cubic.
    given = (lambda u: u**2 / 2 + u**3, lambda u: [u + 3 * u**2], [[0.0], [0.5], [1.0]])
    assert gap(*given, looked=False) == pytest.approx(-1 / 3, abs=1e-12)
    assert gap(*given) == pytest.approx(0, abs=1e-12)


@pytest.mark.parametrize("before", [True, False])
def test_a_snap_stays_a_gap_however_it_is_looked_at(before) -> None:
    # An end a is moved, a spring of 0.2 pulls at b between two wells, which snaps out of the left one where its slope vanishes.
    soft = 0.2
    energy = lambda a, b: soft / 2 * (a - b) ** 2 + (b**2 - 1) ** 2 / 4  # noqa: E731
    slope = lambda a, b: [soft * (a - b), b**3 - b - soft * (a - b)]  # noqa: E731

    def well(a: float, *, right: bool) -> list[float]:
        roots = np.roots([1, 0, soft - 1, -soft * a])
        real = np.sort(roots[abs(roots.imag) < 1e-9].real)
        return [a, float(real[-1] if right else real[0])]

    snap = -np.sqrt((1 - soft) / 3)
    limit = snap + (snap**3 - snap) / soft
    lost = energy(limit, snap) - energy(*well(limit, right=True))
    step = [limit - 0.03, limit - 0.01 if before else limit + 0.01, limit + 0.05]
    states = [well(a, right=a > limit) for a in step]
    greatest = max(energy(*states[0]), energy(*states[2]))
    found = gap(energy, slope, states)
    # Where in the step the pull falls by what it falls, no rule knows: so much times the step.
    falls = (slope(*states[0])[0] - slope(*states[2])[0]) * (step[2] - step[0])
    assert abs(found * greatest + lost) < falls < 0.1 * lost
    assert abs(found) > limits.ENERGY_GAP


@pytest.mark.usefixtures("session")
def test_the_main_job_loses_no_energy_in_its_first_step(tmp_path) -> None:
    """By the trapezoid 13 % of what the first step of ten frames stores: of the rule and not of the body, which is where steps of
    half the size take it too.
    """
    quick = {"muscle.refinements": 0, "frames.last": 20}
    runs = [
        workflow.solve(workflow.load_case("hip_flexion", quick | changes), store=tmp_path)
        for changes in ({}, {"reference.first_step": 5.0, "reference.largest_step": 5.0})
    ]
    assert all(np.abs(run.scalars["energy_gap"]).max() < limits.ENERGY_GAP for run in runs)
    assert abs(runs[0].scalars["energy_gap"][1]) < 0.005  # Simpson's rule, whose error falls with the fourth power
    # Both end where forces are in balance to 1e-8 N.
    np.testing.assert_allclose(*(run.scalars["energy"] for run in runs), rtol=1e-7)
    np.testing.assert_allclose(*(run.positions for run in runs), atol=1e-5)


def state(*acting: float) -> path.KnownState:
    return path.KnownState(np.array(acting), np.zeros(3), None)


def test_a_state_is_known_where_nothing_that_acts_differs_by_more_than_rounding() -> None:
    states = path.Known(MPI.COMM_SELF)
    assert states.find(np.array([0.0, 1.0])) is None
    here, there = state(0.0, 1.0), state(0.0, 2.0)
    states.add(here)
    states.add(there)
    assert states.find(np.array([1e-10, 1.0])) is here
    assert states.find(np.array([0.0, 2.0])) is there
    assert states.find(np.array([1e-6, 1.0])) is None  # a nanometre is another load
    assert states.find(np.array([0.0, 1.5])) is None


def test_the_latest_states_are_kept(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(path, "_MOST", 2 * (3 + 1) * 8.0)  # bytes, two states of four numbers
    states = path.Known(MPI.COMM_SELF)
    for i in range(3):
        states.add(state(float(i)))
    assert states.find(np.array([0.0])) is None
    assert [states.find(np.array([float(i)])) is not None for i in (1, 2)] == [True, True]
