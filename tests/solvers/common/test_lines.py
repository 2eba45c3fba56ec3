"""Via-points that a joint's angle guides: lengths of polylines by hand, conditional on and off, moving and at the curve's ends."""

import math
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
import shapes
from numpy.testing import assert_allclose

from fem_reference.foundations.errors import InputError
from fem_reference.foundations.mesh import Polylines, Surface
from fem_reference.foundations.motion import RigidMotion, apply
from fem_reference.foundations.records import parse
from fem_reference.problems.muscle import MuscleProblem
from fem_reference.problems.setup import Joint
from fem_reference.runs.store import Frame
from fem_reference.solvers import line_of_action
from fem_reference.solvers.common.lines import nearest_bones

pytestmark = pytest.mark.slow  # tetrahedra of a bar

SWING = RigidMotion((1, 0, 0), (5, 25, 15), (0.0, 10.0), (0.0, 1.2))
ANGLES = {0: 0.0, 5: 0.6, 10: 1.2}
ON_TOP = {"at": 0.5, "bone": "bottom", "joint": "hinge"}


def hinged(sign: float = 1.0, swing: RigidMotion = SWING) -> MuscleProblem:
    """A bar of 30 mm with a straight line beside its middle; its top turns, counted by ``sign``."""
    given = shapes.bar((2, 2, 4), (10, 10, 30), {"bottom": None, "top": swing}, (), tuple(ANGLES))
    slope = sign * swing.amounts[-1] / swing.frames[-1]
    line = np.column_stack([np.full(21, 5.0), np.full(21, 3.0), np.linspace(0, 30, 21)])
    top = next(bone for bone in given.bones if bone.name == "top")
    joint = Joint("hinge", top, np.array([sign, 0, 0]), np.array(SWING.centre), lambda frame: slope * frame)
    return replace(given, fibres=Polylines(line, np.array([0, 21])), joints=(joint,))


def solved(given: MuscleProblem, *via: dict[str, object], **more: object) -> list[Frame]:
    frames: list[Frame] = []
    settings = parse(line_of_action.LineSettings, {"via": list(via)} | more, "candidate[0]")
    assert line_of_action.solve(given, settings, frames.append).status == "converged"
    return frames


def lengths(given: MuscleProblem, frames: list[Frame]) -> np.ndarray:
    return np.array([given.fibres.lengths(frame.fibres)[0] for frame in frames])


def through(*points: list[float] | np.ndarray) -> list[float]:
    """Lengths, by frame, from the end at the bottom through ``points``, one for each frame or none, to the end that turns."""
    found = []
    for i, number in enumerate(ANGLES):
        end = apply(SWING.pose(number), np.array([[5.0, 3, 30]]))[0]
        stations = [np.array([5.0, 3, 0]), *([np.asarray(points[i])] if len(points[i]) else []), end]
        found.append(sum(math.dist(a, b) for a, b in pairwise(stations)))
    return found


@pytest.mark.parametrize(
    ("low", "high", "on"),
    [("0.5 rad", "0.7 rad", (0, 1, 0)), ("0 rad", "0.6 rad", (1, 1, 0)), ("0.6 rad", "9 rad", (0, 1, 1))],
)
def test_a_conditional_point_is_passed_within_its_range_and_at_both_ends(low, high, on) -> None:
    given, point = hinged(), [5.0, 3, 15]
    frames = solved(given, ON_TOP | {"within": [low, high]})
    assert_allclose(lengths(given, frames), through(*(point if one else [] for one in on)), rtol=1e-13)
    assert lengths(given, frames)[1] > through([], [], [])[1] + 0.1  # at 0.6 rad the point is off the straight line


def test_an_angle_counted_the_other_way_is_out_of_range() -> None:
    given = hinged(sign=-1.0)
    off = lengths(given, solved(given, ON_TOP | {"within": ["0.5 rad", "0.7 rad"]}))
    assert_allclose(off, through([], [], []), rtol=1e-13)
    on = lengths(given, solved(given, ON_TOP | {"within": ["-40 deg", "-30 deg"]}))  # 0.6 rad is 34.4 degrees
    assert_allclose(on, through([], [5, 3, 15], []), rtol=1e-13)


def curve(*points: tuple[float, list[float]]) -> list[dict[str, str]]:
    return [{"angle": f"{angle} rad", "position": f"{x}, {y}, {z} mm"} for angle, (x, y, z) in points]


def test_a_moving_point_is_where_its_curve_says() -> None:
    """Two points make a straight line, of which 0.6 rad is the half; on a bone that turns, the point turns with it."""
    given, places = hinged(), curve((0.0, [5, 1, 12]), (1.2, [7, -3, 16]))
    frames = solved(given, ON_TOP | {"curve": places})
    assert_allclose(lengths(given, frames), through([5, 1, 12], [6, -1, 14], [7, -3, 16]), rtol=1e-13)
    turned = [
        apply(SWING.pose(n), np.array([p]))[0]
        for n, p in zip(ANGLES, ([5, 1, 12], [6, -1, 14], [7, -3, 16]), strict=True)
    ]
    frames = solved(given, ON_TOP | {"bone": "top", "curve": places})
    assert_allclose(lengths(given, frames), through(*turned), rtol=1e-13)


def test_beyond_its_ends_a_curve_stays_and_between_them_it_keeps_a_parabola() -> None:
    """The slopes at inner points are those of parabolas through their neighbours, so that a cubic between two of them is one."""
    given = hinged()
    frames = solved(given, ON_TOP | {"curve": curve((0.5, [5, 1, 12]), (0.7, [5, -1, 12]))})
    assert_allclose(lengths(given, frames), through([5, 1, 12], [5, 0, 12], [5, -1, 12]), rtol=1e-13)

    def place(angle: float) -> list[float]:
        return [5 - angle, 1 + 2 * angle**2, 12 + 3 * angle - angle**2]

    bent = curve(*((angle, place(angle)) for angle in (0.0, 0.3, 0.8, 1.2)))
    frames = solved(given, ON_TOP | {"curve": bent})
    assert_allclose(lengths(given, frames), through(*(place(angle) for angle in (0.0, 0.6, 1.2))), rtol=1e-12)


def test_a_point_left_out_leaves_the_others_where_they_are() -> None:
    given = hinged()
    always = {"at": 0.25, "bone": "bottom"}
    alone, both = solved(given, always), solved(given, always, ON_TOP | {"within": ["0.5 rad", "0.7 rad"]})
    for i in (0, 2):
        assert_allclose(both[i].fibres, alone[i].fibres, atol=1e-12)
    assert_allclose(both[1].fibres[10], [5, 3, 15], atol=1e-12)
    assert np.abs(both[1].fibres - alone[1].fibres).max() > 0.1


def test_a_point_left_out_pulls_at_no_bone() -> None:
    """Where the point on the bone below is left out, the straight line pulls both bones along itself; where it is passed, the bone
    above is pulled towards the point. Forces balance at every frame.
    """
    lengthens = RigidMotion((1, 0, 0), (5, 25, 15), (0.0, 10.0), (0.0, -0.6))
    hill = {"max_force": "500 N", "fibre_share": 0.9, "pennation": "0 deg"}
    via = {"at": 0.5, "bone": "bottom", "joint": "hinge", "within": ["-0.4 rad", "-0.2 rad"]}
    frames = solved(hinged(swing=lengthens), via, hill=hill)
    for frame, last in zip(frames, ([5, 3, 0], [5, 3, 15], [5, 3, 0]), strict=True):
        end = apply(lengthens.pose(frame.number), np.array([[5.0, 3, 30]]))[0]
        above, below = (
            np.array([frame.scalars[f"force_on_{bone}_{axis}"] for axis in "xyz"]) for bone in ("top", "bottom")
        )
        tension = frame.scalars["muscle_force"]
        assert tension > 1
        assert_allclose(above, tension * (last - end) / math.dist(last, end), rtol=1e-9, atol=1e-9 * tension)
        assert_allclose(above + below, 0, atol=1e-9 * tension)


@pytest.mark.parametrize(
    ("changed", "message"),
    [
        ({"joint": "knee", "within": ["0 rad", "1 rad"]}, r'via\[0\]\.joint: got "knee", want one of hinge'),
        ({}, '"joint" together with "within" or "curve", and only then'),
        ({"within": ["1 rad", "1 rad"]}, '"within" from an angle to a larger angle'),
        ({"curve": curve((0.0, [5, 1, 12]))}, '"curve" of at least two points, in order of'),
        ({"curve": curve((1.0, [5, 1, 12]), (0.0, [5, 2, 12]))}, '"curve" of at least two points, in order of'),
    ],
)
def test_points_that_are_refused(changed, message) -> None:
    with pytest.raises(InputError, match=message):
        solved(hinged(), ON_TOP | changed)


def test_without_a_joint_in_the_case_a_guided_point_is_refused() -> None:
    with pytest.raises(InputError, match="want a joint, but the case has none"):
        solved(replace(hinged(), joints=()), ON_TOP | {"within": ["0 rad", "1 rad"]})


def test_the_nearest_bone_has_the_nearest_vertex() -> None:
    """Not the nearest on average: from the end of a long row of vertices most of it is far."""
    row = np.column_stack([np.arange(0.0, 101, 10), np.zeros(11), np.zeros(11)])
    surface = Surface(np.vstack([row, [[95.0, 0, 20]]]), np.array([[0, 1, 2]]))
    given = hinged()
    attached = [
        replace(one, vertices=vertices)
        for one, vertices in zip(given.attached, (np.arange(11), np.array([11])), strict=True)
    ]
    given = replace(given, surface=surface, attached=tuple(attached))
    assert nearest_bones(given, np.array([[95.0, 0, 1], [95, 0, 19]]), "lines").tolist() == [0, 1]
