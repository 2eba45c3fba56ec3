"""Checks of runs by what they recorded: each denies what is planted, at its frame and place, and nothing else."""

from dataclasses import replace

import numpy as np
import pytest
from crossings import BLOCK, CONVERGED, coarse, resting
from numpy.testing import assert_allclose

from fem_reference import effects
from fem_reference.assessment import second_check
from fem_reference.assessment.run_checks import RunCheck, give, of_body, of_muscle
from fem_reference.foundations.motion import RigidMotion
from fem_reference.foundations.motion import RigidMotion as Turn
from fem_reference.geometry.rigid_bodies import Sphere
from fem_reference.geometry.sectors import attached_shares
from fem_reference.geometry.skins import attached_skin
from fem_reference.geometry.tessellation import tessellated
from fem_reference.problems import shapes as bodies
from fem_reference.problems.body import Body, Prescribed
from fem_reference.problems.muscle import MuscleProblem
from fem_reference.problems.paths import Affine
from fem_reference.problems.touching import Touching
from fem_reference.runs.store import Frame, Run, collected

BONES = ("floor", "lid")


def lost(problem: MuscleProblem, run: Run) -> list[str]:
    return [one.name for one in of_muscle(problem, run) if not one.met]


def away(problem: MuscleProblem) -> MuscleProblem:
    """Without the ball."""
    return replace(problem, bones=problem.bones[:2])


@pytest.mark.slow
def test_a_ball_that_goes_through_a_bar_that_does_not_move_is_denied(tmp_path) -> None:
    problem = coarse(tmp_path)
    run = resting(problem, contact_pressure=np.zeros(5))
    assert lost(problem, run) == ["ball in the muscle"]
    (check,) = (one for one in of_muscle(problem, run) if not one.met)
    assert check.value >= 3.0 - 0.02  # its radius at least: it goes through the middle
    assert check.frame in (5, 10, 15)
    # Whatever pressure was recorded: at its middle nothing gives way any more.
    assert lost(problem, replace(run, scalars={"contact_pressure": np.full(5, 100.0)})) == ["ball in the muscle"]
    denied = second_check.confirmed(CONVERGED, of_muscle(problem, run))
    assert denied.status == "denied"
    assert denied.message.startswith("denied by the second check: ball in the muscle: ")


def test_what_large_triangles_pass_through_and_tetrahedra_do_not_is_not_crossed(tmp_path) -> None:
    problem = coarse(tmp_path)
    aside = problem.mesh.points + [0.0, 0.0, 100.0]
    for nodes, met in ((aside, True), (problem.mesh.points, False)):
        checks = {one.name: one.met for one in of_muscle(problem, resting(problem), lambda _, nodes=nodes: nodes)}
        assert checks["ball in the muscle"] is met


def test_what_is_no_number_is_never_met() -> None:
    assert [RunCheck("a", value, 1.0, "mm", 0).met for value in (0.0, 1.0, 1.1, np.nan, np.inf)] == [
        True,
        True,
        *[False] * 3,
    ]
    assert not RunCheck("a", 0.0, np.nan, "mm", 0).met


def test_what_is_so_at_rest_is_no_crossing(tmp_path) -> None:
    problem = coarse(tmp_path)
    still = tuple(replace(bone, motion=None) for bone in problem.bones)
    sphere = Sphere((-1.0, 5.0, 20.0), 3.0)
    inside = replace(still[2], surface=tessellated(sphere, BLOCK.points, "ball"), solid=sphere)
    problem = replace(problem, bones=(*still[:2], inside))
    run = resting(problem)
    assert lost(problem, run) == []
    free = np.setdiff1d(np.arange(len(BLOCK.points)), problem.attached_vertices)
    for farther, found in ((0.1, []), (2.0, ["ball in the muscle"])):  # into the ball, which is 2 mm in the bar at rest
        moved = np.array(run.positions)
        moved[2, free] -= [farther, 0.0, 0.0]
        assert lost(problem, replace(run, positions=moved)) == found


def test_contact_gives_way_by_the_pressure_over_its_stiffness(tmp_path) -> None:
    problem = coarse(tmp_path)
    for stiffness, given in ((1.0, 0.5), (10.0, 0.05)):
        contact = effects.make("contact", stiffness=f"{stiffness} MPa/mm", bones=("ball",))
        pressed = replace(problem, effects=(*problem.effects[:2], contact))
        none, some = (give(pressed, problem.bones[2], pressure, 1.0) for pressure in (0.0, 0.5))
        assert some - none == pytest.approx(given)


def test_bones_that_are_not_in_contact_may_cross(tmp_path) -> None:
    problem = coarse(tmp_path)
    problem = replace(
        problem, effects=(*problem.effects[:2], effects.make("contact", stiffness="1 MPa/mm", bones=("lid",)))
    )
    assert lost(problem, resting(problem)) == []


def test_frames_and_what_is_not_finite(tmp_path) -> None:
    problem = away(coarse(tmp_path))
    run = resting(problem)
    assert lost(problem, run) == []
    for numbers in ((0, 10, 5, 15, 20), (0, 5, 10, 15)):
        assert lost(problem, replace(run, numbers=numbers, positions=run.positions[: len(numbers)])) == [
            "frames that are missing or out of order"
        ]
    for bad in (np.nan, np.inf):
        spoilt = np.array(run.positions)
        spoilt[3, 7, 1] = bad
        (check,) = (one for one in of_muscle(problem, replace(run, positions=spoilt)) if not one.met)
        assert (check.name, check.frame, check.value) == ("positions that are not finite", 15, 1)


def test_exact_attachments_are_where_their_bones_are(tmp_path) -> None:
    problem = away(coarse(tmp_path))
    lid = replace(problem.bones[1], motion=RigidMotion((1.0, 0.0, 0.0), None, (0.0, 20.0), (0.0, 4.0)))
    high = replace(problem.attached[1], bone=lid)
    problem = replace(problem, bones=(problem.bones[0], lid), attached=(problem.attached[0], high))
    assert lost(problem, resting(problem)) == ["high away from lid"]
    followed = np.array(resting(problem).positions)
    followed += np.arange(5)[:, None, None] * [1.0, 0.0, 0.0] * (BLOCK.points[:, 2:] / 40)
    run = replace(resting(problem), positions=followed)
    assert lost(problem, run) == []
    assert lost(problem, replace(run, positions=followed[[0, 1, 3, 2, 4]])) == ["high away from lid"]


def test_springs_yield_as_far_as_the_recorded_force_says(tmp_path) -> None:
    problem = away(coarse(tmp_path))
    low = replace(problem.attached[0], stiffness=0.1)
    skin = attached_skin(BLOCK, attached_shares(BLOCK, low.vertices), problem.mesh, 1.0)
    problem = replace(problem, attached=(low, problem.attached[1]), attached_skins={"low": skin})
    yielded = np.array(resting(problem).positions)
    yielded[2][low.vertices] += [0.0, 0.0, 0.5]  # over 100 mm2: 5 N
    run = replace(resting(problem), positions=yielded)
    assert lost(problem, replace(run, scalars={"force_low": np.array([0.0, 0, 5, 0, 0])})) == []
    assert lost(problem, replace(run, scalars={"force_low": np.array([0.0, 0, 1, 0, 0])})) == [
        "mean extension of springs of low"
    ]


@pytest.mark.slow
@pytest.mark.parametrize(("last", "steps", "met"), [(2.0, 1, False), (2.0, 2, False), (2.0, 4, True), (20.0, 1, True)])
def test_a_turn_takes_steps_enough(tmp_path, last, steps, met) -> None:
    # Once round by frame 2 of the first interval of 5, or a quarter of it by then.
    problem = away(coarse(tmp_path))
    lid = replace(problem.bones[1], motion=Turn((0, 0, 1), (5, 5, 0), (0.0, last), (0.0, 2 * np.pi)))
    problem = replace(problem, bones=(problem.bones[0], lid))
    run = resting(problem, load_steps=np.array([0.0, steps, steps, steps, steps]))
    assert ("rotation of lid per load step" in lost(problem, run)) is not met
    (check,) = (one for one in of_muscle(problem, run) if one.name == "rotation of lid per load step")
    assert_allclose(check.value, 2 * np.pi / (steps if last == 2 else 4 * steps))


def test_there_and_back_counts_twice(tmp_path) -> None:
    problem = away(coarse(tmp_path))
    lid = replace(problem.bones[1], motion=Turn((0, 0, 1), (5, 5, 0), (0.0, 1.0, 2.0), (0.0, np.pi, 0.0)))
    problem = replace(problem, bones=(problem.bones[0], lid))
    run = resting(problem, load_steps=np.array([0.0, 2, 1, 1, 1]))
    assert lost(problem, run) == ["rotation of lid per load step"]


def test_forces_that_are_not_in_balance(tmp_path) -> None:
    problem = away(coarse(tmp_path))
    run = replace(
        resting(problem, net_force=np.zeros(5), net_moment=np.zeros(5)),
        origin={"settings": {"residual": 1e-8}},
        outcome=replace(CONVERGED, cost={"unknowns": 1e4}),
    )
    assert lost(problem, run) == []
    for kind in ("force", "moment"):
        scalars = run.scalars | {f"net_{kind}": np.array([0.0, 0, 0, 1e-2, 0])}
        assert lost(problem, replace(run, scalars=scalars)) == [f"residual {kind}"]
        # What is no number in one frame is not forgotten for what is well in the next.
        lost_number = run.scalars | {f"net_{kind}": np.array([0.0, np.nan, 0, 0, 0])}
        assert lost(problem, replace(run, scalars=lost_number)) == [f"residual {kind}"]
        ramp = [{"frame": 0.0, "amount": 1.0}, {"frame": 20.0, "amount": 1.0}]
        weighs = effects.make("gravity", density="1000 kg/m^3", acceleration="0, 0, -9.81 m/s^2", ramp=ramp)
        assert lost(replace(problem, effects=(*problem.effects, weighs)), replace(run, scalars=scalars)) == []


@pytest.mark.slow
def test_bones_carry_weights_and_dead_loads(tmp_path) -> None:
    """A bar of 4,000 mm3 of water weighs 39.24 mN; 1 kPa on its four free sides of 400 mm2 each is 1.6 N."""
    problem = away(coarse(tmp_path))
    ramp = [{"frame": 0.0, "amount": 0.0}, {"frame": 20.0, "amount": 2.0}]
    weighs = effects.make("gravity", density="1000 kg/m^3", acceleration="0, 0, -9.81 m/s^2", ramp=ramp)
    pulled = effects.make("traction", on="free", force="1, 0, 0 kPa", ramp=ramp)
    problem = replace(problem, effects=(*problem.effects, weighs, pulled))
    carried = np.linspace(0, 2, 5)[:, None] * [1.6, 0.0, -0.03924]
    scalars = {f"force_on_{bone}_{axis}": carried[:, i] / 2 for bone in BONES for i, axis in enumerate("xyz")}
    origin, cost = {"settings": {"residual": 1e-9}}, {"unknowns": 1e4}
    run = replace(resting(problem, **scalars), origin=origin, outcome=replace(CONVERGED, cost=cost))
    assert lost(problem, run) == []
    (check,) = (one for one in of_muscle(problem, run) if "carry" in one.name)
    assert check.allowed == pytest.approx(1e-6, rel=0.01)
    for wrong in (1e-3, np.nan):
        less = run.scalars | {"force_on_lid_z": run.scalars["force_on_lid_z"] + [0, 0, 0, wrong, 0]}
        assert lost(problem, replace(run, scalars=less)) == ["forces that bones do not carry"]
    # What the solver recorded is checked too, and the moment with it.
    recorded = run.scalars | {f"load_force_{axis}": carried[:, i] for i, axis in enumerate("xyz")}
    recorded |= {f"load_moment_{axis}": carried[:, i] * 20 for i, axis in enumerate("xyz")}
    recorded |= {f"moment_on_{bone}_{axis}": carried[:, i] * 10 for bone in BONES for i, axis in enumerate("xyz")}
    assert lost(problem, replace(run, scalars=recorded)) == []
    allowed = {
        one.name: one.allowed for one in of_muscle(problem, replace(run, scalars=recorded)) if "carry" in one.name
    }
    assert allowed["moments that bones do not carry"] == pytest.approx(40e-6, rel=0.01)  # times the farthest coordinate
    for kind in ("force", "moment"):
        for wrong in (1e-3, np.nan):
            more = recorded | {f"load_{kind}_y": recorded[f"load_{kind}_y"] + [0, 0, wrong, 0, 0]}
            assert lost(problem, replace(run, scalars=more)) == [f"{kind}s that bones do not carry"]
    both = recorded | {key: 2 * value for key, value in recorded.items()}  # of twice the density: not that of the scene
    assert lost(problem, replace(run, scalars=both)) == ["forces that bones do not carry"]
    # A pressure follows the surface: its sum is not known, unless it is recorded.
    squeezed = effects.make("pressure", on="free", pressure="1 kPa", ramp=ramp)
    unknown = replace(problem, effects=(*problem.effects, squeezed))
    assert not [one for one in of_muscle(unknown, run) if "carry" in one.name]


def test_a_surface_through_itself(tmp_path) -> None:
    problem = away(coarse(tmp_path))
    side = np.flatnonzero((BLOCK.points[:, 0] == 10) & (BLOCK.points[:, 2] > 10) & (BLOCK.points[:, 2] < 30))
    through = np.array(resting(problem).positions)
    through[3, side] -= [12.0, 0.0, 0.0]
    assert lost(problem, replace(resting(problem), positions=through)) == ["self-penetration of the muscle"]
    # Where it touches itself it may be as deep as the recorded pressure allows, here 10 MPa over 0.1 MPa/mm, but neither deeper
    # than is recorded nor than a share of the distance between points.
    touches = replace(problem, effects=(*problem.effects, effects.make("touching", stiffness=0.1, smoothing=0.1)))
    run = replace(resting(touches), positions=through)
    slightly = np.array(resting(problem).positions)
    slightly[3, side] -= [10.3, 0.0, 0.0]
    wrong = ["self-penetration of the muscle"]
    for shape, pressure, deep, names in (
        (through, 10.0, 12.0, wrong),
        (slightly, 0.1, 0.5, []),
        (slightly, 0.0, 0.5, wrong),
        (slightly, 0.1, 0.0, wrong),
        (slightly, np.nan, 0.5, wrong),
        (slightly, 0.1, np.nan, wrong),
    ):
        scalars = {"touching_pressure": pressure, "touching_depth": deep}
        recorded = run.scalars | {name: np.full(len(run.numbers), value) for name, value in scalars.items()}
        assert lost(touches, replace(run, positions=shape, scalars=recorded)) == names


def test_bodies_reach_their_frames_and_meet_what_is_prescribed() -> None:
    mesh = bodies.box((2, 2, 2), (1.0, 1.0, 1.0), "hexahedron")
    path = Affine(((0.0, 0.0, 0.5), (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)))
    body = Body(mesh, (), (Prescribed("top", "z1", (0, 1), path),), (0.0, 0.5, 1.0))

    def solved(points: list, frames=(0.0, 0.5, 1.0)) -> Run:
        return collected([Frame(f, points=p) for f, p in zip(frames, points, strict=True)], CONVERGED)

    def wrong(one: Run) -> list[str]:
        return [check.name for check in of_body(body, one) if not check.met]

    true = [mesh.points + path(mesh.points, frame) for frame in body.frames]
    assert wrong(solved(true)) == []
    assert second_check.confirmed_body(body, solved(true)).outcome == CONVERGED
    assert wrong(solved([true[0], true[2], true[1]])) == ["prescribed at top"]
    assert wrong(solved(true, (0.0, 1.0, 0.5))) == ["frames that are missing or out of order"]
    assert wrong(solved(true[:2], (0.0, 0.5))) == ["frames that are missing or out of order"]
    nothing = [true[0], np.full_like(true[1], np.nan), true[2]]
    assert wrong(solved(nothing)) == ["positions that are not finite"]
    denied = second_check.confirmed_body(body, solved(nothing))
    assert denied.outcome.status == "denied"
    with pytest.raises(ArithmeticError, match="denied by the second check"):
        _ = denied.last
    free = [true[0], true[1] + [0.0, 0.0, 3.0], true[2]]  # z is not prescribed
    assert wrong(solved(free)) == []


def test_parts_that_touch_overlap_by_the_give_of_contact() -> None:
    """Boxes whose corners lie on each other: the upper one 0.1 mm in the lower one, as 0.2 MPa over 2 MPa/mm allow."""
    low, high = (
        bodies.box((4, 4, 4), (1.0, 1.0, 1.0), "tetrahedron"),
        bodies.box((4, 4, 4), (1.0, 1.0, 1.0), "tetrahedron"),
    )
    mesh = bodies.joined({"low": low, "high": replace(high, points=high.points + [0, 0, 1.0])})
    law = Touching("low_z1", "high_z0", 2.0, 0.01)
    body = Body(mesh, (), (), (0.0, 1.0, 2.0), touching=(law,))
    upper = (np.arange(len(mesh.points)) >= len(low.points))[:, None]

    def wrong(depth: float, pressure: float, body: Body = body) -> list[tuple[str, float]]:
        """What is not met where the upper box is ``depth`` in the lower one in the middle frame."""
        scalars = {law.pressure_name: pressure, "touching_pressure": 9.0}  # of other parts, too
        places = [mesh.points, mesh.points - upper * [0.0, 0.0, depth], mesh.points]
        frames = [Frame(float(i), points=at, scalars=scalars) for i, at in enumerate(places)]
        return [(check.name, check.frame) for check in of_body(body, collected(frames, CONVERGED)) if not check.met]

    assert wrong(0.1, 0.2) == []
    assert wrong(0.1, 0.0) == [("low_z1 in high_z0", 1.0)]  # the same places, and contact that was lost
    assert wrong(0.1, np.nan) == [("low_z1 in high_z0", 0.0)]
    assert wrong(-0.1, 0.0) == []
    assert wrong(0.1, 0.0, replace(body, touching=())) == []


def test_an_overlap_at_rest_is_allowed_while_it_is_removed_and_each_law_has_its_own_pressure() -> None:
    boxes = {
        name: replace(box, points=box.points + [0, 0, z])
        for name, z in (("low", 0.0), ("mid", 0.9), ("top", 1.9))
        for box in [bodies.box((4, 4, 4), (1.0, 1.0, 1.0), "tetrahedron")]
    }
    mesh = bodies.joined(boxes)
    laws = [Touching("low_z1", "mid_z0", 2.0, 0.01, relaxed=(0.0, 2.0)), Touching("mid_z1", "top_z0", 2.0, 0.01)]
    body, count = Body(mesh, (), (), (0.0, 1.0, 2.0), touching=tuple(laws)), len(mesh.points) // 3
    upper = (np.arange(len(mesh.points)) >= count)[:, None] * [0, 0, 1.0]
    highest = (np.arange(len(mesh.points)) >= 2 * count)[:, None] * [0, 0, 1.0]

    def wrong(
        *lifts: float, deeper: float = 0.0, pressures: tuple[float, float] = (0.0, 0.0)
    ) -> list[tuple[str, float]]:
        """What is not met where the upper boxes are lifted so far, and the highest is then ``deeper`` in the one below."""
        scalars = {"touching_pressure": max(pressures)}
        scalars |= {law.pressure_name: one for law, one in zip(laws, pressures, strict=True)}
        frames = [
            Frame(float(i), points=mesh.points + lift * upper - deeper * highest, scalars=scalars)
            for i, lift in enumerate(lifts)
        ]
        return [(check.name, check.frame) for check in of_body(body, collected(frames, CONVERGED)) if not check.met]

    assert wrong(0.0, 0.05, 0.1) == []  # as removed: 0.1 mm at rest, half of it, none
    assert wrong(0.0, 0.0, 0.0) == [("low_z1 in mid_z0", 2.0)]
    assert wrong(0.1, 0.1, 0.1, deeper=0.1, pressures=(0.0, 0.2)) == []
    assert wrong(0.1, 0.1, 0.1, deeper=0.1, pressures=(0.2, 0.0)) == [("mid_z1 in top_z0", 0.0)]
