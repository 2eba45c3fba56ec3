"""Where load steps end between frames: known motions by their keyframes, others as far as they are looked at, and fast solvers."""

from dataclasses import replace

import numpy as np
import pytest
import shapes as surfaces

from fem_reference import effects
from fem_reference.foundations.errors import InputError
from fem_reference.foundations.motion import RigidMotion
from fem_reference.geometry.rigid_bodies import Sphere
from fem_reference.problems import shapes
from fem_reference.problems.body import Body, Prescribed
from fem_reference.problems.contact import ContactBone
from fem_reference.problems.paths import Affine, Follows, From, Rest, Turn
from fem_reference.problems.setup import AttachedVertices, Bone, Setup
from fem_reference.runs.store import Frame, Outcome
from fem_reference.solvers.common.frame_loop import follow
from fem_reference.solvers.common.load_steps import Attempt, StepSizes, march

ALL, STILL = (0, 1, 2), ((0.0, 0.0, 0.0),) * 3
NEO_HOOKE = effects.make("neo_hooke", mu="10 kPa")
ALONG_Z = RigidMotion((0, 0, 1), (0.5, 0.5, 0.0), (0.0, 1.0), (0.0, 2 * np.pi))


def body(head, frames=(0.0, 20.0), foot=None, acting=(NEO_HOOKE,)) -> Body:
    fixed = Prescribed("foot", "z0", ALL, foot or Rest()), Prescribed("head", "z1", ALL, head)
    return Body(shapes.box((1, 1, 1), (1.0, 1.0, 3.0), "hexahedron"), acting, fixed, frames)


BALL = surfaces.sphere(1, 1.0)


def whirl(points: np.ndarray, frame: float) -> np.ndarray:
    """A whole turn by frame 1, as a function that nobody knows."""
    return Turn((0, 0, 1), 2 * np.pi, (0.5, 0.5, 0.0))(points, min(frame, 1.0))


def test_a_whole_turn_is_four_steps_wherever_it_is_among_the_frames() -> None:
    for head in (Follows(ALONG_Z.pose), Follows(From(0.0, ALONG_Z.pose)), Turn((0, 0, 1), 2 * np.pi, (0.5, 0.5, 0.0))):
        assert body(head).stops == pytest.approx([0.25, 0.5, 0.75])
    # As bones of a scene have it.
    bone = Bone("lid", BALL, ALONG_Z)
    assert body(Follows(From(0.0, bone.pose))).stops == pytest.approx([0.25, 0.5, 0.75])
    # What a motion does before the first frame is no part of the path.
    assert body(Follows(From(0.5, ALONG_Z.pose)), frames=(0.5, 20.0)).stops == pytest.approx([0.75])
    hasty = RigidMotion((0, 0, 1), (0.5, 0.5, 0.0), (0.0, 1e-6), (0.0, 2 * np.pi))
    assert body(Follows(hasty.pose)).stops == pytest.approx([0.25e-6, 0.5e-6, 0.75e-6])


def test_a_function_of_the_callers_own_is_looked_at() -> None:
    found = body(whirl).stops
    assert len(found) in (3, 4)
    angles = 2 * np.pi * np.minimum(np.array([0.0, *found, 20.0]), 1.0)
    assert np.diff(angles).max() <= np.pi / 2 + 1e-6


def test_a_turn_beside_a_long_way_counts() -> None:
    """What one region does is not measured by what another does."""
    away = Affine(STILL, (0.0, 0.0, -2.0), ((0.0, 0.0), (20.0, 1.0)))
    assert len(body(whirl, foot=away).stops) >= 3
    assert len(body(Follows(ALONG_Z.pose), foot=away).stops) >= 3


def test_there_and_back_is_two_steps() -> None:
    knots = ((0.0, 0.0), (0.4, 1.0), (1.0, 0.0))
    assert body(Affine(STILL, (0.0, 0.0, 1.0), knots)).stops == pytest.approx([0.4])
    slide = RigidMotion((0, 0, 1), None, (0.0, 0.4, 1.0), (0.0, 1.0, 0.0))
    assert body(Follows(slide.pose)).stops == pytest.approx([0.4])
    # A sine, greatest at 1/4 and 3/4. Of a way w there, what comes back unnoticed, b, has w + b <= 1.12 (w - b) and 1 % of the
    # body's size.
    found = body(lambda points, frame: 0 * points + (0, 0, np.sin(2 * np.pi * frame)), frames=(0.0, 1.0)).stops
    back = [1 - abs(np.sin(2 * np.pi * stop)) for stop in found]
    assert len(found) == 2
    assert max(back) <= (0.12 * 2 + 0.01 * np.sqrt(11)) / 2.12


def test_a_circle_that_turns_nothing_is_followed() -> None:
    def circle(points, frame):
        return 0 * points + (np.cos(2 * np.pi * frame) - 1, np.sin(2 * np.pi * frame), 0.0)

    found = [0.0, *body(circle, frames=(0.0, 1.0)).stops, 1.0]
    assert 0.1 < np.diff(found).max() <= 0.3  # a quarter, and 1 % of the body's size


def test_ramps_that_come_back_are_followed_and_others_ask_for_nothing() -> None:
    def pressure(*ramp):
        knots = [{"frame": frame, "amount": amount} for frame, amount in ramp]
        return (NEO_HOOKE, effects.make("pressure", on="z1", pressure="1 kPa", ramp=knots))

    assert body(Rest(), acting=pressure((0, 0), (0.5, 1), (1, 0))).stops == (0.5,)
    assert body(Rest(), acting=pressure((0, 0), (0.5, 0.9), (20, 1))).stops == ()
    assert body(Rest()).stops == ()


def test_bones_are_followed() -> None:
    ball = ContactBone("ball", Sphere((0.0, 0.0, 9.0), 1.0), ALONG_Z.pose)
    assert replace(body(Rest()), bones=(ball,)).stops == pytest.approx([0.25, 0.5, 0.75])


def test_what_all_do_alike_is_no_travel_and_the_rest_is_bounded_by_the_size() -> None:
    far = Affine(STILL, (0.0, 0.0, 1e6))
    assert body(far, (0.0, 1.0), foot=far).stops == ()
    apart = Affine(STILL, (0.0, 0.0, 20 * np.sqrt(11.0)))  # each ten sizes from their middle
    found = body(apart, (0.0, 1.0)).stops
    assert np.diff([0.0, *found, 1.0]).max() <= 0.1 + 1e-9
    assert len(found) < 25


@pytest.mark.slow
@pytest.mark.parametrize(
    ("path", "message"),
    [
        (
            lambda points, frame: points * (np.nan if frame > 3 else 0),
            r'"head": path at frame 3\.\d*: got nan, want finite',
        ),
        (
            lambda points, frame: 0 * points + (2.0 if frame > 3 else 0),
            r'"head": path at frame 3: got movement by up to 3.464 mm and rotation by 0 rad by frame 3,',
        ),
        (lambda points, _: points[:, 0], r'"head": path at frame 0: got displacements \(4,\) of points \(4, 3\)'),
        (lambda points, _: points @ [1.0], r'"head": path at frame 0: got ValueError: matmul'),
        (Turn((0, 0, 1), 1e300), r'"head": path: got 1e\+300 rad of rotation, want at most 3927 rad'),
        (
            Affine(STILL, (0.0, 0.0, 1e300)),
            r'"head": path at frame 0: got movement by up to .*, want a path without',
        ),
    ],
)
def test_what_nobody_can_follow_is_refused(path, message) -> None:
    with pytest.raises(InputError, match=message):
        _ = body(path).stops


def test_steps_end_at_stops_and_nothing_is_recalled_across_one() -> None:
    tried, asked = [], []
    steps = StepSizes(10.0, 0.5, stops=(2.5, 5.0, 10.0))

    def recall(frame):
        asked.append((frame, len(tried)))
        return False

    reached = list(march(lambda at: tried.append(at) or Attempt("converged", 2), (0, 10, 20), steps, recall))
    assert tried == [2.5, 5.0, 10.0, 20.0]
    assert [entry.steps for entry in reached] == [3, 1]
    assert asked == [(10, 2), (20, 3)]


class Counting:
    """A model that does nothing."""

    advice = "another model"

    def __init__(self) -> None:
        self.cost = dict[str, float]()

    def move(self, number: int) -> None:
        pass

    def trouble(self) -> None:
        return None

    def frame(self, number: int) -> Frame:
        return Frame(number, None)

    def ending(self) -> Outcome:
        return Outcome("converged", "all")


def setup(motion, frames=(0, 5, 20)) -> Setup:
    surface = BALL
    bone = Bone("lid", surface, motion)
    return Setup(surface, (bone,), (AttachedVertices("top", bone, np.array([0, 1])),), frames, None)


@pytest.mark.parametrize(
    ("motion", "parts", "seen"),
    [
        (RigidMotion((0, 0, 1), (0, 0, 0), (0.0, 1.0), (0.0, 2 * np.pi)), 1, False),
        (RigidMotion((0, 0, 1), (0, 0, 0), (0.0, 1.0), (0.0, 2 * np.pi)), 4, True),
        (RigidMotion((0, 0, 1), (0, 0, 0), (0.0, 1.0), (0.0, 2 * np.pi)), 40, True),
        (RigidMotion((0, 0, 1), (0, 0, 0), (0.0, 4.0), (0.0, 2 * np.pi)), 1, True),
        (RigidMotion((0, 0, 1), (0, 0, 0), (0.0, 4.0), (0.0, 2.1 * np.pi)), 1, False),
        (RigidMotion((0, 0, 1), None, (0.0, 6.5, 7.0), (0.0, 1.0, 0.5)), 1, False),
        (RigidMotion((0, 0, 1), None, (0.0, 6.0, 7.0), (0.0, 1.0, 0.5)), 1, True),
        (None, 1, True),
    ],
)
def test_solvers_that_go_from_frame_to_frame_skip_nothing(motion, parts, seen) -> None:
    frames = list[Frame]()
    outcome = follow(Counting(), setup(motion), frames.append, parts)
    assert outcome.status == ("converged" if seen else "out of steps")
    assert [frame.number for frame in frames] == ([0, 5, 20] if seen else [0])
    if not seen:
        assert 'bone "lid" turns by more than a right angle' in outcome.message
