"""Lines of action beside OpenSim: length and moment arm of the same line about the same hinge, from two programs."""

import math
from dataclasses import replace

import numpy as np
import pytest
import shapes
from numpy.testing import assert_allclose

from fem_reference.foundations.mesh import Polylines
from fem_reference.foundations.motion import RigidMotion
from fem_reference.foundations.records import parse
from fem_reference.problems.muscle import MuscleProblem
from fem_reference.problems.setup import Joint
from fem_reference.solvers import line_of_action

opensim = pytest.importorskip("opensim", reason="OpenSim is not installed")
pytestmark = pytest.mark.slow  # tetrahedra of a bar

HINGE = (5, 25, 15)
START, END = (5.0, 3, 0), (7.0, 2, 30)
ANGLES = (-0.55, -0.3, 0.1, 0.37, 0.7)
# Frame n is at 0.1 (n - 10) rad.
SWING = RigidMotion((1, 0, 0), HINGE, (0.0, 20.0), (-1.0, 1.0))
COORDINATE = "/jointset/hinge/hinge_coord_0"


def hinged() -> MuscleProblem:
    """A bar with one straight line, whose top turns about the hinge."""
    given = shapes.bar((1, 1, 2), (10, 10, 30), {"bottom": None, "top": SWING}, (), (10,))
    joint = Joint("hinge", given.bones[1], np.array([1.0, 0, 0]), np.array(HINGE), lambda frame: 0.1 * (frame - 10))
    return replace(given, fibres=Polylines(np.linspace(START, END, 21), np.array([0, 21])), joints=(joint,))


def ours(settings: dict) -> np.ndarray:
    """Lengths [mm] and moment arms [mm] by excursion (2, angles)."""
    given = hinged()
    line = line_of_action.Shortest(given, parse(line_of_action.LineSettings, settings, ""))

    def length(angle: float) -> float:
        return float(line.lengths(10 + 10 * angle)[0])

    step = 2e-5  # its square times a third derivative of about 30 mm: 1e-8 mm
    arms = [(length(angle - step) - length(angle + step)) / (2 * step) for angle in ANGLES]
    return np.array([[length(angle) for angle in ANGLES], arms])


def model_of(points: list, wraps: list) -> "opensim.Model":
    """A body that turns about the hinge, and a line from START through ``points`` (point, path of its body) to END, around
    ``wraps`` (object, on the body that turns).
    """
    model = opensim.Model()
    ground, body = model.getGround(), opensim.Body("top", 1, opensim.Vec3(0), opensim.Inertia(1))
    frame = opensim.Body("frame", 1, opensim.Vec3(0), opensim.Inertia(1))  # rests, as the ground does
    model.addBody(body)
    model.addBody(frame)
    model.addJoint(opensim.WeldJoint("weld", ground, frame))
    # A pin joint turns about its third axis, which this makes the first of ours.
    place, turned = opensim.Vec3(*HINGE), opensim.Vec3(0, math.pi / 2, 0)
    model.addJoint(opensim.PinJoint("hinge", ground, place, turned, body, place, turned))
    muscle = opensim.Thelen2003Muscle("line", 1, 0.1, 0.1, 0)
    muscle.addNewPathPoint("start", ground, opensim.Vec3(*START))
    model.addForce(muscle)
    path = muscle.updGeometryPath()
    for point, on in points:
        point.updSocket("parent_frame").setConnecteePath(on)
        path.updPathPointSet().cloneAndAppend(point)
    muscle.addNewPathPoint("end", body, opensim.Vec3(*END))
    for i, (wrap, on_body) in enumerate(wraps):
        wrap.setName(f"wrap{i}")
        (body if on_body else ground).addWrapObject(wrap)
        path.addPathWrap(wrap)
    model.finalizeConnections()
    return model


def theirs(points: list = (), wraps: list = ()) -> np.ndarray:
    """Lengths and moment arms (2, angles) by OpenSim."""
    opensim.Logger.setLevelString("Off")
    model = model_of(points, wraps)
    state = model.initSystem()
    coordinate, muscle = model.updCoordinateSet().get(0), model.getMuscles().get(0)
    found = []
    for angle in ANGLES:
        coordinate.setValue(state, angle)
        model.realizePosition(state)
        found.append((muscle.getLength(state), muscle.computeMomentArm(state, coordinate)))
    return np.array(found).T


def point(kind: str, place: tuple) -> "opensim.AbstractPathPoint":
    made = getattr(opensim, kind)()
    made.setName("via")
    made.setLocation(opensim.Vec3(*place))
    return made


VIA = {"at": 0.5, "bone": "bottom"}


def agree(mine: np.ndarray, other: np.ndarray) -> None:
    """Both to 1e-6 of the lengths; the arms are large enough to say something."""
    assert_allclose(mine[0], other[0], rtol=1e-6)
    assert_allclose(mine[1], other[1], rtol=1e-6, atol=1e-6)
    assert np.abs(mine[1]).max() > 5


def test_a_straight_line() -> None:
    agree(ours({}), theirs())


@pytest.mark.parametrize(("bone", "body"), [("bottom", "/ground"), ("top", "/bodyset/top")])
def test_a_fixed_point(bone, body) -> None:
    agree(ours({"via": [VIA | {"bone": bone}]}), theirs([(point("PathPoint", (6, 2.5, 15)), body)]))


def test_a_conditional_point() -> None:
    made = point("ConditionalPathPoint", (6, 2.5, 15))
    made.updSocket("coordinate").setConnecteePath(COORDINATE)
    made.setRangeMin(0.0)
    made.setRangeMax(0.5)
    found = ours({"via": [VIA | {"joint": "hinge", "within": ["0 rad", "0.5 rad"]}]})
    agree(found, theirs([(made, "/ground")]))
    on, off = ours({"via": [VIA]}), ours({})
    assert_allclose(found, np.where([False, False, True, True, False], on, off))


PLACES = ((5.0, 1.0, 12.0), (7.0, -3.0, 16.0))


def moving(angles: tuple, places: tuple) -> "opensim.MovingPathPoint":
    made = opensim.MovingPathPoint()
    made.setName("via")
    for i, axis in enumerate("xyz"):
        values = opensim.PiecewiseLinearFunction()
        for angle, place in zip(angles, places, strict=True):
            values.addPoint(angle, place[i])
        getattr(made, f"set_{axis}_location")(values)
        made.updSocket(f"{axis}_coordinate").setConnecteePath(COORDINATE)
    return made


CURVE = [
    {"angle": f"{angle} rad", "position": f"{x}, {y}, {z} mm"} for angle, (x, y, z) in zip((-1, 1), PLACES, strict=True)
]
MOVING = VIA | {"joint": "hinge", "curve": CURVE}


def test_a_moving_point_on_a_straight_curve() -> None:
    agree(ours({"via": [MOVING]}), theirs([(moving((-1, 1), PLACES), "/bodyset/frame")]))


@pytest.mark.parametrize(("bone", "body"), [("bottom", "/ground"), ("top", "/bodyset/top")])
def test_opensim_leaves_out_parts_between_points_of_one_body(bone, body) -> None:
    """Where a neighbour of the moving point is on its body, OpenSim's arm is not the slope of its own length, which is ours."""
    mine, other = ours({"via": [MOVING | {"bone": bone}]}), theirs([(moving((-1, 1), PLACES), body)])
    assert_allclose(mine[0], other[0], rtol=1e-12)
    assert np.abs(mine[1] - other[1]).min() > 1


@pytest.mark.parametrize("on_body", [False, True])
@pytest.mark.parametrize("radius", [3.0, 6.0])
def test_around_a_sphere(on_body, radius) -> None:
    ball = opensim.WrapSphere()
    ball.set_radius(radius)
    ball.set_translation(opensim.Vec3(7, 6, 14))
    bone = "top" if on_body else "bottom"
    found = ours({"obstacle": [{"bone": bone, "sphere": {"centre": "7, 6, 14 mm", "radius": f"{radius} mm"}}]})
    agree(found, theirs(wraps=[(ball, on_body)]))


def around_a_cylinder(on_body: bool, rise: float) -> tuple[np.ndarray, np.ndarray]:
    """Ours and theirs around a cylinder along (3, 0, -rise)."""
    roll = opensim.WrapCylinder()
    roll.set_radius(6)
    roll.set_length(200)
    roll.set_translation(opensim.Vec3(7, 6, 14))
    # Its axis is its third; turned about the second by a quarter it is the first.
    roll.set_xyz_body_rotation(opensim.Vec3(0, math.pi / 2 + math.atan2(rise, 3), 0))
    bone = "top" if on_body else "bottom"
    rod = {"start": "7, 6, 14 mm", "end": f"10, 6, {14 - rise} mm", "radius": "6 mm"}
    return ours({"obstacle": [{"bone": bone, "cylinder": rod}]}), theirs(wraps=[(roll, on_body)])


@pytest.mark.parametrize("on_body", [False, True])
def test_around_a_cylinder(on_body, monkeypatch) -> None:
    monkeypatch.setitem(globals(), "END", (START[0], *END[1:]))
    agree(*around_a_cylinder(on_body, 0))


@pytest.mark.parametrize("on_body", [False, True])
def test_a_helix_of_opensim_is_not_quite_the_shortest(on_body) -> None:
    """Where the line climbs along the cylinder, OpenSim's path is longer, and no other than the shortest can be shorter."""
    mine, other = around_a_cylinder(on_body, 1)
    excess = other[0] / mine[0] - 1
    assert excess.min() > -1e-9
    assert 1e-6 < excess.max() < 1e-4
