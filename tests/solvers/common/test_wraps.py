"""Obstacles on bones: the same body as a case of a more general one, what is refused, and what is inside."""

import numpy as np
import pytest
import shapes
from numpy.testing import assert_allclose

from fem_reference.foundations.errors import InputError
from fem_reference.foundations.motion import RigidMotion, apply
from fem_reference.foundations.records import parse
from fem_reference.problems.muscle import MuscleProblem
from fem_reference.solvers.common.wraps import ObstacleOn, Wraps, wraps_of

pytestmark = pytest.mark.slow  # tetrahedra of a bar

SWING = RigidMotion((1, 0, 0), (5, 25, 15), (0.0, 10.0), (0.0, 1.2))
BALL = {"bone": "top", "sphere": {"centre": "5, 5, 15 mm", "radius": "4 mm"}}
EGG = {"bone": "top", "ellipsoid": {"centre": "5, 5, 15 mm", "radii": ["4 mm"] * 3, "turn": "10, 0, 30 deg"}}
RING = {"bone": "top", "torus": {"centre": "5, 5, 15 mm", "axis": [0, 1, 0], "radius": "6 mm", "tube": "2 mm"}}


@pytest.fixture(scope="module")
def given() -> MuscleProblem:
    return shapes.bar((1, 1, 2), (10, 10, 30), {"bottom": None, "top": SWING}, (), (0, 10))


def wraps(given: MuscleProblem, *obstacles: dict) -> Wraps:
    made = tuple(parse(ObstacleOn, one, "obstacle") for one in obstacles)
    return wraps_of(given, made, "")


FIXED = np.array([[[5.0, 4, 0], [6, 4, 30]], [[4.0, 6, 1], [5, 5.5, 29]], [[14.0, 6, 1], [15, 6, 29]]])


def test_a_ball_is_an_ellipsoid_of_equal_axes_and_one_of_two(given) -> None:
    """The closed form beside Newton's method, on a bone that has turned; another obstacle far away changes nothing."""
    closed = wraps(given, BALL).around(FIXED, 10)
    far = {"bone": "bottom", "sphere": {"centre": "500, 5, 15 mm", "radius": "4 mm"}}
    for others in ([EGG], [BALL, far], [far, BALL]):
        found = wraps(given, *others).around(FIXED, 10)
        assert not found.failed.any()
        assert_allclose(found.lengths, closed.lengths, rtol=1e-7)
    rest = wraps(given, BALL).around(FIXED, 0)
    assert (rest.lengths[:2] > np.linalg.norm(FIXED[:2, 1] - FIXED[:2, 0], axis=1) + 0.1).all()
    assert_allclose(rest.lengths[2], np.linalg.norm(FIXED[2, 1] - FIXED[2, 0]))


def test_a_cylinder_is_one_of_two(given) -> None:
    roll = {"bone": "bottom", "cylinder": {"start": "0, 5, 15 mm", "end": "1, 5, 15.5 mm", "radius": "4 mm"}}
    far = {"bone": "bottom", "sphere": {"centre": "500, 5, 15 mm", "radius": "4 mm"}}
    assert_allclose(
        wraps(given, roll, far).around(FIXED, 0).lengths, wraps(given, roll).around(FIXED, 0).lengths, rtol=1e-7
    )


def test_what_is_deepest_inside_is_named(given) -> None:
    # In the tube of the ring, 6 mm from its axis: at its middle. From the ball it is 2 mm away.
    fixed = FIXED.copy()
    fixed[1, 1] = [11, 5, 16.5]
    name, message = wraps(given, BALL, RING).inside(fixed, 0)
    assert name == "obstacle[1]"
    assert message.endswith(" inside the obstacle (line 1)")
    assert wraps(given, BALL, RING).inside(FIXED, 0) == ("", "")
    fixed[1, 1] = [5, 5, 18]
    assert wraps(given, BALL, RING).inside(fixed, 0) == (
        "obstacle[0]",
        "a fixed point 1 mm inside the obstacle (line 1)",
    )


def test_what_an_obstacle_is_moved_to_is_inside(given) -> None:
    """A ball of 4 mm, 20 mm off the axis that its bone turns about: inside it is what its centre has come to, not where it was."""
    centre = apply(SWING.pose(10), np.array([[5.0, 5, 15]]))[0]
    fixed = np.array([[[5.0, 4, 0], centre]])
    assert wraps(given, BALL).inside(fixed, 10) == ("obstacle[0]", "a fixed point 4 mm inside the obstacle (line 0)")
    assert wraps(given, BALL).inside(fixed, 0) == ("", "")
    assert wraps(given, BALL).inside(np.array([[[5.0, 4, 0], [5, 5, 15]]]), 10) == ("", "")


@pytest.mark.parametrize(
    ("obstacle", "message"),
    [
        ({"bone": "top"}, 'one of "sphere", "cylinder", "ellipsoid", "torus"'),
        (BALL | EGG, 'one of "sphere", "cylinder", "ellipsoid", "torus"'),
        (BALL | {"bone": "skull"}, r'obstacle\[0\]\.bone: got "skull", want one of bottom, top'),
        ({"bone": "top", "torus": RING["torus"] | {"tube": "6 mm"}}, '"tube" less than "radius"'),
        ({"bone": "top", "torus": RING["torus"] | {"axis": [0, 0, 0]}}, "an axis that is not zero"),
        ({"bone": "top", "ellipsoid": EGG["ellipsoid"] | {"turn": "3 mm"}}, "three angles with one unit"),
        ({"bone": "top", "ellipsoid": EGG["ellipsoid"] | {"radii": ["1 mm", "0 mm", "1 mm"]}}, "more than zero"),
    ],
)
def test_obstacles_that_are_refused(given, obstacle, message) -> None:
    with pytest.raises(InputError, match=message):
        wraps(given, obstacle)
