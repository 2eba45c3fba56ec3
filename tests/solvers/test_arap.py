"""As-rigid-as-possible deformation: its weights, its two steps, what its variants are, and the solver."""

import itertools
import math

import igl
import numpy as np
import pytest
import shapes

from fem_reference.foundations.errors import InputError
from fem_reference.foundations.mesh import Surface, enclosed_volume
from fem_reference.foundations.motion import RigidMotion, apply
from fem_reference.foundations.records import parse
from fem_reference.problems.setup import AttachedVertices, Bone, Setup
from fem_reference.solvers import arap

USUAL = {
    "weights": "cotangent",
    "fixed": "remove",
    "rotations": "each",
    "volume_step": False,
    "iterations": 5,
}
EXACT = {"iterations": 3000, "tolerance": "1e-13 mm"}
TURN = RigidMotion((1, 2, 3), (5, -4, 7), (0.0, 1.0), (0.0, 2.0)).pose(1)
SWING = RigidMotion((1, 0, 0), (0, 20, -10), (0.0, 10.0), (0.0, 0.5))
JUMP = RigidMotion((1, 0, 0), (0, 20, -10), (0.0, 1.0), (0.0, 0.5))
WEIGHTS = ("cotangent", "clamped cotangent", "kirchhoff", "tutte")


def muscle(noise=0.0, seed=0):
    """A closed surface of 162 vertices, 40 mm by 60 mm in z, with ``noise`` [mm] in every coordinate.

    Smooth it has four edges of a negative weight, with a noise of 1 mm about twenty.
    """
    ball = shapes.sphere(2, 20.0)
    rough = np.random.default_rng(seed).normal(scale=noise, size=ball.points.shape)
    return Surface(ball.points * [1, 1, 1.5] + rough, ball.triangles)


def attached_setup(low, high, surface=None, last=1, pose=None):
    """A muscle whose ends, a fifth of its half length each, are attached by bones that move by ``low`` and ``high``."""
    surface = surface or muscle()
    z = surface.points[:, 2]
    ends = np.flatnonzero(z < -24), np.flatnonzero(z > 24)
    if pose is not None:
        surface = surface.moved_to(apply(pose, surface.points))
    bones = tuple(Bone(name, surface, motion) for name, motion in (("low", low), ("high", high)))
    attached = tuple(AttachedVertices(bone.name, bone, vertices) for bone, vertices in zip(bones, ends, strict=True))
    return Setup(surface, bones, attached, tuple(range(last + 1)), interval=None)


def run(setup, **changes):
    """The outcome with the usual settings but for ``changes``, and the positions by frame number."""
    frames = []
    outcome = arap.solve(setup, parse(arap.ArapSettings, USUAL | changes, "candidate[0]"), frames.append)
    return outcome, {frame.number: frame.surface for frame in frames}


def system_of(setup, weights="cotangent", fixed="remove"):
    attached = np.concatenate([entry.vertices for entry in setup.attached])
    return arap.GlobalStep.of(arap.cells_of(setup.surface, weights), attached, fixed)


def started(setup, frame=1):
    """Rest positions with the attached vertices at ``frame``."""
    points = np.array(setup.surface.points)
    for attached in setup.attached:
        points[attached.vertices] = apply(attached.bone.pose(frame), setup.surface.points[attached.vertices])
    return points


def by_singular_values(rest, points, cells):
    """The rotation of each cell as the report has it, the least singular direction mirrored where it is a reflection."""
    found = []
    for i in range(len(rest)):
        at = slice(cells.starts[i], cells.starts[i + 1])
        j = cells.neighbours[at]
        covariance = ((rest[i] - rest[j]) * cells.weights[at, None]).T @ (points[i] - points[j])
        left, _, right = np.linalg.svd(covariance)
        mirror = np.diag([1, 1, np.sign(np.linalg.det(left @ right))])
        found.append((left @ mirror @ right).T)
    return np.array(found)


def test_cotangents_of_known_triangles():
    points = np.array([[0, 0, 0], [2, 0, 0], [1, math.sqrt(3), 0], [0, 2, 0], [-2, 2, 0], [1, 0, 0]])
    triangles = np.array([[0, 1, 2], [0, 1, 3], [0, 1, 4], [0, 5, 1], [0, 0, 1]])
    third = 1 / math.sqrt(3)
    # Equilateral; right-angled; 135 degrees at the first corner; three vertices in line; two in one place.
    expected = [[third] * 3, [0, 1, 1], [-1, 2, 3], [0, 0, 0], [0, 0, 0]]
    np.testing.assert_allclose(arap.cotangents(points, triangles), expected, atol=1e-15)


def test_the_cotangent_matrix_is_that_of_libigl():
    surface = muscle(noise=1.0)
    cells = arap.cells_of(surface, "cotangent")
    assert (cells.weights < 0).any()
    expected = -igl.cotmatrix(surface.points, surface.triangles)
    assert abs(arap.laplacian(cells) - expected).max() < 1e-12  # roundings of cotangents of about 1


def test_negative_weights_leave_the_matrix_positive():
    # It is the matrix of linear elements, v^T L v = integral of |grad v|^2 >= 0, whatever the shape of the triangles.
    for seed in range(3):
        matrix = arap.laplacian(arap.cells_of(muscle(noise=3.0, seed=seed), "cotangent")).toarray()
        assert np.linalg.eigvalsh(matrix)[0] > -1e-12 * np.abs(matrix).max()


def test_weights_without_geometry():
    kirchhoff, tutte, clamped = (
        arap.cells_of(muscle(noise=1.0), name) for name in ("kirchhoff", "tutte", "clamped cotangent")
    )
    assert (kirchhoff.weights == 1).all()
    degrees = np.diff(kirchhoff.starts)
    assert sorted(set(degrees)) == [5, 6]  # a sphere from an icosahedron
    np.testing.assert_array_equal(tutte.weights, 1 / np.repeat(degrees, degrees))
    kept = arap.cells_of(muscle(noise=1.0), "cotangent").weights
    np.testing.assert_array_equal(clamped.weights, np.maximum(kept, 0))


@pytest.mark.parametrize("weights", WEIGHTS)
def test_least_squares_are_those_of_numpy(weights):
    setup = attached_setup(None, JUMP)
    system, points = system_of(setup, weights, "ols"), started(setup)
    rotations = arap.fit_rotations(points, system.cells)
    matrix = arap.laplacian(system.cells).toarray()
    right = arap.right_side(rotations, system.cells) - matrix[:, system.attached] @ points[system.attached]
    expected = np.linalg.lstsq(matrix[:, system.free], right)[0]
    # The condition of the normal equations is the square of about 1e3, of positions of 60 mm.
    np.testing.assert_allclose(system.place(points, rotations)[system.free], expected, atol=1e-8)


@pytest.mark.parametrize("noise", [0.0, 1.0])
def test_the_same_as_libigl(noise):
    # libigl fits rotations in single precision: roundings of 1e-7 (and, for some cells of some noise, of 1e-4: seed 0).
    setup = attached_setup(None, JUMP, muscle(noise, seed=1))
    outcome, frames = run(setup, **EXACT)
    assert outcome.status == "converged"
    assert outcome.cost["frames_off_tolerance"] == 0
    attached = np.concatenate([entry.vertices for entry in setup.attached])
    data = igl.ARAPData()
    data.energy, data.max_iter = igl.ARAPEnergyType.ARAP_ENERGY_TYPE_SPOKES, 600
    igl.arap_precomputation(setup.surface.points, setup.surface.triangles, 3, attached.astype(np.int32), data)
    theirs = igl.arap_solve(frames[1][attached], data, np.array(setup.surface.points))
    assert np.abs(theirs - frames[1]).max() < 1e-6 * 60
    cells = arap.cells_of(setup.surface, "cotangent")
    assert (cells.weights < 0).any()
    assert arap.least_energy(theirs, cells) == pytest.approx(arap.least_energy(frames[1], cells), rel=1e-9)


@pytest.mark.parametrize("weights", ["cotangent", "clamped cotangent", "kirchhoff"])
def test_the_energy_never_rises(weights):
    for seed, noise in enumerate((0.0, 1.0, 2.0, 4.0)):
        setup = attached_setup(None, JUMP, muscle(noise, seed))
        system, points = system_of(setup, weights), started(setup)
        energies = []
        for _ in range(60):
            rotations = arap.fit_rotations(points, system.cells)
            energies.append(arap.energy(points, rotations, system.cells))
            points = system.place(points, rotations)
            energies.append(arap.energy(points, rotations, system.cells))
        assert np.diff(energies).max() <= 1e-12 * max(np.abs(energies))
        assert energies[-1] < energies[1]


def test_tutte_is_kirchhoff_where_rows_are_removed():
    # Each equation divided by a number has the same solution, and a cell of scaled weights the same rotation; least
    # squares weigh the equations otherwise.
    setup = attached_setup(None, JUMP)
    one, other = (run(setup, weights=weights)[1][1] for weights in ("kirchhoff", "tutte"))
    np.testing.assert_allclose(other, one, atol=1e-10)
    one, other = (run(setup, weights=weights, fixed="ols")[1][1] for weights in ("kirchhoff", "tutte"))
    assert np.abs(other - one).max() > 1e-3


def test_least_squares_may_raise_the_energy():
    # They minimise the residual of all equations, those of attached vertices too, and not eq. 5.10: its least value is lower.
    setup = attached_setup(None, JUMP)
    least, squares = (run(setup, fixed=fixed, **EXACT)[1][1] for fixed in ("remove", "ols"))
    cells = arap.cells_of(setup.surface, "cotangent")
    assert arap.least_energy(squares, cells) > 1.05 * arap.least_energy(least, cells)


@pytest.mark.parametrize(("weights", "fixed"), list(itertools.product(WEIGHTS, ("remove", "ols"))))
def test_a_rigid_motion_is_reproduced(weights, fixed):
    setup = attached_setup(JUMP, JUMP)
    outcome, frames = run(setup, weights=weights, fixed=fixed, **EXACT)
    assert outcome.status == "converged"
    np.testing.assert_allclose(frames[1], apply(JUMP.pose(1), setup.surface.points), rtol=0, atol=1e-9)


def test_attached_vertices_go_with_their_bone():
    setup = attached_setup(None, SWING, last=10)
    for changes in ({}, {"fixed": "ols"}, {"volume_step": True}):
        _, frames = run(setup, **changes)
        for number, surface in frames.items():
            for attached in setup.attached:
                expected = apply(attached.bone.pose(number), setup.surface.points[attached.vertices])
                np.testing.assert_array_equal(surface[attached.vertices], expected)


@pytest.mark.parametrize("fixed", ["remove", "ols"])
@pytest.mark.parametrize("volume_step", [False, True])
def test_independent_of_where_the_world_is(fixed, volume_step):
    # Positions of 60 mm, roundings of 1e-14 that least squares multiply by their condition of 1e6.
    x, y, z = TURN[:3, :3] @ SWING.axis
    moved = RigidMotion((x, y, z), tuple(apply(TURN, np.array([SWING.centre]))[0]), SWING.frames, SWING.amounts)
    changes = {"fixed": fixed, "volume_step": volume_step}
    _, here = run(attached_setup(None, SWING, last=10), **changes)
    _, there = run(attached_setup(None, moved, last=10, pose=TURN), **changes)
    np.testing.assert_allclose(there[10], apply(TURN, here[10]), rtol=0, atol=1e-7)


def test_kept_negative_weights_may_not_let_rest_stay():
    # Where the two lesser eigenvalues of a cell's covariance have a negative sum, a half turn has less energy than none.
    setup = attached_setup(None, None, muscle(noise=3.0, seed=4))
    _, kept = run(setup)
    _, clamped = run(setup, weights="clamped cotangent")
    assert np.abs(kept[1] - setup.surface.points).max() > 0.1
    np.testing.assert_allclose(clamped[1], setup.surface.points, rtol=0, atol=1e-9)


def test_scaling_reaches_the_volume_where_all_is_free():
    surface = muscle(noise=1.0)
    volume = enclosed_volume(surface.points, surface.triangles)
    found = arap.scaled(np.array(surface.points), surface.triangles, np.arange(162), 2 * volume)
    assert enclosed_volume(found, surface.triangles) == pytest.approx(2 * volume, rel=1e-12)
    np.testing.assert_allclose(found.mean(axis=0), surface.points.mean(axis=0), atol=1e-12)


@pytest.mark.slow
def test_the_volume_step_misses_the_volume_and_costs_energy():
    # Report 6.2: attached vertices do not scale, and what scaling gains the next iteration takes back.
    setup = attached_setup(None, SWING, last=10)
    triangles, cells = setup.surface.triangles, arap.cells_of(setup.surface, "cotangent")
    _, plain = run(setup, iterations=200)
    _, scaled = run(setup, iterations=200, volume_step=True)
    rest, without, with_step = (
        enclosed_volume(points, triangles) for points in (setup.surface.points, plain[10], scaled[10])
    )
    assert 1e-4 < abs(with_step / rest - 1) < abs(without / rest - 1)
    assert arap.least_energy(scaled[10], cells) > 1.05 * arap.least_energy(plain[10], cells)


def test_rotations_of_the_first_iteration_only():
    setup = attached_setup(None, JUMP)
    system, points = system_of(setup), started(setup)
    outcome, frames = run(setup, rotations="first only", tolerance="1e-6 mm")
    np.testing.assert_array_equal(frames[1], system.place(points, arap.fit_rotations(points, system.cells)))
    assert outcome.cost["local_global_steps"] == 2  # the second moves nothing
    assert np.abs(frames[1] - run(setup)[1][1]).max() > 0.1


def test_frames_wanted_and_cost():
    setup = attached_setup(None, SWING, last=10)
    outcome, frames = run(Setup(setup.surface, setup.bones, setup.attached, (0, 5, 10), None))
    assert list(frames) == [0, 5, 10]
    np.testing.assert_array_equal(frames[0], setup.surface.points)
    np.testing.assert_array_equal(frames[5], run(setup)[1][5])
    assert outcome.message == "10 frames in 50 iterations"
    assert outcome.cost["iterations"] == 10
    assert outcome.cost["local_global_steps"] == 50
    assert outcome.cost["threads"] == 1
    assert 0 < outcome.cost["seconds_solve"] == pytest.approx(10 * outcome.cost["seconds_per_iteration"])
    assert outcome.cost["seconds_compile"] > 0
    assert outcome.cost["seconds_setup"] > 0


def test_the_energy_of_a_frame_is_reported():
    setup, frames = attached_setup(None, JUMP), []
    arap.solve(setup, parse(arap.ArapSettings, USUAL, "candidate[0]"), frames.append)
    cells = arap.cells_of(setup.surface, "cotangent")
    rotations = by_singular_values(setup.surface.points, frames[1].surface, cells)
    i = np.repeat(np.arange(162), np.diff(cells.starts))
    rest, moved = (points[i] - points[cells.neighbours] for points in (setup.surface.points, frames[1].surface))
    off = moved - np.einsum("eab,eb->ea", rotations[i], rest)
    expected = np.sum(cells.weights * np.sum(off**2, axis=1))
    assert frames[0].scalars["arap_energy_mm2"] == pytest.approx(0, abs=1e-20)
    assert frames[1].scalars["arap_energy_mm2"] == pytest.approx(expected, rel=1e-10)


def test_without_attachment_or_all_attached_it_does_not_deform():
    setup = attached_setup(None, SWING)
    outcome, frames = run(Setup(setup.surface, setup.bones, (), setup.frames, None))
    assert outcome.status == "converged"
    np.testing.assert_array_equal(frames[1], setup.surface.points)
    attached = (AttachedVertices("all", setup.bones[1], np.arange(162)),)
    outcome, frames = run(Setup(setup.surface, setup.bones, attached, setup.frames, None))
    assert outcome.status == "converged"
    np.testing.assert_array_equal(frames[1], apply(SWING.pose(1), setup.surface.points))


def test_a_tolerance_that_is_not_met_is_reported_at_the_end_and_all_frames_are_kept():
    setup = attached_setup(None, SWING, last=10)
    outcome, frames = run(setup, tolerance="1e-6 mm")
    assert outcome.status == "out of steps"
    assert outcome.message.startswith(
        "10 frames in 50 iterations; 10 frames did not meet the tolerance; more iterations or a larger tolerance may help"
    )
    assert outcome.cost["frames_off_tolerance"] == 10
    assert list(frames) == list(range(11))
    np.testing.assert_array_equal(frames[10], run(setup)[1][10])
    outcome, _ = run(setup, tolerance="5 mm")
    assert outcome.status == "converged"
    assert outcome.cost["local_global_steps"] < 50


def test_scaling_a_surface_that_encloses_nothing_leaves_it():
    surface = muscle()
    flat = surface.points * [1, 1, 0]
    np.testing.assert_array_equal(arap.scaled(flat, surface.triangles, np.arange(162), 1.0), flat)


def test_a_muscle_blown_up_by_scaling_is_an_outcome():
    # A bar pressed to nothing in ten frames: what is not attached is scaled without end.
    down = RigidMotion((0, 0, -1), None, (0.0, 10.0), (0.0, 31.0))
    given = shapes.bar((2, 2, 4), (10, 10, 30), {"bottom": None, "top": down}, (), tuple(range(11)))
    outcome, _ = run(given, weights="clamped cotangent", volume_step=True, iterations=4)
    assert outcome.status == "diverged"
    assert "times its volume at rest; a slower motion may help" in outcome.message


def test_positions_that_are_no_number_are_an_outcome():
    outcome, frames = run(
        attached_setup(None, RigidMotion((1, 0, 0), (0, 0, 0), (0.0, 2.0, 3.0), (0, 0.01, math.nan)), last=4)
    )
    assert outcome.status == "diverged"
    assert outcome.message.startswith("frame 3: the position of ")
    assert list(frames) == [0, 1, 2]
    assert outcome.cost["iterations"] == 3


@pytest.mark.parametrize("volume_step", [False, True])
def test_a_surface_turned_inside_out_is_an_outcome(volume_step):
    # The ends change places in one frame: with a single iteration rotations cannot follow, and scaling must not mirror.
    through = RigidMotion((0, 0, -1), None, (0.0, 1.0), (0.0, 150.0))
    outcome, frames = run(attached_setup(None, through), iterations=1, volume_step=volume_step)
    assert outcome.status == "inverted"
    assert outcome.message.startswith("frame 1: the surface is turned inside out")
    assert list(frames) == [0]


def test_a_vertex_that_nothing_ties_is_an_outcome():
    # All triangles around a vertex shrink to a point, which takes their weights away.
    surface = muscle()
    vertex = np.argmin(np.abs(surface.points[:, 2]))
    points = np.array(surface.points)
    points[surface.triangles[(surface.triangles == vertex).any(axis=1)]] = points[vertex]
    setup = attached_setup(None, SWING, surface.moved_to(points))
    outcome, frames = run(setup)
    assert outcome.status == "diverged"
    assert outcome.message.startswith(f"vertex {vertex}: only triangles without area or weight connect it")
    assert list(frames) == [0]
    assert run(setup, weights="kirchhoff")[0].status == "converged"


@pytest.mark.parametrize(
    ("key", "value"),
    [
        ("weights", "uniform"),
        ("fixed", "penalty"),
        ("rotations", 1),
        ("volume_step", 1),
        ("iterations", 0),
        ("tolerance", "0 mm"),
    ],
)
def test_settings_out_of_range(key, value):
    with pytest.raises(InputError, match=rf'{key}: got "?{value}"?, want '):
        parse(arap.ArapSettings, USUAL | {key: value}, "candidate[0]")


@pytest.mark.parametrize("key", list(USUAL))
def test_settings_are_all_required(key):
    with pytest.raises(InputError, match=f"{key}: got nothing, want this key"):
        parse(arap.ArapSettings, {name: value for name, value in USUAL.items() if name != key}, "candidate[0]")
