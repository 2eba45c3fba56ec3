"""Moment arms by excursion: closed forms of straight lines and of lines around cylinders and spheres, and their invariances."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.spatial.transform import Rotation as Turn

from fem_reference.foundations.mesh import Floats, Polylines, Surface
from fem_reference.foundations.motion import RigidMotion, apply
from fem_reference.geometry.obstacles import Quadric
from fem_reference.geometry.wrapping import around
from fem_reference.metrics import MeasurementContext, at_rest, measure
from fem_reference.metrics.moment_arm import excursion_arms, turning
from fem_reference.problems.setup import Bone, Joint
from fem_reference.runs.store import Outcome, Run

BALL = Surface(
    np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]]), np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]])
)
FIXED, MOVING = np.array([[0.0, 60, 5], [0, 50, -5]]), np.array([[45.0, 0, 5], [30, 0, -5]])


def joint_of(angles: Floats, axis: tuple[float, float, float] = (0, 0, 1), centre: Floats | None = None) -> Joint:
    """A hinge whose bone is at each of ``angles`` [rad] at frame 0, 1, ..."""
    at = np.zeros(3) if centre is None else centre
    motion = RigidMotion(axis, tuple(at), tuple(map(float, range(len(angles)))), tuple(angles))
    bone = Bone("femur", BALL, motion)
    return Joint("hip", bone, np.array(axis), at, lambda frame: float(np.interp(frame, motion.frames, motion.amounts)))


def context_of(joint: Joint, run: Run, bones: tuple[Bone, ...] = ()) -> MeasurementContext:
    assert run.fibres is not None
    return MeasurementContext.of(run, run.fibres, (joint.bone, *bones), None, (joint,))


def straight(joint: Joint, count: int) -> Run:
    """Two straight fibres from fixed points to points of the bone."""
    ends = [apply(joint.bone.pose(frame), MOVING) for frame in range(count)]
    lines = np.array([np.stack([FIXED, end], axis=1).reshape(-1, 3) for end in ends])
    return Run(
        name="straight",
        solver="recorded",
        outcome=Outcome("converged", ""),
        numbers=tuple(range(count)),
        surface=BALL,
        positions=np.broadcast_to(BALL.points, (count, *BALL.points.shape)),
        fibres=Polylines(lines[0], np.array([0, 2, 4])),
        fibre_positions=lines,
    )


def arms_of(run: Run, context: MeasurementContext) -> Floats:
    assert run.fibre_positions is not None
    lengths = np.array([context.fibres.lengths(points) for points in run.fibre_positions])
    return excursion_arms(lengths, context, run.numbers)


def known(joint: Joint, frames: int) -> Floats:
    """The arm of a straight line: the axis' component of the moment of its unit pull on the moving bone."""
    ends = np.array([apply(joint.bone.pose(frame), MOVING) for frame in range(frames)])
    pull = (FIXED - ends) / np.linalg.norm(FIXED - ends, axis=2)[..., None]
    return np.cross(ends - joint.centre, pull) @ joint.axis


def test_a_straight_line_around_a_hinge_has_its_distance_from_the_axis() -> None:
    """0.1 % with a degree between frames: the parabola is off by ``l''' h^2 / 6`` inside and ``/ 3`` at the ends."""
    joint = joint_of(np.radians(np.arange(60)))
    run = straight(joint, 60)
    found, truth = arms_of(run, context_of(joint, run)), known(joint, 60)
    assert_allclose(found, truth, rtol=1e-3)
    assert truth.min() > 10  # the arm is positive where the line shortens with a growing angle


def test_the_error_is_of_second_order_in_the_angle() -> None:
    errors = []
    for step in (4, 2):
        joint = joint_of(np.radians(np.arange(0, 61, step)))
        run = straight(joint, 60 // step + 1)
        off = np.abs(arms_of(run, context_of(joint, run)) - known(joint, 60 // step + 1))
        errors.append(off[[0, len(off) // 2, -1]].max(axis=1))
    assert_allclose(np.array(errors[0]) / errors[1], 4, rtol=0.15)


@pytest.mark.parametrize("obstacle", ["cylinder", "sphere"])
def test_a_line_around_an_obstacle_has_the_radius_of_that_obstacle(obstacle: str) -> None:
    """In the plane across the axis the path's length is linear in the angle while it wraps: the slope is exact."""
    radius, joint = 20.0, joint_of(np.radians(np.linspace(0, 20, 9)))
    quadric = Quadric(np.eye(4), np.array([radius, radius, radius if obstacle == "sphere" else np.inf]))
    starts, end = np.array([[-50.0, -10, 0]]), np.array([[50.0, -10, 0]])
    lengths = np.array([around(quadric, starts, apply(joint.bone.pose(i), end)).lengths for i in range(9)])
    run = straight(joint, 9)
    assert_allclose(np.abs(excursion_arms(lengths, context_of(joint, run), run.numbers)), radius, rtol=1e-6)


def test_the_other_way_round_the_sign_changes_and_nothing_else() -> None:
    joint = joint_of(np.radians(np.arange(0, 40, 2)))
    against = replace(joint, axis=-joint.axis, angle_of=lambda frame: -joint.angle_of(frame))
    run = straight(joint, 20)
    assert_allclose(arms_of(run, context_of(against, run)), -arms_of(run, context_of(joint, run)), rtol=1e-12)


def test_arms_turn_scale_and_reorder_with_the_scene() -> None:
    joint = joint_of(np.radians(np.arange(0, 40, 4)))
    run = straight(joint, 10)
    arms = arms_of(run, context_of(joint, run))
    turn, shift, factor = Turn.random(rng=np.random.default_rng(3)).as_matrix(), np.array([30.0, -50, 7]), 2.5
    turned = joint_of(np.radians(np.arange(0, 40, 4)), tuple(turn @ joint.axis), shift)
    assert run.fibre_positions is not None
    moved = factor * run.fibre_positions @ turn.T + shift
    swapped = moved[:, [2, 3, 0, 1]]
    other = replace(run, fibre_positions=swapped, fibres=Polylines(swapped[0], np.array([0, 2, 4])))
    assert_allclose(arms_of(other, context_of(turned, other)), factor * arms[:, ::-1], rtol=1e-9)


def test_there_and_back_and_at_rest() -> None:
    """The turning point has the slope of one side, and a joint that rests afterwards that of the frames before."""
    angles = np.radians([0, 4, 8, 12, 8, 4, 0, 0, 0])
    joint = joint_of(angles)
    run = straight(joint, len(angles))
    found, truth = arms_of(run, context_of(joint, run)), known(joint, len(angles))
    assert_allclose(found, truth, rtol=4e-3)
    assert_allclose(found[-3:], found[[0, 0, 0]], rtol=1e-12)


def test_where_two_bones_move_there_is_no_arm() -> None:
    joint = joint_of(np.radians([0, 4, 8, 12]))
    other = Bone("pelvis", BALL, RigidMotion((1, 0, 0), (0, 0, 0), (2.0, 3.0), (0.0, 0.1)))
    run = straight(joint, 4)
    arms = arms_of(run, context_of(joint, run, (other,)))
    assert np.isnan(arms).all(axis=1).tolist() == [False, False, True, True]


def test_a_joint_that_never_turns_has_no_arm_and_never_passes() -> None:
    joint = joint_of(np.zeros(3))
    run = straight(joint, 3)
    context = context_of(joint, run)
    assert turning(context.joints, context, run.numbers).tolist() == [-1, -1, -1]
    assert all(np.isnan(one.values).all() for one in measure(run, at_rest(run), context, ["moment_arm"]))


def test_against_itself_zero_and_from_rest_the_arm() -> None:
    joint = joint_of(np.radians(np.arange(0, 20, 2)))
    run = straight(joint, 10)
    context = context_of(joint, run)
    for one in measure(run, run, context, ["moment_arm"]):
        assert_allclose(one.values, 0, atol=1e-12)
    mean, rms, worst, least, greatest = measure(run, at_rest(run), context, ["moment_arm"])
    arms = arms_of(run, context)
    assert_allclose(mean.values, arms.mean(axis=1), rtol=1e-9)
    assert_allclose(rms.values, np.sqrt((arms**2).mean(axis=1)), rtol=1e-9)
    assert_allclose(worst.values, arms.max(axis=1), rtol=1e-9)
    assert_allclose([least.values, greatest.values], np.sort(arms, axis=1).T, rtol=1e-9)  # of two fibres
    assert measure(run, run, replace(context, joints=()), ["moment_arm"]) == ()


def test_where_a_joint_turns_back_the_way_there_says_nothing() -> None:
    """A muscle that is longer on the way back, by 2 mm, as a viscous one: its arm there is that of the way back alone."""
    angles = np.array([0.0, 0.5, 0.1])
    joint = joint_of(angles)
    run = straight(joint, 3)
    lengths = np.array([[30.0], [28.0], [31.0]])
    arms = excursion_arms(lengths, context_of(joint, run), run.numbers)[:, 0]
    assert_allclose(arms, [4.0, 4.0, 7.5], rtol=1e-12)


def test_lines_alone_have_arms_beside_a_reference_whose_overlaps_were_removed_at_rest() -> None:
    """Its fibres begin 0.1 mm away from those of the lines, which have no surface that could carry them."""
    joint = joint_of(np.radians(np.arange(0, 40, 4)))
    run = straight(joint, 10)
    lines = replace(run, has_surface=False, positions=np.full_like(run.positions, np.nan))
    context = replace(context_of(joint, run), fibres=Polylines(run.fibres.points + 0.1, run.fibres.offsets))
    (mean,) = (one for one in measure(lines, at_rest(lines), context, ["moment_arm"]) if one.statistic == "mean")
    assert_allclose(mean.values, arms_of(run, context_of(joint, run)).mean(axis=1), rtol=1e-12)
