"""Forces and moments at the joint: statics by hand, virtual work, and what has no force."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import shapes
import small
from numpy.testing import assert_allclose
from scipy.integrate import simpson
from scipy.interpolate import CubicSpline
from scipy.spatial.transform import Rotation as Turn

from fem_reference.foundations.errors import InputError
from fem_reference.foundations.mesh import Floats, Polylines, Surface, tet_volumes
from fem_reference.foundations.motion import RigidMotion
from fem_reference.io import files
from fem_reference.metrics import MeasurementContext, at_rest, change, context_of, find, measure
from fem_reference.metrics.fibre_length import both_lengths
from fem_reference.metrics.moment_arm import excursion_arms
from fem_reference.problems.of_case import setup
from fem_reference.problems.setup import Bone, Joint
from fem_reference.runs import results
from fem_reference.runs.contents import vector_scalars
from fem_reference.runs.store import Outcome, Run
from fem_reference.scenes.case import Case
from fem_reference.studies import workflow
from tests.metrics import test_moment_arm as lines
from validation.fibre_laws import FibrePassive

BALL = Surface(
    np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]]), np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]])
)
FORCES = np.array([[0.0, 0, 0], [0, 3, 4], [0, 6, 8]])
POINT, CENTRE, AXIS = np.array([7.0, 10, 0]), np.array([1.0, 2, 0]), np.array([1.0, 0, 0])


def scalars_of(forces: Floats, places: Floats = POINT) -> dict[str, Floats]:
    """What a run has of ``forces`` (f, 3) on the femur at ``places``."""
    kinds = {"force": forces, "moment": np.cross(places, forces)}
    return {
        name: np.array(values)
        for kind, vectors in kinds.items()
        for name, values in zip(vector_scalars(f"{kind}_on_femur", np.zeros(3)), vectors.T, strict=True)
    }


def pulled(forces: np.ndarray = FORCES) -> Run:
    """A run whose muscle pulls the femur at ``POINT``."""
    fibres = Polylines(np.array([[0.0, 0, 0], [0, 0, 9]]), np.array([0, 2]))
    moved = np.broadcast_to(fibres.points, (3, 2, 3))
    still = np.broadcast_to(BALL.points, (3, 4, 3))
    return Run("run", "fenicsx", Outcome("converged", ""), (0, 1, 2), BALL, still, fibres, moved, scalars_of(forces))


def context(run: Run, angles: tuple[float, ...] = (0.0, 0.1, 0.2)) -> MeasurementContext:
    motion = RigidMotion((1, 0, 0), (1, 2, 0), (0.0, 1.0, 2.0), angles)
    bone = Bone("femur", BALL, motion)
    joint = Joint("hip", bone, AXIS, CENTRE, lambda frame: float(np.interp(frame, motion.frames, motion.amounts)))
    assert run.fibres is not None
    return MeasurementContext.of(run, run.fibres, (bone,), None, (joint,))


def test_a_moment_is_the_lever_times_the_force() -> None:
    """8 mm along y times 4 N along z, about x; the part along the axis of the lever does nothing."""
    run = pulled()
    moment, force, arm = measure(run, at_rest(run), context(run), ["joint_moment"])
    assert_allclose(moment.values, [0, 32, 64])
    assert_allclose(force.values, [0, 5, 10])
    assert_allclose(arm.values, [np.nan, 32 / 5, 32 / 5])
    assert_allclose(run.force("femur"), FORCES)
    assert_allclose(run.moment("femur", POINT), 0, atol=1e-12)  # its point of application


def test_a_scene_turned_moved_scaled_and_renumbered_has_the_same_moment_force_and_arm() -> None:
    """Forces three times and lengths twice as great: moments six times, arms twice. Vertices and fibres are in another order."""
    run, turn, shift = pulled(), Turn.random(rng=np.random.default_rng(3)), np.array([30.0, -50, 7])
    given, order = context(run), np.array([2, 0, 3, 1])
    scalars = scalars_of(3 * turn.apply(FORCES), 2 * turn.apply(POINT) + shift)
    surface = Surface(2 * turn.apply(BALL.points[order]) + shift, np.argsort(order)[BALL.triangles])
    other = replace(run, surface=surface, positions=np.broadcast_to(surface.points, (3, 4, 3)), scalars=scalars)
    joint = replace(given.joints[0], axis=turn.apply(AXIS), centre=2 * turn.apply(CENTRE) + shift)
    measured = (
        measure(one, at_rest(one), there, ["joint_moment"])
        for one, there in ((run, given), (other, replace(given, joints=(joint,))))
    )
    for one, great, factor in zip(*measured, (6, 3, 2), strict=True):
        assert_allclose(great.values, factor * one.values, rtol=1e-12, atol=1e-12)


def test_differences_and_missing_forces() -> None:
    run, twice = pulled(), pulled(2 * FORCES)
    moment, _, arm = measure(twice, run, context(run), ["joint_moment"])
    assert_allclose(moment.values, [0, 32, 64])
    assert_allclose(arm.values, [np.nan, 0, 0], atol=1e-12)
    assert all((one.values[1:] == 0).all() for one in measure(run, run, context(run), ["joint_moment"]))
    bare = replace(run, scalars={})
    assert measure(bare, run, context(run), ["joint_moment"]) == ()
    assert measure(run, bare, context(run), ["joint_moment"]) == ()  # no deviation from forces that are not known
    with pytest.raises(InputError, match='bone: got "tibia", want one of femur'):
        run.force("tibia")
    with pytest.raises(InputError, match="this run has no forces"):
        bare.force("femur")


def test_a_joint_that_never_turns_has_no_moment() -> None:
    run = pulled()
    found = measure(run, at_rest(run), context(run, (0.0, 0.0, 0.0)), ["joint_moment"])
    assert all(np.isnan(one.values).all() for one in found)


@pytest.fixture(scope="module")
def bar(tmp_path_factory: pytest.TempPathFactory) -> tuple[Run, MeasurementContext]:
    folder = tmp_path_factory.mktemp("work")
    case = workflow.load_case(small.write(folder / "bar"), {"frames.last": 10, "frames.every": 1})
    run = workflow.solve(case, store=folder / "store")
    assert run.outcome.status == "converged", run.outcome.message
    return run, context_of(setup(case), run)


@pytest.mark.slow
def test_virtual_work(bar: tuple[Run, MeasurementContext]) -> None:
    """Without dissipation the moment is minus the slope of the energy, so that its integral over the angle is the energy.

    1 % leaves room for Simpson's rule in steps of 0.04 rad; an axis 1 mm off changes more than 3 %.
    """
    run, given = bar
    moment = find(measure(run, at_rest(run), given, ["joint_moment"]), "joint_moment", "moment")
    assert moment is not None
    angles, energy = given.joints[0].angles(run.numbers), run.scalars["energy"]
    assert_allclose(-simpson(moment.values, angles), energy[-1], rtol=0.01)
    assert moment.values[-1] < 0 < angles[-1]  # the muscle resists
    off = replace(given.joints[0], centre=given.joints[0].centre + [0, 0, 1])
    wrong = find(measure(run, at_rest(run), replace(given, joints=(off,)), ["joint_moment"]), "joint_moment", "moment")
    assert wrong is not None
    assert abs(-simpson(wrong.values, angles) / energy[-1] - 1) > 0.03


def does_the_work_of_its_moment(run: Run, joint: Joint) -> None:
    """The moment is minus the slope of the energy, contact's too, by a cubic spline over 0.1 rad: to 1 % of the greatest moment at
    every angle; the energy is the work of the moment, by Simpson's rule, to 0.5 %.
    """
    angles, energy = joint.angles(run.numbers), run.scalars["energy"]
    moment = run.moment(joint.bone.name, joint.centre) @ joint.axis
    rising = np.argsort(angles)
    slope = CubicSpline(angles[rising], energy[rising])(angles, 1)
    assert_allclose(moment, -slope, rtol=0, atol=0.01 * np.abs(moment).max())
    assert_allclose(-simpson(moment, angles), energy[-1] - energy[0], rtol=0.005)


@pytest.mark.slow
@pytest.mark.nightly
def test_hip_flexion_as_shipped_does_the_work_of_its_moment(tmp_path: Path) -> None:
    case = workflow.load_case("hip_flexion", {"frames.last": 100})
    run = workflow.solve(case, store=tmp_path)
    does_the_work_of_its_moment(run, context_of(setup(case), run).joints[0])


@pytest.mark.slow
def test_fibres_alone_have_the_arm_of_their_excursion_and_the_whole_muscle_has_not(tmp_path: Path) -> None:
    """`hip_flexion` on coarse tetrahedra, where contact is fully made: energies by effect, from the stored unknowns, make up the
    moment to 1 % (virtual work, by parabolas over 0.2 rad, without the little energy of contact).

    The fibres' moment over their tension, its integral over the volume over their mean length, is their excursion, weighted with
    their tensions, where the tension is even along each. It is not quite: 5.5 % here, 2.6 % on tetrahedra of 10 mm and 2.1 % of
    5 mm. Whole moment over whole force is 19 % off: a fifth of the moment is the matrix's, with a tenth of the force.
    """
    changes = {"frames.last": 100, "muscle.refinements": 0, "muscle.tet_size": "15 mm", "reference.store_state": True}
    case = workflow.load_case("hip_flexion", changes)
    run = workflow.solve(case, store=tmp_path / "store")
    assert run.folder is not None
    given, states = context_of(setup(case), run), results.of_run(run.folder, case)
    joint, rest, numbers = given.joints[0], given.fibres.lengths(), run.numbers
    energies = [states.energies(number) for number in numbers]
    moments = {
        name: excursion_arms(np.array([[one[name]] for one in energies]), given, numbers)[:, 0] for name in energies[0]
    }
    moment = run.moment("femur", joint.centre) @ joint.axis
    assert_allclose(sum(moments.values())[7:], moment[7:], rtol=0.01)
    does_the_work_of_its_moment(run, joint)

    law = FibrePassive(0.3, 0.05, 6.6, 1.0, 1.4)
    lengths = both_lengths(run, run, given)[0]
    tensions = np.array([law.slope(stretch) for stretch in lengths[-1] / rest])
    excursion = tensions @ excursion_arms(lengths, given, numbers)[-1] / tensions.sum()
    tets, volumes = np.arange(len(states.mesh.tets)), tet_volumes(states.mesh.points, states.mesh.tets)
    middles = np.full((len(tets), 4), 0.25)
    found = states.evaluate_in(tets, middles, 100, ["fibre_stretch", "det_F"])
    stretches = found["fibre_stretch"] * found["det_F"] ** (-1 / 3)
    tension = volumes @ [law.slope(stretch) for stretch in stretches] / rest.mean()
    assert_allclose(moments["fibre_passive"][-1] / tension, excursion, rtol=0.06)
    # Of all places, not of lines, the excursion that is weighted with tensions gives the fibres' moment: chain rule, by parabolas.
    four, corners = (
        np.repeat(tets, 4),
        np.tile(0.138197 + 0.447214 * np.eye(4), (len(tets), 1)),
    )  # Gauss points of a tetrahedron
    last = [states.evaluate_in(four, corners, number, ["fibre_stretch", "det_F"]) for number in numbers[-3:]]
    everywhere = np.array([one["fibre_stretch"] * one["det_F"] ** (-1 / 3) for one in last])
    pull = np.repeat(volumes / 4, 4) * [law.slope(stretch) for stretch in everywhere[-1]]
    arms = excursion_arms(everywhere, given, numbers[-3:])[-1]
    assert_allclose(pull @ arms, moments["fibre_passive"][-1], rtol=0.01)
    assert force_arms(run, given)[-1] > 1.15 * excursion
    assert moments["fibre_passive"][-1] < 0.85 * moment[-1]
    assert tension > 0.87 * np.linalg.norm(run.force("femur")[-1])


@pytest.mark.slow
def test_forces_on_all_bones_balance(bar: tuple[Run, MeasurementContext]) -> None:
    run, _ = bar
    forces = {name: run.force(name) for name in ("floor", "lid")}
    greatest = np.abs(forces["lid"]).max()
    assert greatest > 0.01
    assert_allclose(forces["floor"] + forces["lid"], 0, atol=1e-6 * greatest)
    moments = run.moment("floor") + run.moment("lid")
    assert_allclose(moments, 0, atol=1e-6 * np.abs(run.moment("lid")).max())


def test_a_case_without_a_joint_has_no_moment() -> None:
    run = pulled()
    assert measure(run, at_rest(run), replace(context(run), joints=()), ["joint_moment"]) == ()


def force_arms(run: Run, given: MeasurementContext) -> Floats:
    """The arm (f,) [mm] of the force on the bone of a joint, as the metric measures it from rest."""
    arm = find(measure(run, at_rest(run), given, ["joint_moment"]), "joint_moment", "arm")
    assert arm is not None
    return arm.values


def test_the_force_arm_of_a_straight_bar_is_its_excursion_arm() -> None:
    """A line pulls the bone that turns straight towards a fixed point: 0.1 % with a degree between frames, as excursion has it."""
    joint = lines.joint_of(np.radians(np.arange(40)))
    run = lines.straight(joint, 40)
    assert run.fibre_positions is not None
    for fibre in (0, 1):
        start, end = (run.fibre_positions[:, 2 * fibre + i] for i in (0, 1))
        away = np.linalg.norm(start - end, axis=1)[:, None]
        pull = (start - end) / away * (away - 10)  # a law of the length
        pulling = replace(run, scalars=scalars_of(pull, end))
        arms = lines.arms_of(run, lines.context_of(joint, run))[:, fibre]
        assert_allclose(force_arms(pulling, lines.context_of(joint, run)), arms, rtol=1e-3)
        off = replace(joint, centre=joint.centre + [0, 1, 0])
        assert np.abs(force_arms(pulling, lines.context_of(off, run)) / arms - 1).max() > 0.01


@pytest.mark.slow
def test_a_greater_scene_has_forces_and_moments_to_scale(tmp_path: Path) -> None:
    """No law has a length: all lengths ten times give arms ten times, forces 100 times and moments 1000 times.

    Of a box, whose tetrahedra do not depend on its size. The solver ends at a residual of 1e-4, its square in what follows.
    """
    found = []
    for unit in ("mm", "cm"):
        folder = small.write(tmp_path / unit)
        box = shapes.skin(shapes.box((4, 4, 12), (10, 10, 40)))
        files.write_surface(folder / "bar.vtp", box, box.points)
        scene = (folder / "case.toml").read_text().replace('mm"', f'{unit}"')
        (folder / "case.toml").write_text(scene.replace("tet_size", 'mesher = "block"\ntet_size'))
        case = workflow.load_case(folder, {"frames.last": 10, "frames.every": 5})
        run = workflow.solve(case, store=folder / "store")
        given = context_of(setup(case), run)
        moment, force, arm = measure(run, at_rest(run), given, ["joint_moment"])
        found.append((arm.values[1:], force.values[1:], moment.values[1:], run.force("lid")[1:]))
    for less, great, power in zip(*found, (1, 2, 3, 2), strict=True):
        assert np.abs(less).max() > 0.01
        assert_allclose(great, 10**power * less, rtol=1e-6, atol=1e-9 * 10**power)


@pytest.fixture(scope="module")
def thread(tmp_path_factory: pytest.TempPathFactory) -> tuple[Case, Run, MeasurementContext]:
    """A bar of 2 x 2 x 40 mm, stiff fibres in a soft matrix, drawn out by a plate that turns by 0.1 rad, 40 mm from its axis."""
    folder = small.write(tmp_path_factory.mktemp("work") / "thread")
    skin = shapes.skin(shapes.box((2, 2, 20), (2, 2, 40)))
    files.write_surface(folder / "bar.vtp", skin, skin.points + [4, 4, 0])
    line = Polylines(np.linspace([5.0, 5, 0], [5, 5, 40], 9), np.array([0, 9]))
    files.write_polylines(folder / "line.vtp", line, line.points)
    scene = (folder / "case.toml").read_text()
    for old, new in (
        ('"5.0, 5.0, 30.0 mm"', '"5.0, 45.0, 20.0 mm"'),
        ("0.4 rad", "-0.1 rad"),
        ("10 kPa", "0.1 kPa"),
        ("10 MPa", "0.1 MPa"),
        ("\n[fibres]", small.FIBRES.format(slack=1.0).replace("0.05", "0.5") + "\n[fibres]"),
        ("tet_size", 'mesher = "block"\ntet_size'),
        (
            'traced = { count = 4, start = "origin", end = "insertion" }',
            'polylines = { file = "line.vtp", unit = "mm" }',
        ),
    ):
        assert old in scene
        scene = scene.replace(old, new)
    (folder / "case.toml").write_text(scene)
    case = workflow.load_case(folder, {"frames.last": 10, "frames.every": 1, "muscle.tet_size": "1 mm"})
    run = workflow.solve(case, store=folder / "store")
    assert run.outcome.status == "converged", run.outcome.message
    return case, run, context_of(setup(case), run)


def straight_arms(angle: float, beside: Floats) -> tuple[Floats, Floats]:
    """Arms [mm] and stretches of straight lines of 40 mm between the plates of ``thread``, so far ``beside`` its middle [mm]."""
    start = np.array([[0, -40 + y, -20] for y in beside])
    end = Turn.from_rotvec([angle, 0, 0]).apply(start + [0, 0, 40])
    away = np.linalg.norm(start - end, axis=1)
    return np.cross(end, start - end)[:, 0] / away, away / 40


@pytest.mark.slow
def test_a_muscle_that_is_nearly_a_line_has_one_arm_by_force_and_by_excursion(
    thread: tuple[Case, Run, MeasurementContext], tmp_path: Path
) -> None:
    """By excursion that of the straight line in its middle; by force the mean over straight lines across the bar, weighted with
    their tensions, which is 0.01 mm greater: both to their error bars and 0.0005 mm. What the matrix of 0.1 kPa bears is half of
    that: ten times the matrix bears ten times as much, 0.0022 mm.
    """
    case, run, given = thread
    bars = workflow.error_bars(case, run, store=tmp_path / "store")
    assert bars is not None
    angles, law = given.joints[0].angles(run.numbers)[1:], FibrePassive(0.3, 0.5, 6.6, 1.0, 1.4)
    across = [straight_arms(angle, np.linspace(-0.99, 0.99, 100)) for angle in angles]
    tensions = [[law.slope(stretch) for stretch in stretches] for _, stretches in across]
    known = {
        ("moment_arm", "mean"): [straight_arms(angle, np.zeros(1))[0][0] for angle in angles],
        ("joint_moment", "arm"): [
            np.average(arms, weights=pull) for (arms, _), pull in zip(across, tensions, strict=True)
        ],
    }
    for name, arms in known.items():
        found, bar = find(change(run, given, [name[0]]), *name), bars.find("change", *name)
        assert found is not None
        assert bar is not None
        assert (bar.values[1:] < 0.001).all()
        assert (np.abs(found.values[1:] - arms) <= bar.values[1:] + 5e-4).all(), name
        assert_allclose(found.values[1:], known["moment_arm", "mean"], rtol=1e-3)


@pytest.mark.slow
def test_a_muscle_that_is_nearly_a_line_does_the_work_of_its_moment(
    thread: tuple[Case, Run, MeasurementContext],
) -> None:
    """The moment is minus the slope of the energy in the angle to 1 % at every angle; differences over 0.02 rad."""
    _, run, given = thread
    joint = given.joints[0]
    angles, energy = joint.angles(run.numbers), run.scalars["energy"]
    moment = run.moment("lid", joint.centre) @ joint.axis
    assert_allclose(moment[1:-1], -(energy[2:] - energy[:-2]) / (angles[2:] - angles[:-2]), rtol=0.01)
