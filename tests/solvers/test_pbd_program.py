"""What the report's program does: each of its steps by hand, and the whole against what it recorded."""

import math
from dataclasses import replace

import numpy as np
import pytest
import shapes

from fem_reference.foundations.errors import InputError
from fem_reference.foundations.mesh import Surface, enclosed_volume
from fem_reference.foundations.motion import RigidMotion, apply
from fem_reference.foundations.records import parse
from fem_reference.io import files
from fem_reference.problems import muscle
from fem_reference.problems.setup import AttachedVertices, Bone, Setup
from fem_reference.scenes import casefile
from fem_reference.solvers import pbd_program
from fem_reference.solvers.pbd_kernels import dihedrals
from fem_reference.solvers.pbd_program import Voxels
from fem_reference.solvers.program_kernels import (
    are_inside,
)

pytestmark = pytest.mark.slow

USUAL = {"sub_iterations": 3, "damping": 0.01, "bending": 0.9, "voxels": 64}
SETTINGS = pbd_program.ProgramSettings(**USUAL)
SWING = RigidMotion((1, 0, 0), (0, 20, -10), (0.0, 50.0), (0.0, 0.5))
TETRAHEDRON = np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]])


def ball():
    """A sphere of 20 mm with 642 vertices."""
    return shapes.sphere(3, 20.0)


def cube(side, lower=(0, 0, 0)):
    """A cube of 12 triangles from ``lower``."""
    box = shapes.skin(shapes.box((1, 1, 1), (side, side, side)))
    return box.moved_to(box.points + lower)


def attached_setup(low, high, last=10, every=1):
    """The ball with its ends attached by cubes below and above it, of which a vertex is inside from the beginning."""
    surface = ball()
    z = surface.points[:, 2]
    ends = np.flatnonzero(z < -18), np.flatnonzero(z > 18)
    plates = cube(30, (-15, -15, -49.9)), cube(30, (-15, -15, 19.9))
    names = ("low", "high")
    bones = tuple(Bone(name, plate, motion) for name, plate, motion in zip(names, plates, (low, high), strict=True))
    attached = tuple(AttachedVertices(bone.name, bone, vertices) for bone, vertices in zip(bones, ends, strict=True))
    return Setup(surface, bones, attached, tuple(range(0, last + 1, every)), interval=None)


def run(setup, **changes):
    """The outcome with the usual settings but for ``changes``, and the positions by frame number."""
    frames = []
    outcome = pbd_program.solve(setup, pbd_program.ProgramSettings(**USUAL | changes), frames.append)
    return outcome, {frame.number: frame.surface for frame in frames}


def attached_in(voxels, points):
    """Which of ``points`` lie in a voxel that is inside."""
    return are_inside(voxels.inside, voxels.places(points))


def test_half_edges_by_hand():
    expected = [(0, 2), (0, 1), (0, 3), (1, 0), (1, 3), (1, 2), (2, 1), (2, 3), (2, 0), (3, 0), (3, 1), (3, 2)]
    assert pbd_program.half_edges_of(TETRAHEDRON).tolist() == [list(pair) for pair in expected]


def test_hinges_by_hand():
    # Triangle 1 meets an earlier one at its corner 2, triangle 2 at its corners 1 and 2, triangle 3 at all of its corners.
    points = np.vstack([np.zeros(3), np.eye(3)])
    hinges, angles = pbd_program.hinges_of(points, TETRAHEDRON)
    assert hinges.tolist() == [[0, 1, 2, 3], [3, 1, 0, 2], [1, 2, 0, 3], [0, 3, 1, 2], [3, 2, 1, 0], [2, 0, 1, 3]]
    np.testing.assert_allclose(angles[[0, 3, 5]], math.pi / 2, atol=1e-12)  # the three at the origin
    np.testing.assert_allclose(np.delete(angles, [0, 3, 5]), math.acos(1 / math.sqrt(3)), atol=1e-12)


def test_angles_at_rest_are_those_between_the_triangles():
    # Arccos of a cosine that is off by 1e-16 is off by up to 2e-8 next to pi.
    surface = ball()
    hinges, angles = pbd_program.hinges_of(surface.points, surface.triangles)
    assert len(np.unique(np.sort(hinges[:, :2], axis=1), axis=0)) == len(hinges) == len(surface.triangles) * 3 // 2
    np.testing.assert_allclose(angles, dihedrals(np.array(surface.points), hinges), atol=3e-8)


def test_an_edge_is_projected_twice():
    # With a stiffness of 1/2 each projection takes half of the error: a quarter of it is left, shared by both ends.
    points = np.array([[0.0, 0, 0], [14, 0, 0]])
    rest = replace(
        pbd_program.constraints_of(attached_setup(None, None), SETTINGS),
        edges=np.array([[0, 1], [1, 0]]),
        lengths=np.full(2, 10.0),
        share=np.full(2, 0.5),
        triangles=np.zeros((0, 3), np.int64),
        hinges=np.zeros((0, 4), np.int64),
    )
    pbd_program.project(points, rest, 0.9)
    np.testing.assert_allclose(points, [[1.5, 0, 0], [12.5, 0, 0]], rtol=1e-15)


def test_a_cube_is_inside_from_its_corner_on():
    # Its corner is border, so that the flood does not even begin; of the box the upper faces are no part.
    voxels = Voxels.of(cube(4.0, (1, 1, 1)), 4)
    assert voxels.inside.all()
    assert voxels.size.tolist() == [1, 1, 1]
    points = np.array([[1.0, 1, 1], [4.99, 3, 4.99], [5, 3, 3], [3, 0.99, 3], [math.nan, 3, 3]])
    assert attached_in(voxels, points).tolist() == [True, True, False, False, False]


def test_voxels_of_a_ball_contain_it():
    # A triangle marks voxels whose corner is within 0.87 of its plane and 1.73 of its edges, all in voxels of 40 / 64 mm:
    # what is deeper than one diagonal is inside, what is more than three diagonals out of it is not.
    voxels = Voxels.of(ball(), 64)
    points = np.random.default_rng(1).uniform(-24, 24, (20000, 3))
    radius, diagonal = np.linalg.norm(points, axis=1), math.sqrt(3) * 40 / 64
    inside = attached_in(voxels, points)
    assert inside[radius < 20 - diagonal].all()
    assert not inside[radius > 20 + 3 * diagonal].any()


def test_who_marches_too_far_ends_at_its_start():
    # The cube of 4 voxels with a shaft of one, which lies as above.
    bone = pbd_program.VoxelBone(Bone("bone", cube(4.0), None), 4, 0)
    bone.voxels.inside[2, 2] = False
    start = np.array([[2.05, 2.05, 1.0]])
    np.testing.assert_array_equal(pbd_program.collided(start, start + [0.5, -0.5, 0], [bone]), start)


def test_the_motions_of_a_bone_add_up():
    # As the program adds up: 0.9 mm a hundred times are not 90 mm.
    bone = pbd_program.VoxelBone(
        Bone("bone", cube(8.0), RigidMotion((0, -1, 0), None, (0.0, 100.0), (0.0, 90.0))), 1, 0
    )
    height = 0.0
    for frame in range(1, 101):
        bone.move(frame)
        height -= 0.9
        assert (bone.pose[1, 3], bone.last[1, 3]) == (height, -0.9)
    assert height != -90


def test_a_bone_takes_along_what_it_has_come_over_and_forgets_nothing():
    bone = pbd_program.VoxelBone(Bone("bone", cube(8.0), RigidMotion((0, 0, 1), None, (0.0, 2.0), (0.0, 3.0))), 8, 0)
    starts, goals = np.array([[4.0, 4, 9], [4, 4, 12]]), np.array([[4.0, 5, 8], [4, 5, 12]])
    bone.move(1)  # now its upper face is at 9.5, and the first vertex inside, wherever it goes
    np.testing.assert_allclose(pbd_program.collided(starts, goals, [bone]), [[4, 4, 10.5], [4, 5, 12]])
    bone.move(2)
    bone.move(3)  # it rests, and takes along as before
    np.testing.assert_allclose(pbd_program.collided(starts, goals, [bone]), [[4, 4, 10.5], [4, 5, 12]])


def test_of_two_bones_the_later_wins():
    lower = pbd_program.VoxelBone(Bone("lower", cube(8.0), None), 8, 0)
    upper = pbd_program.VoxelBone(Bone("upper", cube(8.0, (0, 0, 4)), None), 8, 0)
    start, goal = np.array([[-1.0, 4, 6]]), np.array([[2.25, 4, 6]])
    only = pbd_program.collided(start, goal, [upper])
    np.testing.assert_array_equal(pbd_program.collided(start, goal, [lower, upper]), only)
    np.testing.assert_allclose(only, [[-0.75, 4, 6]])


def test_rest_stays_at_rest():
    setup = attached_setup(None, None)
    assert attached_in(Voxels.of(setup.bones[0].surface, 64), setup.surface.points).any()
    for surface in run(setup)[1].values():
        np.testing.assert_allclose(surface, setup.surface.points, rtol=0, atol=1e-12)


def test_attached_vertices_go_with_their_bone_and_weigh_as_all():
    setup = attached_setup(None, SWING)
    for number, surface in run(setup)[1].items():
        for attached in setup.attached:
            expected = apply(attached.bone.pose(number), setup.surface.points[attached.vertices])
            np.testing.assert_array_equal(surface[attached.vertices], expected)
    assert (pbd_program.constraints_of(setup, SETTINGS).inverse_masses == 1).all()


def test_the_same_twice():
    first, second = (run(attached_setup(None, SWING))[1][10] for _ in range(2))
    np.testing.assert_array_equal(first, second)


def test_fibres_leave_edges_across_them_stiff():
    # Along z the bar has one fibre: an edge at an angle to it keeps 1 - |cos|, to the power asked for.
    bar = shapes.bar((2, 2, 4), (10, 10, 30), {"bottom": None, "top": SWING}, (), (0, 5))
    found = pbd_program.constraints_of(bar, pbd_program.ProgramSettings(**USUAL, anisotropy=2.0))
    edges = bar.surface.points[found.edges[:, 1]] - bar.surface.points[found.edges[:, 0]]
    cosines = np.abs(edges[:, 2]) / np.linalg.norm(edges, axis=1)
    np.testing.assert_allclose(found.share, (1 - cosines) ** 2, atol=1e-12)
    assert (pbd_program.constraints_of(bar, SETTINGS).share == 1).all()
    with_fibres, without = (run(bar, **changes)[1][5] for changes in ({"anisotropy": 1.0}, {}))
    assert np.abs(with_fibres - without).max() > 1e-3


@pytest.mark.parametrize(("key", "value"), [("sub_iterations", 1), ("damping", 0.5), ("bending", 0), ("voxels", None)])
def test_every_setting_is_felt(key, value):
    # The cubes are squeezed into the ball.
    squeeze = RigidMotion((0, 0, -1), None, (0.0, 10.0), (0.0, 10.0))
    usual, changed = (run(attached_setup(None, squeeze), **changes)[1][10] for changes in ({}, {key: value}))
    assert np.abs(changed - usual).max() > 1e-3


def test_cost_is_reported():
    outcome, frames = run(attached_setup(None, SWING, last=10, every=5))
    assert list(frames) == [0, 5, 10]
    assert (outcome.status, outcome.cost["iterations"], outcome.cost["threads"]) == ("converged", 10, 1)
    assert 0 < outcome.cost["seconds_solve"] == pytest.approx(10 * outcome.cost["seconds_per_iteration"])
    assert outcome.cost["seconds_compile"] > 0
    assert outcome.cost["seconds_setup"] > 0


def test_positions_that_are_no_number_are_an_outcome():
    outcome, frames = run(
        attached_setup(None, RigidMotion((1, 0, 0), (0, 0, 0), (0.0, 2.0, 3.0), (0.0, 0.01, math.nan)))
    )
    assert outcome.status == "diverged"
    assert outcome.message.startswith("frame 3: the position of ")
    assert list(frames) == [0, 1, 2]


@pytest.mark.parametrize(
    ("key", "value"),
    [("sub_iterations", 0), ("damping", 1.1), ("bending", -0.1), ("voxels", 0), ("voxels", 257), ("anisotropy", -1.0)],
)
def test_settings_out_of_range(key, value):
    with pytest.raises(InputError, match=f"{key}: got {value}, want "):
        parse(pbd_program.ProgramSettings, USUAL | {key: value}, "candidate[0]")


@pytest.mark.parametrize("key", ["sub_iterations", "damping", "bending"])
def test_settings_without_which_nothing_runs(key):
    with pytest.raises(InputError, match=f"{key}: got nothing, want this key"):
        parse(
            pbd_program.ProgramSettings, {name: value for name, value in USUAL.items() if name != key}, "candidate[0]"
        )


# What follows is compared with what the report's program recorded, every tenth iteration.


def recorded(data, name, numbers):
    """What the program recorded, by frame number."""
    folder = data / "candidates" / f"report_pbd_{name}"
    return {number: files.read_surface(folder / f"frame_{number:04d}.ply", 1.0).points for number in numbers}


def far(one, other):
    """Mean distance of vertices [mm]."""
    return np.linalg.norm(one - other, axis=1).mean()


def check_volumes(surface, ours, theirs):
    """V/V0 is within 0.02 of the recorded one at all frames."""
    volumes = (
        np.array([enclosed_volume(points, surface.triangles) for points in run.values()]) for run in (ours, theirs)
    )
    assert np.abs(np.subtract(*volumes)).max() < 0.02 * enclosed_volume(surface.points, surface.triangles)


def merged(parts):
    """Surfaces as one."""
    starts = np.cumsum([0] + [len(part.points) for part in parts[:-1]])
    triangles = [part.triangles + start for part, start in zip(parts, starts, strict=True)]
    return Surface(np.vstack([part.points for part in parts]), np.vstack(triangles))


def test_voxels_contain_what_the_program_attached(data):
    # Exactly: every vertex in a voxel of the femur, and of those left every one in a voxel of the pelvis, which was both
    # hip bones and the sacrum in one. So voxels are made as there.
    bones = data / "hip" / "bones"
    parts = [files.read_surface(bones / f"{name}.ply", 1.0) for name in ("iliac_r", "iliac_l", "sacrum")]
    pelvis, femur = (
        Voxels.of(bone, 64) for bone in (merged(parts), files.read_surface(bones / "femur_report.vtk", 1.0))
    )
    names = {"gluteus_maximus": "gmax", "gluteus_medius": "gmed", "iliacus": "iliacus", "adductor_brevis": "addbrev"}
    for name, code in names.items():
        points = np.array(files.read_surface(data / "hip" / "muscles" / f"{name}.vtk", 1.0).points)
        table = data / "hip" / "attachments_of_report_program" / f"attach_code_{code}.csv"
        attached = np.loadtxt(table, delimiter=",", dtype=int)
        found = np.where(attached_in(femur, points), 2, attached_in(pelvis, points))
        expected = np.zeros(len(points), int)
        expected[attached[:, 0]] = attached[:, 1]
        np.testing.assert_array_equal(found, expected)


def test_the_recorded_gluteus_maximus_is_met(data):
    # Its pelvis is here without the left half, which changes the voxels; with it 0.6 mm become 0.3 mm at iteration 100.
    setup = muscle.setup(casefile.read_muscle("gluteus_maximus"))
    ours, theirs = run(setup)[1], recorded(data, "gluteus_maximus", setup.frames)
    rest = setup.surface.points
    assert far(ours[100], theirs[100]) < 0.02 * np.linalg.norm(theirs[100] - rest, axis=1).max()
    check_volumes(setup.surface, ours, theirs)


def test_the_recorded_box_is_met(data):
    # In all 300 iterations, to the last digit: it is recorded in single precision. The squeezed box is chaos: were the last
    # digit of any sum another, it would be lost by iteration 60.
    setup = muscle.setup(casefile.read_muscle("box_squeeze_report"))
    ours, theirs = run(setup)[1], recorded(data, "box", setup.frames)
    assert list(ours) == list(theirs) == list(range(0, 301, 10))
    for number, points in ours.items():
        np.testing.assert_array_equal(points.astype(np.float32), theirs[number])


def test_the_squeezed_box_is_chaos(data):
    # Why the order of every sum is the program's: what differs in the last digit at rest is millimetres away at iteration 100.
    setup = muscle.setup(casefile.read_muscle("box_squeeze_report"))
    nudged = np.random.default_rng(0).uniform(-1, 1, setup.surface.points.shape)
    surface = setup.surface.moved_to((1 + 1e-15 * nudged) * setup.surface.points)
    ours = run(replace(setup, surface=surface, frames=(0, 100)))[1]
    assert far(ours[100], recorded(data, "box", [100])[100]) > 1
