"""Lines of action against closed forms."""

import math
from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from fem_reference.foundations.errors import InputError
from fem_reference.foundations.motion import RigidMotion, apply
from fem_reference.problems.setup import Bone
from tests.line_bar import SWING, bar, lengths, solved

pytestmark = pytest.mark.slow


def test_points_spread_evenly_are_those_that_a_scene_would_name() -> None:
    given = bar()
    named = solved(given, via=[{"at": 0.25, "bone": "bottom"}, {"at": 0.75, "bone": "top"}])[1]
    spread = solved(given, via_count=2)[1]
    # The second fibre runs from the top down, so that its points named by bone are on the wrong one.
    assert_allclose(lengths(given, spread)[:, 0], lengths(given, named)[:, 0], rtol=1e-12)
    assert lengths(given, spread)[2, 1] < lengths(given, named)[2, 1]
    with pytest.raises(InputError, match='at most one of "via", "via_count"'):
        solved(given, via=[{"at": 0.5, "bone": "top"}], via_count=1)


def test_more_points_than_a_fibre_has_are_refused_before_they_are_spread() -> None:
    for count in (10**3, 2**40):  # as many as would not fit into memory
        with pytest.raises(InputError, match=rf"via_count: got fibre 0 of \d+ points, want .* {count + 2} points"):
            solved(bar(), via_count=count)


def test_the_more_points_the_nearer_to_the_fibre_at_rest() -> None:
    given = bar()
    off = [given.fibres.lengths()[0] - lengths(given, solved(given, via_count=n)[1])[0, 0] for n in (0, 2, 4, 8)]
    # Chords of a smooth curve are short by the square of their length.
    assert off[0] > off[1] > 3 * off[2] > 9 * off[3] > 0


def test_a_straight_line_is_between_ends_that_go_with_their_bones() -> None:
    given = bar()
    outcome, frames = solved(given)
    assert outcome.status == "converged"
    assert outcome.message == "2 lines, straight; no surface"
    assert [frame.number for frame in frames] == [0, 5, 10]
    assert all(frame.surface is None and len(frame.points) == 0 for frame in frames)
    for frame in frames:
        # The first fibre ends on top, the second begins there.
        tops = apply(SWING.pose(frame.number), np.array([[5.0, 5, 30], [4, 5, 30]]))
        expected = [np.linspace([5, 5, 0], tops[0], 41), np.linspace(tops[1], [4, 5, 0], 41)]
        assert_allclose(frame.fibres, np.vstack(expected), atol=1e-12)
    # At rest a line is as long as the chord of its fibre.
    assert_allclose(lengths(given, frames)[0], [30, 30], rtol=1e-13)
    assert given.fibres.lengths()[0] > 31


def test_via_points_go_with_their_bones() -> None:
    given = bar(bottom=RigidMotion((0, 1, 0), None, (0.0, 10.0), (0.0, 3.0)))
    outcome, frames = solved(given, via=[{"at": 0.25, "bone": "bottom"}, {"at": 0.5, "bone": "top"}])
    assert outcome.message == "2 lines, straight, through 2 via-points; no surface"
    low, high = given.fibres.points[20], given.fibres.points[61]  # the middles of both fibres
    for frame in frames:
        up, down = SWING.pose(frame.number), given.attached[0].bone.pose(frame.number)
        assert_allclose(frame.fibres[20], apply(up, low[None])[0], atol=1e-10)
        assert_allclose(frame.fibres[61], apply(up, high[None])[0], atol=1e-10)
        # A quarter along the straight fibre, which begins at the top, at z = 22.5.
        quarter = apply(down, np.array([[4.0, 5, 22.5]]))
        path = np.vstack(
            [apply(up, np.array([[4.0, 5, 30]])), quarter, apply(up, high[None]), apply(down, [[4.0, 5, 0]])]
        )
        assert_allclose(given.fibres.lengths(frame.fibres)[1], np.linalg.norm(np.diff(path, axis=0), axis=1).sum())


@pytest.mark.parametrize("radius", [4, 9])
def test_around_a_sphere_it_is_as_long_as_the_closed_form(radius) -> None:
    # Two ends 15 mm off the centre, opposite each other: tangents of sqrt(d^2 - r^2) and r (pi - 2 acos(r / d)).
    given = bar(motion=None, points=2001)
    outcome, frames = solved(
        given, obstacle=[{"bone": "top", "sphere": {"centre": "5, 5, 15 mm", "radius": f"{radius} mm"}}]
    )
    assert outcome.message == "2 lines, straight or around the sphere on top; no surface"
    exact = 2 * math.sqrt(225 - radius**2) + radius * (math.pi - 2 * math.acos(radius / 15))
    found = lengths(given, frames)
    # 2000 chords, each turning by less than 0.01: shorter by less than 0.01^2 / 24 = 4e-6.
    assert_allclose(found[:, 0], exact, rtol=4e-6)
    assert np.linalg.norm(frames[0].fibres - [5, 5, 15], axis=1).min() > radius - 1e-9
    # Points fewer than that lose length, and the frame says how much.
    coarse = bar(motion=None, points=11)
    _, few = solved(coarse, obstacle=[{"bone": "top", "sphere": {"centre": "5, 5, 15 mm", "radius": f"{radius} mm"}}])
    assert_allclose(few[0].scalars["lost_by_chords_max"], exact - coarse.fibres.lengths(few[0].fibres)[0], rtol=1e-9)
    assert 1e-3 < few[0].scalars["lost_by_chords_max"] < 0.5


@pytest.mark.parametrize(
    "obstacle",
    [
        {"obstacle": [{"bone": "bottom", "sphere": {"centre": "5, 8, 15 mm", "radius": "6 mm"}}]},
        {
            "obstacle": [
                {"bone": "bottom", "cylinder": {"start": "0, 7, 12 mm", "end": "1, 7, 13 mm", "radius": "6 mm"}}
            ]
        },
        {"via": [{"at": 0.4, "bone": "bottom"}]},
        {},
    ],
)
def test_what_moves_as_a_whole_keeps_its_lengths(obstacle) -> None:
    given = bar(SWING, bottom=SWING)
    _, frames = solved(given, **obstacle)
    for frame in frames[1:]:
        assert_allclose(frame.fibres, apply(SWING.pose(frame.number), frames[0].fibres), atol=1e-10)
    assert (frames[0].scalars["lost_by_chords_max"] > 1e-6) == ("obstacle" in obstacle)


def test_a_cylinder_is_wrapped_where_the_line_comes_to_it() -> None:
    """A cylinder beside the lines, of which one is pulled over: straight before, longer than straight after."""
    given = bar(RigidMotion((0, 1, 0), None, (0.0, 10.0), (0.0, 20.0)))
    roll = {"bone": "bottom", "cylinder": {"start": "0, 14, 15 mm", "end": "10, 14, 15 mm", "radius": "5 mm"}}
    outcome, frames = solved(given, obstacle=[roll])
    assert outcome.message == "2 lines, straight or around the cylinder on bottom; no surface"
    straight, wrapped = lengths(given, solved(given)[1]), lengths(given, frames)
    assert_allclose(wrapped[0], straight[0], rtol=1e-13)
    assert (wrapped[2] > straight[2] + 0.1).all()


def test_points_are_shared_out_so_that_via_points_are_among_them() -> None:
    # Four points of a fibre, two via-points close to its end: each part has a point at both of its ends.
    given = bar(motion=None, points=4)
    _, frames = solved(given, via=[{"at": 0.98, "bone": "top"}, {"at": 0.99, "bone": "top"}])
    assert_allclose(frames[0].fibres[4:, 2], 30 * (1 - np.array([0, 0.98, 0.99, 1])), atol=1e-12)


def test_cost() -> None:
    outcome, _ = solved(bar())
    assert outcome.cost["iterations"] == 3
    assert (outcome.cost["threads"], outcome.cost["seconds_compile"]) == (1, 0)
    assert 0 < outcome.cost["seconds_solve"] == pytest.approx(3 * outcome.cost["seconds_per_iteration"])


def test_an_end_inside_an_obstacle_is_refused_at_rest_and_an_outcome_later() -> None:
    inside = {"centre": "5, 5, 28 mm", "radius": "4 mm"}
    with pytest.raises(
        InputError,
        match=r"obstacle\[0\]: got a fixed point 2 mm inside the obstacle \(line 0\), want an obstacle with all",
    ):
        solved(bar(), obstacle=[{"bone": "bottom", "sphere": inside}])
    down = RigidMotion((0, 0, -1), None, (0.0, 10.0), (0.0, 20.0))
    outcome, frames = solved(bar(down), obstacle=[{"bone": "bottom", "sphere": inside | {"centre": "5, 5, 12 mm"}}])
    assert outcome.status == "diverged"
    assert outcome.message == "frame 10: a fixed point 2 mm inside the obstacle (line 0); a smaller radius may help"
    assert [frame.number for frame in frames] == [0, 5]


BALL = {"centre": "5, 5, 15 mm", "radius": "4 mm"}
ROLL = {"start": "0, 0, 0 mm", "end": "0, 0, 1 mm", "radius": "4 mm"}


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"via": [{"at": 0.5, "bone": "skull"}]}, r'via\[0\]\.bone: got "skull", want one of bottom, top'),
        (
            {"obstacle": [{"bone": "skull", "sphere": BALL}]},
            r'obstacle\[0\]\.bone: got "skull", want one of bottom, top',
        ),
        (
            {"obstacle": [{"bone": "skull", "cylinder": ROLL}]},
            r'obstacle\[0\]\.bone: got "skull", want one of bottom, top',
        ),
        (
            {"obstacle": [{"bone": "top", "sphere": BALL, "cylinder": ROLL}]},
            'one of "sphere", "cylinder", "ellipsoid", "torus"',
        ),
        (
            {"via": [{"at": 0.5, "bone": "top"}, {"at": 0.5, "bone": "top"}]},
            "in the order in which a fibre passes them",
        ),
        ({"via": [{"at": 1.0, "bone": "top"}]}, r"via\[0\]\.at: got 1\.0, want less than 1"),
        (
            {"obstacle": [{"bone": "top", "sphere": BALL | {"radius": "0 mm"}}]},
            r'sphere\.radius: got "0 mm", want more than zero',
        ),
    ],
)
def test_settings_that_are_refused(settings, message) -> None:
    with pytest.raises(InputError, match=message):
        solved(bar(), **settings)


def test_too_few_points_and_no_attachment_are_refused() -> None:
    with pytest.raises(
        InputError, match="via: got fibre 0 of 2 points, want fibres of at least 3 points for 1 via-points"
    ):
        solved(bar(points=2), via=[{"at": 0.5, "bone": "top"}])
    with pytest.raises(InputError, match="a muscle without attachments, want attachments to which lines are fixed"):
        solved(replace(bar(), attached=()))


def test_the_ends_are_attached_by_the_bones_of_the_nearest_attachments() -> None:
    given = bar()
    spare = Bone("spare", given.bones[0].surface, RigidMotion((1, 0, 0), None, (0.0, 10.0), (0.0, 50.0)))
    _, frames = solved(replace(given, bones=(spare, *given.bones)))
    assert_allclose(frames[-1].fibres, solved(given)[1][-1].fibres, atol=1e-12)
