"""Position based dynamics: the constraints of a surface, the step, and the solver."""

import math

import numpy as np
import pytest
import shapes

from fem_reference.foundations.errors import InputError
from fem_reference.foundations.mesh import Polylines, Surface, check_closed, enclosed_volume
from fem_reference.foundations.motion import RigidMotion, apply
from fem_reference.foundations.records import parse
from fem_reference.geometry.rigid_bodies import Sphere
from fem_reference.geometry.signed_distance import build
from fem_reference.problems.muscle import MuscleProblem
from fem_reference.problems.setup import AttachedVertices, Bone, Setup
from fem_reference.solvers import pbd

USUAL = {
    "sub_iterations": 3,
    "solver_iterations": 1,
    "damping": 0.01,
    "stretch": 1.0,
    "volume": 1.0,
    "bending": 0.9,
}
SETTINGS = pbd.PbdSettings(**USUAL)
TURN = RigidMotion((1, 2, 3), (5, -4, 7), (0.0, 1.0), (0.0, 2.0)).pose(1)
CONTACT = {"gap": "0 mm", "stiffness": 1.0}
SWING = RigidMotion((1, 0, 0), (0, 20, -10), (0.0, 50.0), (0.0, 0.5))


def spindle():
    """A closed surface like a muscle, 20 mm by 60 mm in z: rings of 12 vertices, turned by half a step each."""
    ring, step = np.divmod(np.arange(11 * 12), 12)
    along, around = np.pi * (ring + 1) / 12, np.pi * (2 * step + ring) / 12
    sides = np.column_stack(
        [10 * np.sin(along) * np.cos(around), 10 * np.sin(along) * np.sin(around), -30 * np.cos(along)]
    )
    following = 12 * ring + (step + 1) % 12
    lower, upper = np.arange(10 * 12), np.arange(12, 11 * 12)
    pole = np.full(12, 132)
    triangles = [
        (lower, following[lower], upper),
        (following[lower], following[upper], upper),
        (pole, following[:12], np.arange(12)),
        (pole + 1, np.arange(120, 132), following[120:]),
    ]
    points = np.vstack([sides, [0, 0, -30], [0, 0, 30]])
    return check_closed(Surface(points, np.hstack(triangles).T))


def attached_setup(low, high, last=10, every=1, pose=None):
    """The spindle with its ends, a fifth of its half length each, attached by bones that move by ``low`` and ``high``."""
    surface = spindle()
    z = surface.points[:, 2]
    ends = np.flatnonzero(z < -24), np.flatnonzero(z > 24)
    if pose is not None:
        surface = surface.moved_to(apply(pose, surface.points))
    bones = tuple(Bone(name, surface, motion) for name, motion in (("low", low), ("high", high)))
    attached = tuple(AttachedVertices(bone.name, bone, vertices) for bone, vertices in zip(bones, ends, strict=True))
    return Setup(surface, bones, attached, tuple(range(0, last + 1, every)), interval=None)


def run(setup, **changes):
    """The outcome with the usual settings but for ``changes``, and the positions by frame number."""
    frames = []
    outcome = pbd.solve(setup, pbd.PbdSettings(**USUAL | changes), frames.append)
    return outcome, {frame.number: frame.surface for frame in frames}


def test_hinges_are_the_edges_and_the_vertices_opposite():
    triangles = spindle().triangles
    hinges = pbd.hinges_of(triangles)
    sides = np.sort(np.vstack([hinges[:, [0, 1, 2]], hinges[:, [0, 1, 3]]]), axis=1)
    assert sorted(sides.tolist()) == sorted(3 * np.sort(triangles, axis=1).tolist())
    assert len(np.unique(hinges[:, :2], axis=0)) == len(hinges) == 3 * 12 * 11


def test_free_flight_is_damped():
    # With every stiffness 0 a step loses its share of velocity and moves on: dx_n = (1 - damping)^n dx_0.
    surface = spindle()
    rest = pbd.PbdConstraints.at_rest(surface.points, surface.triangles, [])
    settings = pbd.PbdSettings(**USUAL | {"damping": 0.25, "stretch": 0, "volume": 0, "bending": 0})
    points, displacement = np.array(surface.points), np.full(surface.points.shape, 2.0)
    for _ in range(5):
        points, displacement = pbd.advance(points, displacement, rest, settings)
    np.testing.assert_allclose(displacement, 2 * 0.75**5, rtol=1e-12)  # a difference of coordinates of 30 mm
    np.testing.assert_allclose(points - surface.points, 2 * sum(0.75**n for n in range(1, 6)), rtol=1e-12)


def test_a_turned_rest_state_stays_put():
    surface = spindle()
    turned = apply(TURN, surface.points)
    rest = pbd.PbdConstraints.at_rest(surface.points, surface.triangles, [])
    points, displacement = turned.copy(), np.zeros(turned.shape)
    for _ in range(100):
        points, displacement = pbd.advance(points, displacement, rest, SETTINGS)
    np.testing.assert_allclose(points, turned, atol=1e-10)  # roundings of 1e-13 that drift for 100 steps


def test_rest_stays_at_rest():
    _, frames = run(attached_setup(None, None))
    assert list(frames) == list(range(11))
    for surface in frames.values():
        np.testing.assert_allclose(surface, spindle().points, rtol=0, atol=1e-12)


def test_a_body_attached_by_nothing_stays_at_rest():
    setup = attached_setup(None, None)
    outcome, positions = run(Setup(setup.surface, setup.bones, (), setup.frames, None))
    assert outcome.status == "converged"
    assert np.abs(positions[10] - setup.surface.points).max() < 1e-9


def test_bones_that_move_as_one_carry_the_body_along():
    # A closed surface that keeps its edges and angles is rigid, so that what is left once the bones rest is what
    # damping has not yet taken: with a tenth of the velocity lost in each of 300 steps, below a thousandth of 60 mm.
    setup = attached_setup(SWING, SWING, last=150)
    outcome, frames = run(setup, damping=0.1)
    assert outcome.status == "converged"
    expected = apply(SWING.pose(150), setup.surface.points)
    assert np.linalg.norm(expected - setup.surface.points, axis=1).max() > 10
    np.testing.assert_allclose(frames[150], expected, atol=0.06)


def test_attached_vertices_go_with_their_bone():
    setup = attached_setup(None, SWING)
    _, frames = run(setup)
    for number, surface in frames.items():
        for attached in setup.attached:
            expected = apply(attached.bone.pose(number), setup.surface.points[attached.vertices])
            np.testing.assert_array_equal(surface[attached.vertices], expected)


def test_independent_of_where_the_world_is():
    # Roundings of 1e-14 in the place of the whole grow over 150 steps; 1e-6 of the size is far below what is looked at.
    x, y, z = TURN[:3, :3] @ SWING.axis
    moved = RigidMotion((x, y, z), tuple(apply(TURN, np.array([SWING.centre]))[0]), SWING.frames, SWING.amounts)
    _, here = run(attached_setup(None, SWING, last=50))
    _, there = run(attached_setup(None, moved, last=50, pose=TURN))
    np.testing.assert_allclose(there[50], apply(TURN, here[50]), atol=60e-6)


def test_the_same_twice():
    first, second = (run(attached_setup(None, SWING))[1][10] for _ in range(2))
    np.testing.assert_array_equal(first, second)


def test_volume_is_kept():
    surface = spindle()
    volume = enclosed_volume(surface.points, surface.triangles)
    kept, lost = (
        enclosed_volume(run(attached_setup(None, SWING, last=50), volume=stiffness)[1][50], surface.triangles) / volume
        for stiffness in (1.0, 0.0)
    )
    assert abs(kept - 1) < 0.02
    assert abs(lost - 1) > 2 * abs(kept - 1)


def ball_against(last, back=None):
    """The spindle attached at its ends, and a ball of 8 mm that gets 10 mm into its side by frame 40, and is gone by ``back``."""
    setup = attached_setup(None, None, last=last)
    frames, distances = ((0.0, 40.0), (0.0, 12.0)) if back is None else ((0.0, 40.0, float(back)), (0.0, 12.0, 0.0))
    ball = Bone(
        "ball", shapes.sphere(0, 8.0), RigidMotion((-1, 0, 0), None, frames, distances), solid=Sphere((20, 0, 0), 8.0)
    )
    return Setup(setup.surface, (ball,), setup.attached, setup.frames, None)


def deepest(setup, frames):
    """How deep a free vertex gets below the surface of a bone, over all frames [mm]."""
    loose = np.setdiff1d(np.arange(len(setup.surface.points)), setup.attached_vertices)
    return max(
        -bone.shape.sample(apply(np.linalg.inv(bone.pose(number)), points[loose])).distance.min()
        for number, points in frames.items()
        for bone in setup.bones
    )


def test_bones_are_obstacles_only_where_it_is_wanted():
    setup = ball_against(40)
    _, through = run(setup)
    outcome, aside = run(setup, collision=CONTACT)
    assert outcome.status == "converged"
    assert deepest(setup, through) > 5
    # The projections of a sweep end with collisions: what is left is rounding.
    assert deepest(setup, aside) < 1e-9
    volumes = [enclosed_volume(aside[number], setup.surface.triangles) for number in (0, 40)]
    assert volumes[1] == pytest.approx(
        volumes[0], rel=0.02
    )  # the volume is projected before and not after contact with the ball


def test_a_gap_is_kept():
    setup = ball_against(40)
    _, frames = run(setup, collision={"gap": "1.5 mm", "stiffness": 1.0})
    assert deepest(setup, frames) == pytest.approx(-1.5, abs=1e-9)


def test_a_bone_that_is_gone_leaves_the_rest_state():
    setup = ball_against(300, back=80)
    _, frames = run(setup, collision=CONTACT, damping=0.1)
    moved = np.linalg.norm(frames[300] - setup.surface.points, axis=1).max()
    assert np.linalg.norm(frames[40] - setup.surface.points, axis=1).max() > 10
    assert moved < 0.1  # what damping has not yet taken after 660 steps


def test_what_overlaps_at_rest_does_not_jump():
    setup = ball_against(10)
    ball = Bone("ball", shapes.sphere(0, 8.0), None, solid=Sphere((15, 0, 0), 8.0))
    setup = Setup(setup.surface, (ball,), setup.attached, setup.frames, None)
    assert deepest(setup, {0: setup.surface.points}) > 2
    _, frames = run(setup, collision=CONTACT)
    np.testing.assert_allclose(frames[10], setup.surface.points, atol=1e-12)


def test_attached_vertices_go_with_their_bone_whatever_are_obstacles():
    setup = ball_against(5)
    everywhere = Bone("ball", shapes.sphere(0, 100.0), None, solid=Sphere((0, 0, 0), 100.0))
    _, frames = run(Setup(setup.surface, (everywhere,), setup.attached, setup.frames, None), collision=CONTACT)
    for attached in setup.attached:
        np.testing.assert_array_equal(frames[5][attached.vertices], setup.surface.points[attached.vertices])


def test_edges_along_fibres_are_reported_from_those_across():
    # Two fibres: one along z about the origin, of points 40 mm apart, one along x at y = 100. Nearest is the segment, not its ends.
    fibres = Polylines(
        np.array([[0.0, 0, -20], [0, 0, 20], [0, 0, 20], [-20, 100, 0], [20, 100, 0]]), np.array([0, 3, 5])
    )
    points = np.array([[1.0, 0, 0], [1, 0, 5], [1, 5, 0], [1, 4, 3], [1, 98, 0], [6, 98, 0]])
    edges = np.array([[0, 1], [0, 2], [0, 3], [1, 0], [4, 5]])
    np.testing.assert_allclose(pbd.along_fibres(points, edges, fibres), [1, 0, 0.6, 1, 1], atol=1e-15)


def kinked():
    """The spindle with its ends attached, the upper one moved by ``SWING``, and a fibre that zigzags in it with 21 kinks."""
    z = np.linspace(-25, 25, 23)
    fibre = np.column_stack([6 * (-1.0) ** np.arange(23), np.zeros(23), z])
    given = shapes.bar((1, 1, 1), (10, 10, 30), {"bottom": None, "top": None}, (), (0, 50))
    setup = attached_setup(None, SWING, last=50)
    return MuscleProblem(**vars(given) | vars(setup) | {"fibres": Polylines(fibre, np.array([0, 23]))})


def test_a_turned_scene_has_the_same_fibres_at_its_edges():
    # Beyond a kink both its segments are as near: rounding would choose between them.
    given = kinked()
    edges = pbd.hinges_of(given.surface.triangles)[:, :2]
    here = pbd.along_fibres(given.surface.points, edges, given.fibres)
    for angle in np.linspace(0.1, 3, 20):
        pose = RigidMotion((1, 2, 3), (50, -40, 70), (0.0, 1.0), (0.0, angle)).pose(1)
        fibres = Polylines(apply(pose, given.fibres.points), given.fibres.offsets)
        there = pbd.along_fibres(apply(pose, given.surface.points), edges, fibres)
        np.testing.assert_allclose(there, here, rtol=0, atol=1e-12)


def test_with_fibres_independent_of_where_the_world_is():
    # As without them: roundings of 1e-14 in the place of the whole grow over 150 steps.
    here = kinked()
    x, y, z = TURN[:3, :3] @ SWING.axis
    moved = RigidMotion((x, y, z), tuple(apply(TURN, np.array([SWING.centre]))[0]), SWING.frames, SWING.amounts)
    fibres = Polylines(apply(TURN, here.fibres.points), here.fibres.offsets)
    there = MuscleProblem(**vars(here) | vars(attached_setup(None, moved, last=50, pose=TURN)) | {"fibres": fibres})
    states = [run(given, anisotropy=1.0)[1][50] for given in (here, there)]
    np.testing.assert_allclose(states[1], apply(TURN, states[0]), atol=60e-6)


def test_edges_along_fibres_are_softer():
    # A bar with its fibre along z: by 40 % less stiff along it, by 40 % of cos 45 degrees less on the diagonals, not across.
    given = shapes.bar((2, 2, 6), (10, 10, 30), {"bottom": None, "top": SWING}, (), (0, 5))
    found = pbd.constraints_of(given, pbd.PbdSettings(**USUAL, anisotropy=0.4))
    edges = np.diff(given.surface.points[found.edges], axis=1)[:, 0]
    cosine = np.abs(edges[:, 2]) / np.linalg.norm(edges, axis=1)
    np.testing.assert_allclose(found.share, 1 - 0.4 * cosine, rtol=1e-14)
    assert {0.6, 0.717, 1.0} == set(np.round(found.share, 3).tolist())
    ends = [run(given, anisotropy=value)[1][5] for value in (None, 0.0, 0.4)]
    np.testing.assert_array_equal(ends[0], ends[1])
    assert np.abs(ends[2] - ends[0]).max() > 1e-3


@pytest.mark.parametrize(
    ("key", "value"),
    [
        ("sub_iterations", 1),
        ("solver_iterations", 4),
        ("damping", 0.5),
        ("stretch", 0.5),
        ("volume", 0),
        ("bending", 0),
    ],
)
def test_every_setting_is_felt(key, value):
    usual, changed = (run(attached_setup(None, SWING), **changes)[1][10] for changes in ({}, {key: value}))
    assert np.abs(changed - usual).max() > 1e-3


def test_frames_wanted_and_cost():
    outcome, frames = run(attached_setup(None, SWING, last=10, every=5))
    assert list(frames) == [0, 5, 10]
    np.testing.assert_array_equal(frames[0], spindle().points)
    np.testing.assert_array_equal(frames[5], run(attached_setup(None, SWING))[1][5])
    assert outcome.cost["iterations"] == 10
    assert outcome.cost["threads"] == 1
    assert 0 < outcome.cost["seconds_solve"] == pytest.approx(10 * outcome.cost["seconds_per_iteration"])
    assert outcome.cost["seconds_compile"] > 0


def test_positions_that_are_no_number_are_an_outcome():
    outcome, frames = run(
        attached_setup(None, RigidMotion((1, 0, 0), (0, 0, 0), (0.0, 2.0, 3.0), (0.0, 0.01, math.nan)))
    )
    assert outcome.status == "diverged"
    assert outcome.message.startswith("frame 3: the position of ")
    assert list(frames) == [0, 1, 2]
    assert outcome.cost["iterations"] == 3
    assert all(np.isfinite(surface).all() for surface in frames.values())


def test_a_body_torn_apart_is_an_outcome():
    leap = RigidMotion((1, 0, 0), (0, 1e5, 0), (0.0, 3.0, 4.0), (0.0, 0.0, 1.0))
    outcome, frames = run(attached_setup(leap, leap))
    assert outcome.status == "diverged"
    assert outcome.message.startswith("frame 4: the muscle extends over ")
    assert list(frames) == [0, 1, 2, 3]


def test_a_body_turned_inside_out_is_an_outcome():
    # One bone has the lower half attached and one the upper, which goes by a whole length of 60 mm through the lower one.
    setup = attached_setup(None, RigidMotion((0, 0, -1), None, (0.0, 3.0), (0.0, 60.0)))
    upper = setup.surface.points[:, 2] > 0
    attached = tuple(
        AttachedVertices(bone.name, bone, np.flatnonzero(mask))
        for bone, mask in zip(setup.bones, (~upper, upper), strict=True)
    )
    outcome, frames = run(Setup(setup.surface, setup.bones, attached, setup.frames, None))
    assert outcome.status == "inverted"
    assert outcome.message.startswith("frame 3: the surface is turned inside out; ")
    assert list(frames) == [0, 1, 2]


def pressed(pose, spacing):
    """Where a ball of triangles, its distance on a grid along the axes, has moved the spindle after 16 iterations."""
    setup = attached_setup(None, None, last=16, pose=pose)
    surface = shapes.sphere(2, 8.0)
    surface = surface.moved_to(apply(pose, surface.points + [20, 0, 0]))
    x, y, z = -pose[:3, 0]
    ball = Bone("ball", surface, RigidMotion((x, y, z), None, (0.0, 40.0), (0.0, 12.0)))
    vars(ball)["shape"] = build(surface, spacing, 6.0)  # as if it had been read from the kept distances
    _, frames = run(Setup(setup.surface, (ball,), setup.attached, setup.frames, None), collision=CONTACT)
    return apply(np.linalg.inv(pose), frames[16])


@pytest.mark.slow
def test_a_turned_grid_is_felt_by_less_than_a_tenth_of_its_spacing():
    # Two iterations after the first touch: what slides on the ball later doubles the difference every few iterations. The distance
    # is interpolated across the edges of the ball, so that half the spacing has at most half the error.
    coarse, fine = (
        np.linalg.norm(pressed(TURN, spacing) - pressed(np.eye(4), spacing), axis=1).max() for spacing in (1.0, 0.5)
    )
    assert 1e-4 < fine < coarse / 2
    assert coarse < 0.1


@pytest.mark.parametrize(
    ("key", "value"),
    [
        ("sub_iterations", 0),
        ("solver_iterations", 0),
        ("damping", 1.0),
        ("damping", math.nan),
        ("stretch", 1.1),
        ("volume", math.nan),
        ("bending", -0.1),
    ],
)
def test_settings_out_of_range(key, value):
    with pytest.raises(InputError, match=f"{key}: got {value}, want "):
        parse(pbd.PbdSettings, USUAL | {key: value}, "candidate[0]")


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"anisotropy": 1.5}, "anisotropy: got 1.5, want "),
        ({"collision": {"gap": "0 mm"}}, "collision.stiffness: got nothing, want this key"),
        ({"collision": {"gap": "-1 mm", "stiffness": 1.0}}, 'collision.gap: got "-1 mm", want '),
        ({"collision": {"gap": 1.0, "stiffness": 1.0}}, "collision.gap: got 1.0, want a length with its unit"),
        ({"collision": CONTACT | {"friction": 0.1}}, "collision.friction: got an unknown key"),
    ],
)
def test_effects_out_of_range(change, message):
    with pytest.raises(InputError, match=message):
        parse(pbd.PbdSettings, USUAL | change, "candidate[0]")


@pytest.mark.parametrize("key", list(USUAL))
def test_settings_are_all_required(key):
    with pytest.raises(InputError, match=f"{key}: got nothing, want this key"):
        parse(pbd.PbdSettings, {name: value for name, value in USUAL.items() if name != key}, "candidate[0]")
