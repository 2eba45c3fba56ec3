"""Rods with volume: what a straight rod does when it is stretched, turned and twisted, and what a bundle of them keeps."""

from dataclasses import replace

import numpy as np
import pytest
import shapes
from numpy.testing import assert_allclose

from fem_reference.foundations.errors import InputError
from fem_reference.foundations.mesh import Polylines, Surface, enclosed_volume
from fem_reference.foundations.motion import RigidMotion, apply
from fem_reference.geometry.rigid_bodies import Sphere
from fem_reference.problems.muscle import MuscleProblem
from fem_reference.problems.setup import AttachedVertices, Bone
from fem_reference.solvers import viper
from fem_reference.solvers.viper_kernels import turned, volumes

LENGTH = 30.0
SWING = RigidMotion((1, 0, 0), (5, 5, -10), (0.0, 10.0), (0.0, 0.5))
TWIST = RigidMotion((0, 0, 1), (5, 5, 0), (0.0, 10.0), (0.0, 1.0))
PULL = RigidMotion((0, 0, 1), None, (0.0, 10.0), (0.0, 0.21 * LENGTH))
USUAL = {"points": 9, "iterations": 20, "stretch": 1.0, "bending": 0.5, "volume": 1.0, "bundle": 0.5}


def bar(low=None, high=SWING, rods=1, last=10) -> MuscleProblem:
    """A bar of 10 by 10 by 30 mm whose ends are attached, with one fibre in its middle or four by four."""
    given = shapes.bar((2, 2, 4), (10, 10, LENGTH), {"bottom": low, "top": high}, (), tuple(range(last + 1)))
    if rods == 1:
        return given
    grid = np.linspace(1.0, 9.0, 4)
    lines = [np.column_stack([np.full(5, x), np.full(5, y), np.linspace(0, LENGTH, 5)]) for x in grid for y in grid]
    return replace(given, fibres=Polylines(np.concatenate(lines), np.arange(17) * 5))


def solved(given: MuscleProblem, **changes) -> tuple[viper.Rods, list]:
    """The rods at the last frame, and all frames."""
    model = viper.Rods(given, viper.ViperSettings(**(USUAL | changes)))
    frames = [model.frame(0)]
    for number in given.frames[1:]:
        model.move(number)
        frames.append(model.frame(number))
    return model, frames


@pytest.mark.slow
def test_a_rod_stretched_by_s_has_its_radius_over_the_root_of_s() -> None:
    model, frames = solved(bar(high=PULL), iterations=400)
    # The volume pi r^2 l is that of rest, with l 1.21 times as long in every segment.
    assert_allclose(model.radii, model.radius / 1.1, rtol=1e-6)
    assert_allclose(np.diff(model.rods[..., 2], axis=1), 1.21 * LENGTH / 8, rtol=1e-6)
    assert frames[-1].scalars["rod_volume_min"] == pytest.approx(1, abs=1e-9)
    # Half way between two rods' points the surface is as much nearer to the rod.
    middle = np.flatnonzero(np.isclose(model.problem.surface.points[:, 2], LENGTH / 2))
    assert_allclose(frames[-1].surface[middle, :2] - 5, (model.problem.surface.points[middle, :2] - 5) / 1.1, atol=1e-5)


def test_without_the_volume_it_keeps_its_radius() -> None:
    model, frames = solved(bar(high=PULL), volume=0.0)
    assert_allclose(model.radii, model.radius, rtol=1e-12)
    assert frames[-1].scalars["rod_volume_max"] == pytest.approx(1.21, abs=0.05)


@pytest.mark.parametrize("rods", [1, 16])
def test_rods_have_the_volume_of_the_muscle(rods) -> None:
    given = bar(rods=rods)
    model = viper.Rods(given, viper.ViperSettings(**USUAL))
    inside = enclosed_volume(given.surface.points, given.surface.triangles)
    assert volumes(model.rods, model.radii).sum() == pytest.approx(inside, rel=1e-12)
    assert inside == pytest.approx(3000)


@pytest.mark.parametrize("rods", [1, 16])
def test_a_muscle_whose_bones_move_alike_moves_with_them(rods) -> None:
    given = bar(SWING, SWING, rods)
    _, frames = solved(given)
    assert_allclose(frames[-1].surface, apply(SWING.pose(10), given.surface.points), atol=1e-9)
    assert_allclose(frames[-1].fibres, apply(SWING.pose(10), given.fibres.points), atol=1e-9)


@pytest.mark.slow
def test_a_twisted_rod_turns_evenly_along_its_length() -> None:
    model, _ = solved(bar(high=TWIST), iterations=400)
    angles = 2 * np.arctan2(model.turns[0, :, 3], model.turns[0, :, 0])
    # Eight segments between bones turned by 0 and 1 rad: the torque is the same everywhere.
    assert_allclose(angles, np.linspace(0, 1, 10), atol=1e-6)
    assert_allclose(model.rods[0, :, :2], 5, atol=1e-9)


def test_without_bending_frames_follow_their_segments_alone() -> None:
    """A negative control: what turns its neighbours is the constraint of bends and twists."""
    given = bar(high=TWIST)
    model = viper.Rods(given, viper.ViperSettings(**(USUAL | {"bending": 0.0})))
    model.turns[0, 3] = [np.cos(0.2), 0, 0, np.sin(0.2)]
    before = model.turns.copy()
    model._sweep()
    assert_allclose(model.turns, before, atol=1e-12)
    model.settings = viper.ViperSettings(**USUAL)
    model._sweep()
    assert np.abs(model.turns - before).max() > 0.01


@pytest.mark.slow
def test_a_bent_rod_is_symmetric() -> None:
    """Both ends turned in opposite directions about the middle of the rod, which is in the plane of symmetry."""
    one, other = (RigidMotion((1, 0, 0), (5, 5, z), (0.0, 10.0), (0.0, turn)) for z, turn in ((0, 0.4), (LENGTH, -0.4)))
    model, _ = solved(bar(one, other), iterations=400)
    points = model.rods[0] - [5, 5, LENGTH / 2]
    assert_allclose(points[::-1] * [1, 1, -1], points, atol=1e-6)
    assert abs(points[4, 1]) > 0.5
    tangents = turned(model.turns[0, 1:-1], np.tile([0.0, 0.0, 1.0], (8, 1)))
    assert_allclose(tangents[::-1] * [1, -1, 1], tangents, atol=1e-6)


@pytest.mark.slow
def test_a_bundle_gets_thinner_as_its_rods_do() -> None:
    wide = {}
    for bundle in (0.0, 1.0):
        model, _ = solved(bar(high=PULL, rods=16), iterations=100, bundle=bundle)
        wide[bundle] = np.ptp(model.rods[:, 4, 0])
        assert_allclose(volumes(model.rods, model.radii), model.volumes, rtol=0.05)
    assert wide[0.0] == pytest.approx(8)
    # Its ends are as wide as at rest, so that sections between them are stretched a little more than the whole.
    assert wide[1.0] == pytest.approx(8 / 1.1, rel=0.01)


def scene(given: MuscleProblem, pose: np.ndarray, scale: float, order: np.ndarray, rods: np.ndarray) -> MuscleProblem:
    """The same scene turned, scaled, and with vertices and fibres in another order."""

    def placed(points: np.ndarray) -> np.ndarray:
        return apply(pose, scale * points)

    class Turned:
        """The motion of a bone as this scene sees it."""

        def __init__(self, motion: RigidMotion) -> None:
            self.motion = motion

        def pose(self, frame: float) -> np.ndarray:
            found = self.motion.pose(frame).copy()
            found[:3, 3] *= scale
            return pose @ found @ np.linalg.inv(pose)

    back = np.argsort(order)
    surface = Surface(placed(given.surface.points[order]), back[given.surface.triangles])
    bones = tuple(replace(bone, motion=None if bone.motion is None else Turned(bone.motion)) for bone in given.bones)
    by_name = {bone.name: bone for bone in bones}
    attached = tuple(
        AttachedVertices(one.attachment, by_name[one.bone.name], np.sort(back[one.vertices])) for one in given.attached
    )
    lines = np.split(placed(given.fibres.points), given.fibres.offsets[1:-1])
    fibres = Polylines(np.concatenate([lines[i] for i in rods]), given.fibres.offsets)
    return replace(given, surface=surface, bones=bones, attached=attached, fibres=fibres)


@pytest.mark.slow
def test_a_scene_turned_scaled_and_renumbered_has_the_same_answer() -> None:
    given, random = bar(rods=16), np.random.default_rng(4)
    order, rods = random.permutation(len(given.surface.points)), random.permutation(16)
    pose = RigidMotion((1, 2, 3), (5, -4, 7), (0.0, 1.0), (0.0, 2.0)).pose(1)
    (_, frames), (_, again) = solved(given), solved(scene(given, pose, 3.0, order, rods))
    # Rods on a grid are as near to several others, which have no share: rounding changes who they are.
    assert_allclose(again[-1].surface, apply(pose, 3 * frames[-1].surface[order]), atol=1e-6)
    assert np.abs(frames[-1].surface - given.surface.points).max() > 5


@pytest.mark.slow
def test_bones_are_avoided() -> None:
    """A ball of 6 mm comes 9 mm from far away towards the middle of the bar."""
    ball, place = shapes.sphere(2, 6.0), np.array([25.0, 5.0, 15.0])
    coming = RigidMotion((-1, 0, 0), None, (0.0, 10.0), (0.0, 12.0))
    bone = Bone("ball", ball.moved_to(ball.points + place), coming, solid=Sphere((25.0, 5.0, 15.0), 6.0))
    given = bar(None, None, 16)
    given = replace(given, bones=(*given.bones, bone))
    # The bones of the ends have no inside; only their motion counts here.
    far = Sphere((500.0, 0.0, 0.0), 1.0)
    given = replace(given, bones=tuple(replace(one, solid=one.solid or far) for one in given.bones))
    depths = [
        6 - np.linalg.norm(solved(given, contact=contact)[1][-1].surface - (place - [12, 0, 0]), axis=1).min()
        for contact in (True, False)
    ]
    assert depths[0] < 1e-6
    assert depths[1] > 2


def test_a_muscle_without_attachments_is_refused() -> None:
    given = replace(bar(), attached=())
    with pytest.raises(InputError, match="without attachments"):
        viper.solve(given, viper.ViperSettings(**USUAL), list[object]().append)


def test_a_start_at_one_point_is_no_exception_and_neither_is_what_is_no_number() -> None:
    given = replace(bar(), start=lambda rest: np.tile(rest.mean(axis=0), (len(rest), 1)))
    outcome = viper.solve(given, viper.ViperSettings(**USUAL), list[object]().append)
    assert outcome.status == "converged"
    model, number = viper.Rods(bar(), viper.ViperSettings(**USUAL)), 1
    model.rods[0, 3] = np.nan
    model.move(number)
    found = model.trouble()
    assert found is not None
    assert found.status == "diverged"
