"""Forces and moments of lines of action: closed forms, virtual work, balance, and scenes turned and scaled."""

import math
from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.spatial.transform import Rotation as Turn

from fem_reference.foundations.mesh import Polylines, Surface
from fem_reference.foundations.motion import RigidMotion, apply
from fem_reference.foundations.records import parse
from fem_reference.problems.muscle import MuscleProblem
from fem_reference.problems.setup import AttachedVertices, Bone
from fem_reference.runs.store import Frame
from fem_reference.solvers import line_of_action
from fem_reference.solvers.common.hill import Hill
from tests.line_bar import SWING, bar, lengths, solved

pytestmark = pytest.mark.slow


HILL = {"max_force": "500 N", "fibre_share": 0.4, "pennation": "20 deg"}


def test_lines_pull_as_hills_muscles_of_their_lengths() -> None:
    """Two lines of 30 mm share the force; as one of them becomes longer it pulls more than one that slackens."""
    pull = RigidMotion((0, 0, 1), None, (0.0, 10.0), (0.0, 6.0))
    given = bar(pull)
    _, frames = solved(given, hill=HILL)
    alone = parse(
        Hill,
        {"max_force": "500 N", "optimal_length": "12 mm", "slack_length": f"{30 - 12 * math.cos(math.radians(20))} mm"},
        "",
    )
    alone = alone.model_copy(update={"pennation": math.radians(20)})
    for frame, length in zip(frames, (30.0, 33.0, 36.0), strict=True):
        force, fibre = alone.static(length, 1.0)
        assert frame.scalars["muscle_force"] == pytest.approx(force, rel=1e-9)
        assert frame.scalars["fibre_length_mean"] == pytest.approx(fibre, rel=1e-9)
    _, tired = solved(given, hill=HILL | {"activation": 0.2})
    assert tired[1].scalars["muscle_force"] < 0.5 * frames[1].scalars["muscle_force"]
    _, slack = solved(bar(RigidMotion((0, 0, -1), None, (0.0, 10.0), (0.0, 20.0))), hill=HILL)
    assert slack[-1].scalars["muscle_force"] == 0
    assert "muscle_force" not in solved(given)[1][0].scalars


def test_a_path_that_no_fibre_spans_ends_the_run_and_keeps_its_frames() -> None:
    """At 30 km the tendon pulls harder than fibres of three times their optimal length."""
    outcome, frames = solved(bar(RigidMotion((0, 0, 1), None, (0.0, 5.0, 10.0), (0.0, 6.0, 3e7))), hill=HILL)
    assert outcome.status == "diverged"
    assert "frame 10: hill: got a path of 3e+07 mm, want a path on which fibres have 0.1 to 3 times" in outcome.message
    assert [frame.number for frame in frames] == [0, 5]


def exerted(frame: Frame, bone: str) -> tuple[np.ndarray, np.ndarray]:
    """Force [N] and moment about the origin [N mm] on a bone."""
    force, moment = (
        np.array([frame.scalars[f"{kind}_on_{bone}_{axis}"] for axis in "xyz"]) for kind in ("force", "moment")
    )
    return force, moment


PULLED = RigidMotion((1, 0, 0), (5, 25, 15), (0.0, 10.0), (0.0, -0.6))  # lines get longer


def alone(given: MuscleProblem, line: int) -> MuscleProblem:
    """The problem with one of its two fibres."""
    low, high = given.fibres.offsets[line : line + 2]
    return replace(given, fibres=Polylines(given.fibres.points[low:high], np.array([0, high - low])))


@pytest.mark.parametrize("activation", [0.0, 1.0])  # 0: the parallel element alone
def test_a_straight_line_about_a_hinge_has_the_moment_of_its_arm(activation) -> None:
    """A line from A, which rests, to B, which turns about a hinge H along x: the moment is the force times the distance of H."""
    given = alone(bar(PULLED), 0)
    _, frames = solved(given, hill=HILL | {"activation": activation, "fibre_share": 0.9, "pennation": "0 deg"})
    start, end, hinge = given.fibres.points[0], given.fibres.points[-1], np.array([5.0, 25, 15])
    for frame in frames[1:]:
        across = apply(PULLED.pose(frame.number), end[None])[0] - start
        arm = np.cross(hinge - start, across)[0] / np.linalg.norm(across)  # signed: both are in the plane of y and z
        force, moment = exerted(frame, "top")
        tension = frame.scalars["muscle_force"]
        assert tension > 1
        assert_allclose(force, -tension * across / np.linalg.norm(across), rtol=1e-12, atol=1e-9)
        assert_allclose(moment[0] - np.cross(hinge, force)[0], tension * arm, rtol=1e-12)


EGG = {"centre": "5, 8, 12 mm", "radii": ["8 mm", "6 mm", "4 mm"], "turn": "20, 0, 30 deg"}
RING = {"centre": "5, 16, 15 mm", "axis": [0, 0.1, 1], "radius": "9 mm", "tube": "2 mm"}
ROD = {"start": "0, 5, 21 mm", "end": "1, 5, 21.5 mm", "radius": "3 mm"}
PEA = {"centre": "4, 7, 8 mm", "radius": "4 mm"}
# Of three points lines leave out the middle one, on another bone than the rest, in all frames but number 5.
LEFT_OUT = {"at": 0.5, "bone": "bottom", "joint": "counter", "within": ["4 rad", "6 rad"]}
OBSTACLES = [
    {},
    {"via": [{"at": 0.3, "bone": "top"}, LEFT_OUT, {"at": 0.6, "bone": "top"}]},
    {"via": [{"at": 0.3, "bone": "top"}, {"at": 0.6, "bone": "bottom"}]},
    {"obstacle": [{"bone": "bottom", "sphere": {"centre": "5, 8, 15 mm", "radius": "6 mm"}}]},
    {"obstacle": [{"bone": "top", "cylinder": {"start": "0, 7, 12 mm", "end": "1, 7, 13 mm", "radius": "6 mm"}}]},
    {"obstacle": [{"bone": "bottom", "ellipsoid": EGG}]},
    {"obstacle": [{"bone": "top", "torus": RING}]},
    {
        "obstacle": [{"bone": "top", "cylinder": ROD}, {"bone": "bottom", "sphere": PEA}],
        "via": [{"at": 0.6, "bone": "bottom"}],
    },
    {"obstacle": [{"bone": "top", "cylinder": ROD}, {"bone": "bottom", "sphere": PEA}]},
]


# Two obstacles without a point between them take longest: one test asks them by day.
BY_DAY = [*OBSTACLES[:-1], pytest.param(OBSTACLES[-1], marks=pytest.mark.nightly)]


@pytest.mark.parametrize("obstacle", OBSTACLES[3:])
def test_lines_meet_the_obstacles_of_these_tests(obstacle) -> None:
    paths = lines_of(bar(PULLED), obstacle | {"hill": HILL})
    straight = lines_of(bar(PULLED), {"via": obstacle.get("via", [])})
    assert (paths.lengths(5) > straight.lengths(5) + 0.1).all()


def pulled(settings: dict) -> MuscleProblem:
    """The bar that gets longer; around an obstacle, whose paths take long, at rest and once."""
    given = bar(PULLED)
    return replace(given, frames=(0, 5)) if "obstacle" in settings else given


def lines_of(given: MuscleProblem, settings: dict) -> line_of_action.Shortest:
    return line_of_action.Shortest(given, parse(line_of_action.LineSettings, settings, ""))


@pytest.mark.parametrize("obstacle", OBSTACLES)
def test_the_moment_is_the_force_times_minus_the_slope_of_the_length(obstacle) -> None:
    """Virtual work, around obstacles too: central differences of the lengths over 2e-4 rad, whose error is of the order of 1e-8."""
    step, middle = 1e-4, 0.55
    turn = RigidMotion((1, 0, 0), (5, 25, 15), (0.0, 1.0, 2.0, 3.0), (0.0, -middle - step, -middle, -middle + step))
    for line in (0,) if "obstacle" in obstacle else (0, 1):  # paths around obstacles take long
        given = alone(replace(bar(turn, points=2001), frames=(0, 1, 2, 3)), line)
        shares = {"fibre_share": 0.9, "pennation": "0 deg", "activation": 0.5}
        outcome, frames = solved(replace(given, frames=(0, 2)), hill=HILL | shares, **obstacle)
        assert outcome.status == "converged"
        # Length of the paths, not of the chords: the same force law has them, and its inverse is not needed.
        problem = line_of_action.Shortest(
            given, parse(line_of_action.LineSettings, obstacle | {"hill": HILL | shares}, "")
        )
        long = [problem.lengths(n)[0] for n in (1, 3)]
        force, moment = exerted(frames[-1], "top")
        tension = frames[-1].scalars["muscle_force"]
        assert tension > 1
        about = moment[0] - np.cross([5, 25, 15], force)[0]
        assert_allclose(about, -tension * (long[1] - long[0]) / (2 * step), rtol=1e-6, atol=1e-6 * tension)


@pytest.mark.parametrize("obstacle", BY_DAY)
def test_forces_and_moments_on_all_bones_balance(obstacle) -> None:
    _, frames = solved(pulled(obstacle), hill=HILL, **obstacle)
    for frame in frames[1:]:
        parts = [exerted(frame, bone) for bone in ("bottom", "top")]
        assert np.abs(parts[0][0]).max() > 1
        for one, other in zip(*parts, strict=True):
            assert_allclose(one + other, 0, atol=1e-9 * np.abs(one).max())


def test_what_turns_as_a_whole_turns_its_forces() -> None:
    """Bones that move together in a scene of an obstacle: the forces turn with them."""
    _, frames = solved(bar(SWING, bottom=SWING), hill=HILL | {"fibre_share": 0.9}, **OBSTACLES[2])
    first, moment = exerted(frames[0], "top")
    turn = SWING.pose(10)
    force, turned = exerted(frames[-1], "top")
    assert np.abs(first).max() > 1
    assert_allclose(force, turn[:3, :3] @ first, rtol=1e-9, atol=1e-9)
    assert_allclose(turned, turn[:3, :3] @ moment + np.cross(turn[:3, 3], force), rtol=1e-9, atol=1e-7)


def alike(given: MuscleProblem, turn: np.ndarray, shift: np.ndarray, factor: float, order: np.ndarray) -> MuscleProblem:
    """The problem turned, moved and ``factor`` times as great, with the vertices of its surface in another ``order``."""

    def there(points: np.ndarray) -> np.ndarray:
        return factor * points @ turn.T + shift

    def moved(bone: Bone) -> Bone:
        motion = bone.motion
        if motion is not None and motion.centre is not None:
            axis, (x, y, z) = turn @ motion.axis, there(np.array(motion.centre))
            motion = replace(motion, axis=tuple(axis), centre=(x, y, z))
        return replace(bone, surface=bone.surface.moved_to(there(bone.surface.points)), motion=motion)

    back, bones = np.argsort(order), {bone.name: moved(bone) for bone in given.bones}
    surface = Surface(there(given.surface.points[order]), back[given.surface.triangles])
    attached = tuple(
        AttachedVertices(one.attachment, bones[one.bone.name], np.sort(back[one.vertices])) for one in given.attached
    )
    fibres = Polylines(there(given.fibres.points), given.fibres.offsets)
    return replace(given, surface=surface, bones=tuple(bones.values()), attached=attached, fibres=fibres)


def grown(settings: dict, turn: np.ndarray, shift: np.ndarray, factor: float) -> dict:
    """Settings with their places, lengths and directions turned, moved and scaled."""

    def one(key: str, value: object) -> object:
        if isinstance(value, dict):
            return grown(value, turn, shift, factor)
        if key == "axis":
            return (turn @ np.array(value, float)).tolist()
        if isinstance(value, list):
            return [one(key, entry) for entry in value]
        if key == "turn":
            own = Turn.from_rotvec([float(angle) for angle in value.removesuffix(" deg").split(",")], degrees=True)
            vector = (Turn.from_matrix(turn) * own).as_rotvec(degrees=True)
            return ", ".join(repr(float(angle)) for angle in vector) + " deg"
        if isinstance(value, str) and value.endswith(" mm"):
            numbers = factor * np.array([float(number) for number in value.removesuffix(" mm").split(",")])
            placed = turn @ numbers + shift if key in {"centre", "start", "end", "position"} else numbers
            return ", ".join(repr(float(number)) for number in placed) + " mm"
        return value

    return {key: one(key, value) for key, value in settings.items()}


PLACES = [
    {"angle": f"{angle} rad", "position": f"{place} mm"}
    for angle, place in ((0, "5, 8, 9"), (6, "4, 12, 11"), (9, "5, 9, 14"))
]
MOVING = {"via": [{"at": 0.4, "bone": "top", "joint": "counter", "curve": PLACES}]}


@pytest.mark.parametrize("obstacle", [*BY_DAY, MOVING])
def test_a_scene_turned_moved_scaled_and_renumbered_has_the_same_arms_forces_and_moments(obstacle) -> None:
    """Lengths and arms to scale, forces as its square (so is F0), moments as its cube; turned as the scene is."""
    given, factor, shift = pulled(obstacle), 2.5, np.array([30.0, -50, 7])
    turn = Turn.random(rng=np.random.default_rng(3)).as_matrix()
    order = np.random.default_rng(4).permutation(len(given.surface.points))
    other = alike(given, turn, shift, factor, order)
    great = grown(obstacle, turn, shift, factor)
    stronger = HILL | {"max_force": f"{500 * factor**2} N"}
    (_, small_one), (_, frames) = solved(given, hill=HILL, **obstacle), solved(other, hill=stronger, **great)
    assert_allclose(lengths(other, frames), factor * lengths(given, small_one), rtol=1e-9)
    for one, frame in zip(small_one[1:], frames[1:], strict=True):
        assert_allclose(frame.scalars["muscle_force"], factor**2 * one.scalars["muscle_force"], rtol=1e-6)
        (less, about), (force, moment) = exerted(one, "top"), exerted(frame, "top")
        size = np.linalg.norm(less)
        assert size > 1
        assert_allclose(force, factor**2 * turn @ less, atol=1e-6 * factor**2 * size)
        assert_allclose(moment - np.cross(shift, force), factor**3 * turn @ about, atol=1e-4 * factor**3 * size)


def test_lines_without_hill_have_no_force() -> None:
    _, frames = solved(bar())
    assert not [name for frame in frames for name in frame.scalars if "force" in name or "moment" in name]
