"""Masses on springs against closed forms, what they conserve, when they are stable, and a muscle made of them."""

import math
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
import shapes
from numpy.testing import assert_allclose

from fem_reference.foundations.errors import InputError
from fem_reference.foundations.mesh import Surface
from fem_reference.foundations.motion import RigidMotion, apply
from fem_reference.foundations.records import parse
from fem_reference.geometry.embedding import Locator
from fem_reference.geometry.rigid_bodies import HalfSpace
from fem_reference.problems.muscle import MuscleProblem
from fem_reference.problems.setup import Bone
from fem_reference.runs.store import Frame, Outcome
from fem_reference.solvers import mass_spring
from fem_reference.solvers.spring_kernels import Network, PrescribedPath, advance, forces

NOTHING = np.zeros((0, 3))
FREE = PrescribedPath(np.zeros(0, np.int64), NOTHING, NOTHING)
STIFFNESS, MASS = 0.3, 2e-6  # N/mm, tonne
USUAL = {"stiffness": "1 N/mm", "density": "1060 kg/m3", "frame_time": "20 ms", "damping": "0.02 N s/m"}
BEND = RigidMotion((1, 0, 0), (5, 5, 0), (0.0, 10.0), (0.0, 0.3))


def network(springs, lengths, count: int, damping: float = 0.0, gravity=(0.0, 0.0, 0.0)) -> Network:
    ends = np.array(springs, np.int64).reshape(-1, 2)
    return Network(np.full(count, MASS), ends, np.array(lengths, float), STIFFNESS, damping, np.array(gravity, float))


def on_a_line(*places: float) -> np.ndarray:
    return np.column_stack([np.zeros((len(places), 2)), places])


def tangle(seed: int, damping: float = 0.0) -> tuple[np.ndarray, Network]:
    """Twelve masses in space, each joined to each, and none at rest."""
    random = np.random.default_rng(seed)
    springs = np.array([(i, j) for i in range(12) for j in range(i)])
    return random.uniform(-10, 10, (12, 3)), network(springs, random.uniform(5, 15, len(springs)), 12, damping)


def test_the_report_s_damping_is_critical_for_one_stiffness() -> None:
    critical = (2 + math.sqrt(12)) / 1000  # N/mm
    assert_allclose(mass_spring.report_damping(MASS, critical), 2 * math.sqrt(MASS * critical), rtol=1e-14)
    # Of stiff springs it is that of 4 N/m, whatever they are.
    assert_allclose(mass_spring.report_damping(MASS, 1e9), 2 * math.sqrt(MASS * 0.004), rtol=1e-9)
    # 1 kg on 1 N/m: 2 sqrt(2 (2 + 4)) kg/s.
    assert_allclose(mass_spring.report_damping(1e-3, 1e-3), 2 * math.sqrt(12) / 1000, rtol=1e-14)


@pytest.mark.parametrize("damping", [0.0, 5e-4])
def test_the_stable_time_step_of_two_masses_is_sharp(damping) -> None:
    springs = network([0, 1], [10], 2, damping)
    limit = mass_spring.stable_time_step(springs, FREE.fixed)
    if not damping:
        assert_allclose(limit, 2 / math.sqrt(2 * STIFFNESS / MASS), rtol=1e-14)
    grown = []
    for share in (0.99, 1.01):
        points = on_a_line(-5.0005, 5.0005)
        advance(points, points.copy(), springs, FREE, share * limit, 600)
        grown.append(abs(points[1, 2] - points[0, 2] - 10))
    assert grown[0] < 0.02 < 1 < grown[1]


def test_the_stable_time_step_is_safe_for_any_shape() -> None:
    """Against the greatest eigenvalue of the springs' stiffness, by differences of their forces, stretched and squeezed."""
    for seed in range(5):
        points, springs = tangle(seed)
        steps = 1e-6 * np.eye(points.size).reshape(-1, 12, 3)
        slope = [(forces(points + step, springs) - forces(points - step, springs)).ravel() / 2e-6 for step in steps]
        greatest = np.linalg.eigvalsh(-np.array(slope) / MASS).max()
        assert mass_spring.stable_time_step(springs, FREE.fixed) <= 2 / math.sqrt(greatest)
    assert mass_spring.stable_time_step(springs, np.arange(12)) == math.inf


def bar(top: RigidMotion | None, frames=(0, 5, 10), bottom=None) -> MuscleProblem:
    return shapes.bar((2, 2, 4), (10, 10, 30), {"bottom": bottom, "top": top}, (), frames)


def solved(problem: MuscleProblem, **changes: object) -> tuple[Outcome, list[Frame]]:
    frames: list[Frame] = []
    settings = {name: value for name, value in (USUAL | changes).items() if value is not None}
    return mass_spring.solve(
        problem, parse(mass_spring.MassSpringSettings, settings, "candidate[0]"), frames.append
    ), frames


def test_a_muscle_is_its_points_edges_and_mass() -> None:
    mesh = shapes.box((2, 2, 4), (10, 10, 30))
    found = mass_spring.network_of(mesh, parse(mass_spring.MassSpringSettings, USUAL, "candidate[0]"))
    assert_allclose(found.masses.sum(), 1.06e-9 * 3000, rtol=1e-12)
    # Each cell edge, face diagonal and cell diagonal of Kuhn's tets once: by Euler, V - E + F - T = 1 of a ball.
    triangles = np.unique(np.sort(mesh.tets[:, [[1, 2, 3], [0, 2, 3], [0, 1, 3], [0, 1, 2]]].reshape(-1, 3)), axis=0)
    assert len(mesh.points) - len(found.springs) + len(triangles) - len(mesh.tets) == 1
    assert_allclose(forces(np.array(mesh.points), found), 0, atol=1e-12)


def test_fixed_vertices_follow_their_bones_where_the_tets_do_not_resolve_them() -> None:
    given = bar(BEND)
    more = replace(given.attached[1], vertices=np.flatnonzero(given.surface.points[:, 2] > 20))
    _, frames = solved(replace(given, attached=(given.attached[0], more)))
    expected = apply(BEND.pose(10), given.surface.points[more.vertices])
    assert_allclose(frames[-1].surface[more.vertices], expected, atol=1e-9)


def test_surface_and_fibres_go_with_the_tetrahedra() -> None:
    given = bar(BEND)
    _, frames = solved(given)
    carried = Locator(given.mesh).embed(given.fibres.points).interpolate(given.mesh, frames[-1].points)
    assert_allclose(frames[-1].fibres, carried, atol=1e-12)
    assert np.abs(frames[-1].surface - given.surface.points).max() > 1
    assert frames[-1].scalars["inverted_tets"] == 0


def test_moved_with_both_its_bones_a_muscle_comes_to_rest_undeformed() -> None:
    turn = RigidMotion((0, 1, 0), (0, 0, -20), (0.0, 5.0), (0.0, 0.5))
    given = bar(turn, (0, 60), turn)
    outcome, frames = solved(given)
    # Swinging dies out with c / 2 m = 150 / s or more and 1.1 s are left: rounding of the forces.
    assert_allclose(frames[-1].surface, apply(turn.pose(5), given.surface.points), atol=1e-6)
    assert frames[-1].scalars["unbalanced_max"] < 1e-6
    assert outcome.message.startswith("60 frame numbers with ")


@pytest.mark.slow
def test_half_the_time_step_halves_the_error_of_a_motion() -> None:
    wanted = [solved(bar(BEND), time_step=f"{step} us")[1][-1].surface for step in (4, 2, 1)]
    first, second = (np.abs(one - other).max() for one, other in pairwise(wanted))
    assert first < 0.01
    assert_allclose(first / second, 2, atol=0.1)  # the velocity of eq. 5.7 is of first order


@pytest.mark.parametrize(
    "change",
    [
        {"stiffness": "0.1 N/mm"},
        {"density": "2000 kg/m3"},
        {"frame_time": "5 ms"},
        {"damping": None},
        {"damping": "eq. 5.5"},
        {"gravity": "0, -9.81, 0 m/s^2"},
        {"time_step": "0.01 ms"},
    ],
)
def test_every_setting_is_felt(change) -> None:
    usual, changed = (solved(bar(BEND), **changes)[1][-1].surface for changes in ({}, change))
    assert np.abs(changed - usual).max() > 1e-6


def test_bones_keep_masses_out() -> None:
    """A soft bar that hangs sideways between its ends sags onto a plane that comes up, in the end above where they are fixed."""
    lift = RigidMotion((0, 1, 0), None, (0.0, 40.0), (0.0, 3.5))
    floor = Bone("floor", Surface(np.eye(3), np.array([[0, 1, 2]])), lift, solid=HalfSpace((5, -3.0, 5), (0, 1, 0)))
    given = replace(bar(None, (0, 40)), bones=(floor,))
    soft = {"stiffness": "0.01 N/mm", "gravity": "0, -40, 0 m/s^2", "damping": "0.001 N s/m"}
    _, sagging = solved(given, **soft)
    assert sagging[-1].points[:, 1].min() < -2.5
    outcome, frames = solved(given, **soft, collision={"gap": "0.5 mm", "stiffness": 1.0})
    assert outcome.status == "converged"
    # Each step ends with its projection, of a plane exactly: round-off is left.
    fixed = np.isin(given.mesh.points[:, 2], (0, 30))
    assert_allclose(frames[-1].points[~fixed, 1].min(), 0.5 + 0.5, atol=1e-9)
    assert_allclose(frames[-1].points[fixed], given.mesh.points[fixed], atol=1e-12)


def test_cost() -> None:
    outcome, _ = solved(bar(BEND), time_step="1 ms", stiffness="0.001 N/mm")
    assert outcome.message == "10 frame numbers with 20 steps of 0.001 s each"
    assert outcome.cost["iterations"] == 10
    assert outcome.cost["time_steps"] == 200
    assert outcome.cost["threads"] == 1
    assert 0 < outcome.cost["seconds_solve"] == pytest.approx(10 * outcome.cost["seconds_per_iteration"])
    assert outcome.cost["seconds_compile"] >= 0


def test_above_the_stable_time_step_it_diverges_and_says_why() -> None:
    outcome, frames = solved(bar(BEND), time_step="2 ms", damping=None)
    assert outcome.status == "diverged"
    assert "; the time step of 0.002 s is longer than the stable step of " in outcome.message
    assert frames[0].number == 0


def test_a_muscle_torn_apart_is_an_outcome() -> None:
    leap = RigidMotion((0, 0, 1), None, (0.0, 4.0, 5.0), (0.0, 0.0, math.inf))
    with np.errstate(invalid="ignore"):
        outcome, frames = solved(bar(leap), time_step="1 ms", stiffness="0.001 N/mm")
    assert outcome.status == "diverged"
    assert "is not a number" in outcome.message
    assert outcome.message.endswith("a longer frame_time or more damping may help")
    assert [frame.number for frame in frames] == [0]


def test_a_muscle_spread_too_wide_is_an_outcome() -> None:
    outcome, _ = solved(bar(None), gravity="0, 0, -1e6 m/s^2", stiffness="0.001 N/mm", time_step="0.1 ms")
    assert outcome.status == "diverged"
    assert "the muscle extends over " in outcome.message


def pressed(travel: float) -> MuscleProblem:
    """A soft bar of two cells, 30 mm long, whose upper end goes down by ``travel`` [mm] faster than the middle follows."""
    down = RigidMotion((0, 0, -1), None, (0.0, 1.0), (0.0, travel))
    return shapes.bar((1, 1, 2), (10, 10, 30), {"bottom": None, "top": down}, (), (0, 1))


FAST = {"stiffness": "0.001 N/mm", "frame_time": "0.01 ms"}


def test_a_muscle_turned_inside_out_is_an_outcome() -> None:
    outcome, frames = solved(pressed(40.0), **FAST)
    assert outcome.status == "inverted"
    assert outcome.message.startswith("frame 1: the surface is turned inside out; ")
    assert [frame.number for frame in frames] == [0]


def test_single_tetrahedra_inside_out_are_reported() -> None:
    # The upper end is below the middle and above the lower end: all six tetrahedra of the upper cell are inside out.
    outcome, frames = solved(pressed(20.0), **FAST)
    assert outcome.status == "converged"
    assert outcome.message.endswith("; 6 of 12 tetrahedra are inside out at the last frame")
    assert frames[-1].scalars["inverted_tets"] == 6


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (
            {"time_step": "1e-12 s"},
            "2e+10 steps for each frame number, but at most 100000 are allowed; a longer time_step may help",
        ),
        ({"damping": "1e9 N s/m"}, "a stiffness of 1 N/mm and a damping of 1e+06 N s/mm need "),
        ({"stiffness": "1e9 N/mm"}, "a stiffness of 1e+09 N/mm and a damping of 2e-05 N s/mm need "),
    ],
)
def test_too_many_steps_are_not_begun(change, message) -> None:
    outcome, frames = solved(bar(BEND), **change)
    assert outcome.status == "out of steps"
    assert outcome.message.startswith(message)
    assert [frame.number for frame in frames] == [0]
    assert outcome.cost["time_steps"] == 0


def test_steps_in_parts_are_the_steps_at_once() -> None:
    # 450 steps are asked for 200 at a time; ends go as evenly, but for rounding of 30 mm.
    given = bar(BEND)
    asked = parse(mass_spring.MassSpringSettings, USUAL | {"frame_time": "0.9 ms", "time_step": "2 us"}, "candidate[0]")
    model = mass_spring.MassSpringModel(given, asked)
    assert model.steps == 450
    rest = np.array(given.mesh.points)
    at_once, before = rest.copy(), rest.copy()
    model.move(1)
    ends = [model.carried(number)[model.fixed] for number in (0, 1)]
    advance(at_once, before, model.network, PrescribedPath(model.fixed, *ends), model.time_step, 450)
    assert np.abs(model.points - rest).max() > 0.1
    assert_allclose(model.points, at_once, rtol=0, atol=1e-11)
    assert_allclose(model.previous, before, rtol=0, atol=1e-11)


@pytest.mark.parametrize("damping", [1e-3, 1.0, 1e6, 1e200])
def test_the_stable_time_step_at_great_damping(damping) -> None:
    # Where c is great, 4 m - 2 c dt = 0: the next term of the root is smaller by 2 k m / c^2, a share of 1.2e-6 of c = 1e-3.
    found = mass_spring.stable_time_step(network([0, 1], [10], 2, damping), FREE.fixed)
    assert_allclose(found, 2 * MASS / damping, rtol=max(1e-12, 3 * STIFFNESS * MASS / damping / damping))


def test_another_clock_than_the_scenes_is_reported() -> None:
    outcome, _ = solved(replace(bar(BEND), interval=0.5))
    assert outcome.message.endswith("; the time between frame numbers is 0.02 s in this solver, but 0.5 s in the scene")
    assert "the scene" not in solved(replace(bar(BEND), interval=0.02))[0].message


@pytest.mark.parametrize("key", ["stiffness", "density", "frame_time"])
def test_physics_has_no_defaults(key) -> None:
    with pytest.raises(InputError, match=f"{key}: got nothing, want this key"):
        solved(bar(None), **{key: None})


@pytest.mark.parametrize(
    ("key", "value", "want"),
    [
        ("stiffness", "1 kPa", "a stiffness with its unit"),
        ("stiffness", "0 N/m", "more than zero"),
        ("damping", "critical", '"eq. 5.5" or a damping with its unit'),
        ("damping", "-1 N s/m", '"eq. 5.5" or more than zero'),
        ("time_step", "0 s", "more than zero"),
    ],
)
def test_settings_that_are_refused(key, value, want) -> None:
    with pytest.raises(InputError, match=rf'candidate\[0\]\.{key}: got "{value}", want {want}'):
        solved(bar(None), **{key: value})
