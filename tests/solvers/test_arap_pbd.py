"""The two combinations of ARAP and PBD: volume as a constraint of the energy, and ARAP as the initial guess of projections."""

from dataclasses import replace

import numpy as np
import pytest
import shapes

from fem_reference.foundations.errors import InputError
from fem_reference.foundations.mesh import enclosed_volume
from fem_reference.foundations.motion import RigidMotion, apply
from fem_reference.foundations.records import parse
from fem_reference.problems.setup import AttachedVertices, Setup
from fem_reference.solvers import arap, arap_pbd
from fem_reference.solvers.pbd import PbdConstraints
from fem_reference.solvers.pbd_kernels import distances, volume
from tests.solvers.test_arap import JUMP, SWING, TURN, attached_setup, muscle, started, system_of

CONSTRAINT = {"weights": "clamped cotangent", "iterations": 5, "volume_constraint": True}
SWEEPS = {"sweeps": 3, "stretch": 1.0, "volume": 1.0, "bending": 0.9}
GUESS = CONSTRAINT | {"volume_constraint": False, "projections": SWEEPS}
EXACT = {"iterations": 3000, "tolerance": "1e-12 mm"}


def settings(usual=CONSTRAINT, **changes):
    return parse(arap_pbd.ArapPbdSettings, usual | changes, "candidate[0]")


def run(setup, usual=CONSTRAINT, **changes):
    """The outcome with the usual settings but for ``changes``, and the positions by frame number."""
    frames = []
    outcome = arap_pbd.solve(setup, settings(usual, **changes), frames.append)
    return outcome, {frame.number: frame.surface for frame in frames}


def constraints_of(setup):
    attached = np.concatenate([entry.vertices for entry in setup.attached])
    return PbdConstraints.at_rest(setup.surface.points, setup.surface.triangles, attached)


def test_the_volume_is_kept_to_rounding():
    setup = attached_setup(None, SWING, last=10)
    outcome, frames = run(setup)
    assert outcome.status == "converged"
    rest = enclosed_volume(setup.surface.points, setup.surface.triangles)
    for surface in frames.values():
        assert enclosed_volume(surface, setup.surface.triangles) == pytest.approx(rest, rel=1e-11)


@pytest.mark.parametrize("weights", ["clamped cotangent", "kirchhoff"])
def test_what_it_ends_with_is_stationary(weights):
    # The slope of the energy is the volume's, times one multiplier, at every free vertex.
    setup = attached_setup(None, JUMP, muscle(noise=1.0))
    system, rest = system_of(setup, weights), constraints_of(setup)
    found = arap_pbd.minimise(system, started(setup), settings(weights=weights, **EXACT), rest)
    assert found.met
    rotations = arap.fit_rotations(found.points, system.cells)
    slope = (arap.laplacian(system.cells) @ found.points - arap.right_side(rotations, system.cells))[
        system.free
    ].ravel()
    gradient = volume(found.points, rest.triangles)[1][system.free].ravel()
    multiplier = slope @ gradient / (gradient @ gradient)
    assert np.abs(multiplier * gradient).max() > 0.01
    np.testing.assert_allclose(slope, multiplier * gradient, atol=1e-9)  # of terms of about 10 mm


@pytest.mark.parametrize("seed", range(4))
def test_less_energy_than_scaling_by_turns_at_the_same_volume(seed):
    random = np.random.default_rng(seed)
    motion = RigidMotion(tuple(random.normal(size=3)), tuple(random.normal(scale=20, size=3)), (0.0, 1.0), (0.0, 0.7))
    setup = attached_setup(None, motion, muscle(noise=1.0, seed=seed))
    triangles, states = setup.surface.triangles, []
    by_turns = {"weights": "clamped cotangent", "fixed": "remove", "rotations": "each", "volume_step": True}
    record = parse(arap.ArapSettings, by_turns | {"iterations": 300, "tolerance": "1e-9 mm"}, "candidate[0]")
    arap.solve(setup, record, lambda frame: states.append(frame.surface))
    scaled = states[1]
    rest = replace(constraints_of(setup), six_volumes=volume(scaled, np.array(triangles))[0])
    system = system_of(setup, "clamped cotangent")
    found = arap_pbd.minimise(system, started(setup), settings(iterations=300), rest).points
    assert enclosed_volume(found, triangles) == pytest.approx(enclosed_volume(scaled, triangles), rel=1e-11)
    assert arap.least_energy(found, system.cells) < arap.least_energy(scaled, system.cells)


def test_the_constraint_costs_energy():
    setup = attached_setup(None, JUMP)
    system, rest = system_of(setup, "clamped cotangent"), constraints_of(setup)
    free, kept = (
        arap.least_energy(arap_pbd.minimise(system, started(setup), record, rest).points, system.cells)
        for record in (settings(GUESS, iterations=300), settings(iterations=300))
    )
    assert free < kept


@pytest.mark.parametrize("usual", [CONSTRAINT, GUESS])
def test_attached_vertices_go_with_their_bone(usual):
    setup = attached_setup(None, SWING, last=10)
    _, frames = run(setup, usual)
    assert list(frames) == list(range(11))
    for number, surface in frames.items():
        for attached in setup.attached:
            expected = apply(attached.bone.pose(number), setup.surface.points[attached.vertices])
            np.testing.assert_array_equal(surface[attached.vertices], expected)


@pytest.mark.parametrize("usual", [CONSTRAINT, GUESS])
def test_a_rigid_motion_is_reproduced(usual):
    # Projections leave rest as it is up to roundings of about 1e-14 of 60 mm.
    setup = attached_setup(JUMP, JUMP)
    _, frames = run(setup, usual, **EXACT)
    np.testing.assert_allclose(frames[1], apply(JUMP.pose(1), setup.surface.points), rtol=0, atol=1e-9)


@pytest.mark.parametrize("usual", [CONSTRAINT, GUESS])
def test_independent_of_where_the_world_is(usual):
    x, y, z = TURN[:3, :3] @ SWING.axis
    moved = RigidMotion((x, y, z), tuple(apply(TURN, np.array([SWING.centre]))[0]), SWING.frames, SWING.amounts)
    _, here = run(attached_setup(None, SWING, last=10), usual)
    _, there = run(attached_setup(None, moved, last=10, pose=TURN), usual)
    np.testing.assert_allclose(
        there[10], apply(TURN, here[10]), rtol=0, atol=1e-8
    )  # roundings of 60 mm, through 30 sweeps


def test_projections_start_from_the_state_of_arap():
    setup, states = attached_setup(None, JUMP), []
    usual = {"weights": "kirchhoff", "fixed": "remove", "rotations": "each", "volume_step": False}
    record = parse(arap.ArapSettings, usual | {"iterations": 5}, "candidate[0]")
    arap.solve(setup, record, lambda frame: states.append(frame.surface))
    _, nothing = run(setup, GUESS, weights="kirchhoff", projections=SWEEPS | {"stretch": 0, "volume": 0, "bending": 0})
    np.testing.assert_array_equal(nothing[1], states[1])
    _, found = run(setup, GUESS, weights="kirchhoff")
    given = settings(GUESS).projections
    np.testing.assert_array_equal(found[1], arap_pbd.projected(states[1], constraints_of(setup), given))


def test_more_sweeps_keep_edges_and_volume_better():
    # Without bending: dihedral angles, the last of each sweep, stand against both.
    setup = attached_setup(None, JUMP)
    rest = constraints_of(setup)
    _, few = run(setup, GUESS, projections=SWEEPS | {"sweeps": 1, "bending": 0})
    _, many = run(setup, GUESS, projections=SWEEPS | {"sweeps": 50, "bending": 0})
    stretches = [np.abs(distances(points, rest.edges) - rest.lengths).mean() for points in (few[1], many[1])]
    volumes = [abs(volume(points, rest.triangles)[0] / rest.six_volumes - 1) for points in (few[1], many[1])]
    assert stretches[1] < 0.7 * stretches[0]
    assert volumes[1] < 0.1 * volumes[0]


def test_the_guess_saves_sweeps():
    # Report 6.2. A sweep carries a motion on by little, so that without a guess many are needed: with it, 3 come nearer than
    # 30 to where the projections end without it.
    setup = attached_setup(None, JUMP)
    rest, given = constraints_of(setup), settings(GUESS).projections
    end, alone = (
        arap_pbd.projected(started(setup), rest, given.model_copy(update={"sweeps": sweeps})) for sweeps in (1000, 30)
    )
    guessed = run(setup, GUESS)[1][1]
    assert np.linalg.norm(guessed - end) < 0.5 * np.linalg.norm(alone - end)


@pytest.mark.parametrize("key", ["sweeps", "stretch", "volume", "bending"])
def test_every_projection_is_felt(key):
    usual, changed = (
        run(attached_setup(None, JUMP), GUESS, projections=SWEEPS | changes)[1][1]
        for changes in ({}, {key: 1 if key == "sweeps" else 0})
    )
    assert np.abs(changed - usual).max() > 1e-3


def test_both_at_once():
    setup = attached_setup(None, JUMP)
    _, constraint = run(setup)
    _, both = run(setup, projections=SWEEPS)
    expected = arap_pbd.projected(constraint[1], constraints_of(setup), settings(GUESS).projections)
    np.testing.assert_array_equal(both[1], expected)


def test_a_volume_out_of_reach_is_an_outcome():
    # Every vertex is attached to one of two bones, which move apart.
    setup = attached_setup(None, RigidMotion((0, 0, 1), None, (0.0, 1.0), (0.0, 10.0)))
    upper = setup.surface.points[:, 2] > 0
    attached = tuple(
        AttachedVertices(bone.name, bone, np.flatnonzero(mask))
        for bone, mask in zip(setup.bones, (~upper, upper), strict=True)
    )
    outcome, frames = run(Setup(setup.surface, setup.bones, attached, setup.frames, None))
    assert outcome.status == "diverged"
    assert outcome.message.startswith("frame 1: no multiplier preserves the volume, which is 1.")
    assert list(frames) == [0]


def pressed(travel):
    """A bar of 30 mm whose upper end goes down by ``travel`` [mm] in one frame."""
    down = RigidMotion((0, 0, -1), None, (0.0, 1.0), (0.0, travel))
    return shapes.bar((2, 2, 4), (10, 10, 30), {"bottom": None, "top": down}, (), (0, 1))


def test_a_volume_at_another_root_is_an_outcome():
    outcome, frames = run(pressed(45.0), iterations=3)
    assert outcome.status == "diverged"
    assert outcome.message.startswith("frame 1: the nearest positions with the volume at rest are ")
    assert list(frames) == [0]


@pytest.mark.parametrize("travel", [20.0, 30.0, 37.5])
def test_the_root_nearest_to_the_minimum_is_taken(travel):
    # Where the volume crosses that of rest first, on a fine grid of multipliers in both directions.
    given = pressed(travel)
    system, rest = system_of(given, "clamped cotangent"), constraints_of(given)
    before = started(given)
    minimum = system.place(before, arap.fit_rotations(before, system.cells))
    found = arap_pbd.at_volume(system, minimum, before, rest)
    assert volume(found, rest.triangles)[0] == pytest.approx(rest.six_volumes, rel=1e-11)
    shares = np.linspace(-1, 1, 4002)[1:-1] * (1 - 1e-9)  # no share is 0 or 1
    off = [volume(minimum + share * (found - minimum), rest.triangles)[0] - rest.six_volumes for share in shares]
    assert len(set(np.sign(off))) == 1


@pytest.mark.parametrize("lost", [np.nan, np.inf])
def test_no_number_has_no_root(lost):
    setup = attached_setup(None, SWING)
    points = np.array(setup.surface.points)
    points[5, 0] = lost
    assert arap_pbd.least_root(points, setup.surface.points * 0.1, constraints_of(setup)) is None


def test_a_tolerance_that_is_not_met_is_reported():
    setup = attached_setup(None, SWING, last=10)
    outcome, frames = run(setup, tolerance="1e-6 mm")
    assert outcome.status == "out of steps"
    assert outcome.message.startswith("10 frames in 50 iterations; 10 frames did not meet the tolerance; ")
    assert list(frames) == list(range(11))


def test_without_both_it_is_another_solver():
    with pytest.raises(InputError, match=r'want volume_constraint = true or "projections"'):
        settings(volume_constraint=False)


@pytest.mark.parametrize(
    ("key", "value"), [("weights", "tutte"), ("iterations", 0), ("tolerance", "0 mm"), ("volume_constraint", 1)]
)
def test_settings_out_of_range(key, value):
    with pytest.raises(InputError, match=rf'{key}: got "?{value}"?, want '):
        settings(**{key: value})


@pytest.mark.parametrize(("key", "value"), [("sweeps", 0), ("stretch", 1.1), ("volume", -1), ("bending", 2)])
def test_projections_out_of_range(key, value):
    with pytest.raises(InputError, match=rf"projections\.{key}: got {value}, want "):
        settings(projections=SWEEPS | {key: value})


@pytest.mark.parametrize("key", list(CONSTRAINT))
def test_settings_are_all_required(key):
    with pytest.raises(InputError, match=f"{key}: got nothing, want this key"):
        parse(
            arap_pbd.ArapPbdSettings, {name: value for name, value in CONSTRAINT.items() if name != key}, "candidate[0]"
        )
