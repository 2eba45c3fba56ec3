"""Lines of action against closed forms, and through the run store, the comparison and the page: a run without a surface."""

import csv
import json
import math
import re
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import shapes
import small
from numpy.testing import assert_allclose
from scipy.spatial.transform import Rotation as Turn

from fem_reference.cli import main
from fem_reference.foundations.errors import InputError
from fem_reference.foundations.mesh import Polylines, Surface
from fem_reference.foundations.motion import RigidMotion, apply
from fem_reference.foundations.records import parse
from fem_reference.problems.muscle import MuscleProblem
from fem_reference.problems.setup import AttachedVertices, Bone, Joint
from fem_reference.report import gallery
from fem_reference.runs.store import Frame, Outcome
from fem_reference.solvers import line_of_action
from fem_reference.solvers.common.hill import Hill
from fem_reference.studies import execution, workflow

pytestmark = pytest.mark.slow

SWING = RigidMotion((1, 0, 0), (5, 25, 15), (0.0, 10.0), (0.0, 1.2))


def bar(motion=SWING, points: int = 41, bottom=None) -> MuscleProblem:
    """The bar of the contract, 30 mm long, with one fibre of many points that is bent at rest, and one straight."""
    given = shapes.bar((2, 2, 4), (10, 10, 30), {"bottom": bottom, "top": motion}, (), (0, 5, 10))
    heights = np.linspace(0, 30, points)
    bent = np.column_stack([np.full(points, 5.0), 5 + 4 * np.sin(math.pi * heights / 30), heights])
    straight = np.column_stack([np.full(points, 4.0), np.full(points, 5.0), heights[::-1]])
    counter = Joint(
        "counter", given.bones[0], np.array([1.0, 0, 0]), np.zeros(3), float
    )  # its angle is the frame's number
    fibres = Polylines(np.vstack([bent, straight]), np.array([0, points, 2 * points]))
    return replace(given, fibres=fibres, joints=(counter,))


def solved(given: MuscleProblem, **settings: object) -> tuple[Outcome, list[Frame]]:
    frames: list[Frame] = []
    record = parse(line_of_action.LineSettings, settings, "candidate[0]")
    return line_of_action.solve(given, record, frames.append), frames


def lengths(given: MuscleProblem, frames: list[Frame]) -> np.ndarray:
    return np.array([given.fibres.lengths(frame.fibres) for frame in frames])


def test_points_spread_evenly_are_those_that_a_scene_would_name() -> None:
    given = bar()
    named = solved(given, via=[{"at": 0.25, "bone": "bottom"}, {"at": 0.75, "bone": "top"}])[1]
    spread = solved(given, via_count=2)[1]
    # The second fibre runs from the top down, so that its points named by bone are on the wrong one.
    assert_allclose(lengths(given, spread)[:, 0], lengths(given, named)[:, 0], rtol=1e-12)
    assert lengths(given, spread)[2, 1] < lengths(given, named)[2, 1]
    with pytest.raises(InputError, match='at most one of "via", "via_count"'):
        solved(given, via=[{"at": 0.5, "bone": "top"}], via_count=1)


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
        InputError, match=r"obstacle\[0\]: got a fixed point of line 0 2 mm inside, want an obstacle with all"
    ):
        solved(bar(), obstacle=[{"bone": "bottom", "sphere": inside}])
    down = RigidMotion((0, 0, -1), None, (0.0, 10.0), (0.0, 20.0))
    outcome, frames = solved(bar(down), obstacle=[{"bone": "bottom", "sphere": inside | {"centre": "5, 5, 12 mm"}}])
    assert outcome.status == "diverged"
    assert outcome.message == "frame 10: a fixed point of line 0 2 mm inside; a smaller radius may help"
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


CANDIDATES = """
[[candidate]]
name = "line"
solver = "line_of_action"

[[candidate]]
name = "around"
solver = "line_of_action"
obstacle = [{ bone = "floor", sphere = { centre = "5, 5, 20 mm", radius = "3 mm" } }]

[[candidate]]
name = "springs"
solver = "mass_spring"
stiffness = "1 N/mm"
density = "1060 kg/m3"
frame_time = "10 ms"
damping = "eq. 5.5"
"""
EXPECTED = """
[[expect]]
of = "candidates"
metric = "{metric}"
statistic = "max"
frame = "any"
truth = "0 mm"
within = "{within} mm"
kind = "property"
because = "tested here"
"""


def scene(folder: Path) -> Path:
    """The small scene with mass-spring as its reference, which takes no finite elements, and lines among the candidates."""
    small.write(folder)
    text = (folder / "case.toml").read_text()
    head, rest = text.split("[[candidate]]")[0], text[text.index("[[expect]]") :]
    reference = 'solver = "mass_spring"\nstiffness = "1 N/mm"\ndensity = "1060 kg/m3"\nframe_time = "20 ms"\n'
    head = head.replace('solver = "fenicsx"\nfirst_step = 5\n', reference + 'damping = "0.01 N s/m"\n')
    expected = EXPECTED.format(metric="surface_deviation", within=5) + EXPECTED.format(metric="fibre_length", within=9)
    rest = rest.replace('within = "0.5 %"', 'within = "50 %"').replace(
        "[negative_control]", expected + "\n[negative_control]"
    )
    (folder / "case.toml").write_text(head + CANDIDATES + rest)
    return folder


SPHERE = 'name = "line"\nobstacle = [{{ bone = "{}", sphere = {{ centre = "{}", radius = "6 mm" }} }}]\n'
MULTIGRID_ON_TWO_RANKS = 'name = "line"\nsolver = "fenicsx"\nranks = 2\nlinear_solver = "multigrid"'
SPHERE_ON_NOTHING, SPHERE_AROUND_THE_END = SPHERE.format("skull", "5, 5, 20 mm"), SPHERE.format("lid", "5, 5, 40 mm")


@pytest.fixture(scope="module")
def compared(tmp_path_factory) -> tuple[dict, Path]:
    folder = tmp_path_factory.mktemp("lines")
    printed = folder / "printed.json"
    case = scene(folder / "bar")
    with pytest.MonkeyPatch.context() as patch:  # pictures take seconds, and lines are in none
        patch.setattr(gallery, "program", lambda _job, _folder: [sys.executable, "-c", "raise SystemExit(3)"])
        assert main(["compare", str(case), "--out", str(folder / "out"), "--json", str(printed), "--quiet"]) == 0
    return json.loads(printed.read_text()), folder / "out"


def test_lines_are_measured_and_judged_on_their_lengths_alone(compared) -> None:
    printed, _ = compared
    metrics = {
        name: {row["metric"] for row in printed["measures"] if row["candidate"] == name} for name in printed["cost"]
    }
    assert metrics["line"] == metrics["around"] == {"fibre_ends", "fibre_length", "moment_arm"}
    assert {"fibre_length", "surface_deviation", "volume", "penetration"} <= metrics["springs"]
    judged = {(row["of"], row["metric"]): row["verdict"] for row in printed["verdicts"]}
    assert judged == {
        ("reference", "volume"): "pass",
        ("springs", "surface_deviation"): "pass",
        ("springs", "fibre_length"): "pass",
        ("line", "fibre_length"): "pass",
        ("around", "fibre_length"): "pass",
    }
    assert {row["candidate"] for row in printed["from_rest"] if row["metric"] == "volume"} == {"reference", "springs"}


def test_a_line_is_shorter_than_its_fibre_at_rest_already(compared) -> None:
    printed, out = compared
    rows = {
        (row["candidate"], row["statistic"]): row["value"]
        for row in printed["measures"]
        if row["frame"] == 0 and row["metric"] == "fibre_length" and row["value"] is not None
    }
    assert rows["springs", "max"] == pytest.approx(0, abs=1e-9)
    assert -1 < rows["line", "mean"] < -0.01  # fibres of a bulging bar are bent
    assert rows["around", "mean"] > rows["line", "mean"]
    written = list(csv.DictReader((out / "bar" / "measures.csv").read_text().splitlines()))
    assert {row["metric"] for row in written if row["candidate"] == "line"} == {
        "fibre_ends",
        "fibre_length",
        "moment_arm",
    }
    assert all(row["value"] for row in written)


def test_the_page_shows_a_dash_and_says_that_there_is_no_surface(compared) -> None:
    _, out = compared
    text = (out / "bar" / "report.html").read_text(encoding="utf-8")
    for name in ("line", "around"):
        assert f"<b>{name}</b> has no surface to draw" in text
        row = text.split(f"<th>{name}<small>line_of_action</small></th>")[1].split("</tr>")[0]
        assert row.count("<td>\N{EN DASH}</td>") == 6  # of 8 columns of measures two are of fibres
        assert " ms</td>" in row  # the time of a frame is known
    assert "A row of dashes means that the solver computes only lines" in text
    assert "Surface of springs: distance to the reference" in text
    assert "Surface of line: distance to the reference" not in text
    assert "has no frame whose coordinates" not in text


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ('name = "line"\n', 'name = "line"\nvia = [{ at = 0.5, bone = "skull" }]\n', 'via[0].bone: got "skull", want one of'),
        ('name = "line"\n', SPHERE_ON_NOTHING, 'obstacle[0].bone: got "skull", want one of floor, lid'),
        ('name = "line"\n', SPHERE_AROUND_THE_END, "an obstacle with all of them outside"),
        ('name = "line"\nsolver = "line_of_action"', MULTIGRID_ON_TWO_RANKS, "ranks: got 2, want 1"),
    ],
)  # fmt: skip
def test_what_a_candidate_cannot_have_is_refused_before_the_reference_is_solved(
    old, new, message, tmp_path, capsys, monkeypatch
) -> None:
    case, out = scene(tmp_path / "bar"), tmp_path / "out"
    monkeypatch.setattr(execution, "Writer", lambda *_: pytest.fail("something was solved"))
    text = (case / "case.toml").read_text()
    assert old in text
    (case / "case.toml").write_text(text.replace(old, new, 1))
    for verb in ("validate", "run", "compare"):
        words = [verb, str(case), "--out", str(out), "--quiet"]
        assert main(words) == 2
        printed = capsys.readouterr().err
        assert message in printed, verb
        assert "case.toml: candidate[0]." in printed, verb
    with pytest.raises(InputError, match=re.escape(message)):
        workflow.solve(workflow.load_case(case), store=out)
    assert not out.exists()


def test_a_reference_of_lines_alone_is_refused(tmp_path, capsys) -> None:
    case = scene(tmp_path / "bar")
    text = (case / "case.toml").read_text()
    head, tail = text[: text.index("[reference]")], text[text.index("[[candidate]]") :]
    (case / "case.toml").write_text(head + '[reference]\nsolver = "line_of_action"\n' + tail)
    assert main(["compare", str(case), "--candidate", "line", "--out", str(tmp_path / "out"), "--quiet"]) == 2
    assert (
        "reference: surface: got a run of lines alone, want a reference that moves the surface"
        in capsys.readouterr().err
    )


def test_the_ends_are_attached_by_the_bones_of_the_nearest_attachments() -> None:
    given = bar()
    spare = Bone("spare", given.bones[0].surface, RigidMotion((1, 0, 0), None, (0.0, 10.0), (0.0, 50.0)))
    _, frames = solved(replace(given, bones=(spare, *given.bones)))
    assert_allclose(frames[-1].fibres, solved(given)[1][-1].fibres, atol=1e-12)


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
