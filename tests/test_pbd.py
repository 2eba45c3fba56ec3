"""Position based dynamics: the constraints of a surface, the step, and the solver."""

import math

import numpy as np
import pytest

from fem_reference.errors import InputError
from fem_reference.mesh import Surface, check_closed, enclosed_volume
from fem_reference.motion import Rotation, apply
from fem_reference.problem import Body, Held, Setup
from fem_reference.records import parse
from fem_reference.solvers import pbd

USUAL = {
    "sub_iterations": 3,
    "solver_iterations": 1,
    "damping": 0.01,
    "stretch": 1.0,
    "volume": 1.0,
    "bending": 0.9,
}
SETTINGS = pbd.Settings(**USUAL)
TURN = Rotation((1, 2, 3), (5, -4, 7), (0.0, 1.0), (0.0, 2.0)).pose(1)
SWING = Rotation((1, 0, 0), (0, 20, -10), (0.0, 50.0), (0.0, 0.5))


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


def held_setup(low, high, last=10, every=1, pose=None):
    """The spindle with its ends, a fifth of its half length each, held by bones that move by ``low`` and ``high``."""
    surface = spindle()
    z = surface.points[:, 2]
    ends = np.flatnonzero(z < -24), np.flatnonzero(z > 24)
    if pose is not None:
        surface = surface.moved_to(apply(pose, surface.points))
    bones = tuple(Body(name, surface, motion) for name, motion in (("low", low), ("high", high)))
    held = tuple(Held(bone.name, bone, vertices) for bone, vertices in zip(bones, ends, strict=True))
    return Setup(surface, bones, held, tuple(range(0, last + 1, every)), interval=None)


def run(setup, **changes):
    """The outcome with the usual settings but for ``changes``, and the positions by frame number."""
    frames = []
    outcome = pbd.solve(setup, pbd.Settings(**USUAL | changes), frames.append)
    return outcome, {frame.number: frame.surface for frame in frames}


def test_hinges_are_the_edges_and_the_vertices_opposite():
    triangles = spindle().triangles
    hinges = pbd.hinges_of(triangles)
    sides = np.sort(np.vstack([hinges[:, [0, 1, 2]], hinges[:, [0, 1, 3]]]), axis=1)
    assert sorted(sides.tolist()) == sorted(3 * np.sort(triangles, axis=1).tolist())
    assert len(np.unique(hinges[:, :2], axis=0)) == len(hinges) == 3 * 12 * 11


def test_free_flight_is_damped():
    # With every stiffness 0 a step loses its share of velocity and moves on: way_n = (1 - damping)^n way_0.
    surface = spindle()
    rest = pbd.Constraints.at_rest(surface.points, surface.triangles, [])
    settings = pbd.Settings(**USUAL | {"damping": 0.25, "stretch": 0, "volume": 0, "bending": 0})
    points, way = np.array(surface.points), np.full(surface.points.shape, 2.0)
    for _ in range(5):
        points, way = pbd.advance(points, way, rest, settings)
    np.testing.assert_allclose(way, 2 * 0.75**5, rtol=1e-12)  # a difference of coordinates of 30 mm
    np.testing.assert_allclose(points - surface.points, 2 * sum(0.75**n for n in range(1, 6)), rtol=1e-12)


def test_a_turned_rest_state_stays_put():
    surface = spindle()
    turned = apply(TURN, surface.points)
    rest = pbd.Constraints.at_rest(surface.points, surface.triangles, [])
    points, way = turned.copy(), np.zeros(turned.shape)
    for _ in range(100):
        points, way = pbd.advance(points, way, rest, SETTINGS)
    np.testing.assert_allclose(points, turned, atol=1e-10)  # roundings of 1e-13 that drift for 100 steps


def test_rest_stays_at_rest():
    _, frames = run(held_setup(None, None))
    assert list(frames) == list(range(11))
    for surface in frames.values():
        np.testing.assert_allclose(surface, spindle().points, rtol=0, atol=1e-12)


def test_a_body_held_by_nothing_stays_at_rest():
    setup = held_setup(None, None)
    outcome, positions = run(Setup(setup.surface, setup.bones, (), setup.frames, None))
    assert outcome.status == "converged"
    assert np.abs(positions[10] - setup.surface.points).max() < 1e-9


def test_bones_that_move_as_one_carry_the_body_along():
    # A closed surface that keeps its edges and angles is rigid, so that what is left once the bones rest is what
    # damping has not yet taken: with a tenth of the velocity lost in each of 300 steps, below a thousandth of 60 mm.
    setup = held_setup(SWING, SWING, last=150)
    outcome, frames = run(setup, damping=0.1)
    assert outcome.status == "converged"
    expected = apply(SWING.pose(150), setup.surface.points)
    assert np.linalg.norm(expected - setup.surface.points, axis=1).max() > 10
    np.testing.assert_allclose(frames[150], expected, atol=0.06)


def test_held_vertices_go_with_their_bone():
    setup = held_setup(None, SWING)
    _, frames = run(setup)
    for number, surface in frames.items():
        for held in setup.held:
            expected = apply(held.bone.pose(number), setup.surface.points[held.vertices])
            np.testing.assert_array_equal(surface[held.vertices], expected)


def test_independent_of_where_the_world_is():
    # Roundings of 1e-14 in the place of the whole grow over 150 steps; 1e-6 of the size is far below what is looked at.
    x, y, z = TURN[:3, :3] @ SWING.axis
    moved = Rotation((x, y, z), tuple(apply(TURN, np.array([SWING.centre]))[0]), SWING.frames, SWING.angles)
    _, here = run(held_setup(None, SWING, last=50))
    _, there = run(held_setup(None, moved, last=50, pose=TURN))
    np.testing.assert_allclose(there[50], apply(TURN, here[50]), atol=60e-6)


def test_the_same_twice():
    first, second = (run(held_setup(None, SWING))[1][10] for _ in range(2))
    np.testing.assert_array_equal(first, second)


def test_volume_is_kept():
    surface = spindle()
    volume = enclosed_volume(surface.points, surface.triangles)
    kept, lost = (
        enclosed_volume(run(held_setup(None, SWING, last=50), volume=stiffness)[1][50], surface.triangles) / volume
        for stiffness in (1.0, 0.0)
    )
    assert abs(kept - 1) < 0.02
    assert abs(lost - 1) > 2 * abs(kept - 1)


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
    usual, changed = (run(held_setup(None, SWING), **changes)[1][10] for changes in ({}, {key: value}))
    assert np.abs(changed - usual).max() > 1e-3


def test_frames_wanted_and_cost():
    outcome, frames = run(held_setup(None, SWING, last=10, every=5))
    assert list(frames) == [0, 5, 10]
    np.testing.assert_array_equal(frames[0], spindle().points)
    np.testing.assert_array_equal(frames[5], run(held_setup(None, SWING))[1][5])
    assert outcome.cost["iterations"] == 10
    assert outcome.cost["threads"] == 1
    assert 0 < outcome.cost["seconds_solve"] == pytest.approx(10 * outcome.cost["seconds_per_iteration"])
    assert outcome.cost["seconds_compile"] > 0


def test_positions_that_are_no_number_are_an_outcome():
    outcome, frames = run(held_setup(None, Rotation((1, 0, 0), (0, 0, 0), (0.0, 2.0, 3.0), (0.0, 0.01, math.nan))))
    assert outcome.status == "diverged"
    assert outcome.message.startswith("frame 3: the position of ")
    assert list(frames) == [0, 1, 2]
    assert outcome.cost["iterations"] == 3
    assert all(np.isfinite(surface).all() for surface in frames.values())


def test_a_body_torn_apart_is_an_outcome():
    leap = Rotation((1, 0, 0), (0, 1e5, 0), (0.0, 3.0, 4.0), (0.0, 0.0, 1.0))
    outcome, frames = run(held_setup(leap, leap))
    assert outcome.status == "diverged"
    assert outcome.message.startswith("frame 4: the surface is spread over ")
    assert list(frames) == [0, 1, 2, 3]


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
        parse(pbd.Settings, USUAL | {key: value}, "candidate[0]")


@pytest.mark.parametrize("key", list(USUAL))
def test_settings_are_all_required(key):
    with pytest.raises(InputError, match=f"{key}: got nothing, want this key"):
        parse(pbd.Settings, {name: value for name, value in USUAL.items() if name != key}, "candidate[0]")
