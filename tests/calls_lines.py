"""Lines, rods and Gaussians with settings that anybody may give, damaged at random, and a second look at what they answer."""

import math
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import shapes
from calls_paths import lengths, mostly, obstacles, outside, points
from hypothesis import strategies as st
from odd import odd, rarely

from fem_reference.foundations.mesh import Floats, Polylines, Surface
from fem_reference.foundations.motion import RigidMotion, apply
from fem_reference.foundations.records import parse
from fem_reference.geometry.rigid_bodies import Sphere
from fem_reference.problems.muscle import MuscleProblem
from fem_reference.problems.setup import Joint
from fem_reference.runs.store import Frame, Outcome
from fem_reference.solvers import line_of_action, rbf_muscle, viper

SWING = RigidMotion((1, 0, 0), (5, 25, 15), (0.0, 10.0), (0.0, 1.2))
MOTIONS = [
    SWING,
    None,
    RigidMotion((0, 0, 1), (5, 5, 0), (0.0, 10.0), (0.0, 1.0)),
    RigidMotion((0, 0, 1), None, (0.0, 10.0), (0.0, 9.0)),
]
MOTIONS += [
    RigidMotion((1, 0, 0), (5, 25, 15), (0.0, 5.0, 10.0), (0.0, 1.2, 0.0)),
    RigidMotion((1, 0, 0), (5, 5, 15), (0.0, 10.0), (0.0, 3.0)),
]


@st.composite
def vias(draw: Any) -> Any:
    """A via-point, or something like it."""
    found: dict[str, Any] = {
        "at": draw(mostly([0.2, 0.4, 0.5, 0.7], [0, 1, -0.1, math.nan, 1e-320, 1 - 1e-16])),
        "bone": draw(mostly(["bottom", "top"], ["x"])),
    }
    kind = draw(st.integers(0, 3))
    if kind == 1:
        found |= {
            "joint": draw(mostly(["counter"], ["x"])),
            "within": draw(
                mostly([["1 rad", "6 rad"], ["-9 rad", "0 rad"]], [["6 rad", "1 rad"], ["nan rad", "1 rad"], ["1 rad"]])
            ),
        }
    if kind == 2:
        angles = draw(
            mostly(
                [["0 rad", "5 rad"], ["2 rad", "3 rad", "8 rad"]],
                [["1 rad"], ["3 rad", "2 rad"], ["1 rad", "1 rad"], ["0 rad", "1e-300 rad"], ["0 rad", "1e6 rad"], []],
            )
        )
        if isinstance(angles, list):
            angles = [{"angle": angle, "position": draw(points())} for angle in angles]
        found |= {"joint": "counter", "curve": angles}
    return draw(odd) if rarely(draw, 60) else found


@st.composite
def hills(draw: Any) -> Any:
    """The muscles of lines, or something like them."""
    found = {
        "max_force": draw(mostly(["100 N", "1 kN"], ["1e-30 N", "1e15 N", "0 N", "-1 N", 100])),
        "fibre_share": draw(mostly([0.3, 0.6, 0.95], [0, 1, 1e-12, 1e-320, 1 - 1e-16, math.nan])),
        "pennation": draw(mostly(["0 deg", "20 deg", "68 deg"], ["-1 deg", "70 deg", "nan deg", "1e-300 deg"])),
        "activation": draw(mostly([0.0, 0.5, 1.0], [-0.1, 1.1, math.nan, 1e-320])),
    }  # fmt: skip
    return draw(odd) if rarely(draw, 60) else found


def fibres(count: int = 41) -> list[Floats]:
    """A fibre that is bent at rest, and a straight one from the top down."""
    heights = np.linspace(0, 30, count)
    bent = np.column_stack([np.full(count, 5.0), 5 + 4 * np.sin(math.pi * heights / 30), heights])
    return [bent, np.column_stack([np.full(count, 4.0), np.full(count, 5.0), heights[::-1]])]


@st.composite
def muscles(draw: Any) -> MuscleProblem:
    """A bar with a few fibres, such as files have, and a joint whose angle is the number of the frame."""
    motions = {"bottom": draw(st.sampled_from([None] * 4 + MOTIONS)), "top": draw(st.sampled_from([SWING, *MOTIONS]))}
    frames = draw(
        st.sampled_from(
            [(0, 5, 10), (0, 10), (0, 10), (0, 4), (0, 4), (0, 4)] + [(0, 1), (3, 4), (0, 10**9), (0, 5 * 10**5)]
        )
    )
    given = shapes.bar((2, 2, 4), (10, 10, 30), motions, (), frames)
    lines = draw(
        st.sampled_from(
            [fibres()] * 4
            + [fibres()[:1], fibres(2), fibres(5), [fibres()[0][[0, 0, 20, 20, 40]]], [fibres()[0], 1e-6 * fibres()[1]]]
        )
    )
    solid = Sphere((5.0, 22.0, 15.0), 6.0)
    bones = tuple(
        replace(bone, solid=solid, surface=Surface(np.eye(3) + [5, 22, 15], bone.surface.triangles))
        for bone in given.bones
    )
    attached = tuple(replace(one, bone=bone) for one, bone in zip(given.attached, bones, strict=True))
    counter = Joint("counter", bones[0], np.array([1.0, 0, 0]), np.zeros(3), float)
    ends = np.cumsum([0, *(len(line) for line in lines)])
    return replace(
        given, bones=bones, attached=attached, fibres=Polylines(np.concatenate(lines), ends), joints=(counter,)
    )


@st.composite
def line_settings(draw: Any) -> dict[str, Any]:
    """Settings of lines through points and around obstacles."""
    settings = dict[str, Any]()
    if draw(st.booleans()):
        settings["obstacle"] = [draw(obstacles()) for _ in range(draw(st.sampled_from([1, 1, 1, 2, 2, 3, 0])))]
    elif rarely(draw, 2):
        kind = draw(st.sampled_from(["sphere", "cylinder"]))
        settings[kind] = {"bone": "top", "radius": draw(lengths())} | (
            {"centre": draw(points())} if kind == "sphere" else {"start": draw(points()), "end": draw(points())}
        )
    if rarely(draw, 3):
        settings["via"] = sorted((draw(vias()) for _ in range(draw(st.integers(1, 2)))), key=lambda one: str(one)[:12])
    elif rarely(draw, 4):
        settings["via_count"] = draw(mostly([0, 1, 3], [-1, 39, 40, 1e300, 2**40, True]))
    if draw(st.booleans()):
        settings["hill"] = draw(hills())
    if rarely(draw, 40):
        settings[draw(st.sampled_from(["x", "via", "obstacle", "hill", "sphere"]))] = draw(odd)
    return settings


@st.composite
def line_calls(draw: Any) -> Callable[[], Any]:
    """Lines that are solved."""
    given, settings = draw(muscles()), draw(line_settings())
    return lambda: lines(given, settings)


@st.composite
def settings_of_lines(draw: Any) -> Callable[[], Any]:
    """Lines that are read, with their obstacles, and found at the first frame."""
    given, settings = draw(muscles()), draw(line_settings())
    return lambda: line_of_action.check(
        parse(line_of_action.LineSettings, settings, "candidate[0]"), given, "candidate[0]"
    )


def lines(given: MuscleProblem, settings: dict[str, Any]) -> None:
    """Lines, checked a second time."""
    record = parse(line_of_action.LineSettings, settings, "candidate[0]")
    line_of_action.check(record, given, "candidate[0]")
    frames: list[Frame] = []
    outcome = line_of_action.solve(given, record, frames.append)
    assert outcome.message
    if outcome.status != "converged":
        return
    assert [frame.number for frame in frames] == list(given.frames)
    model = line_of_action.Shortest(given, record)
    for frame in frames:
        assert frame.fibres is not None
        assert np.isfinite(frame.fibres).all(), "points that are not finite"
        assert all(map(math.isfinite, frame.scalars.values())), frame.scalars
        long = model.lengths(int(frame.number))
        assert frame.scalars["lost_by_chords_max"] > -1e-6 * long.max(), frame.scalars
        for surface, one in zip(model.wraps._moved(int(frame.number)), model.wraps.given, strict=True):
            outside(surface, frame.fibres, f"{one.name} at frame {frame.number}")
        if record.hill is not None:
            balanced(frame, given)


def balanced(frame: Frame, given: MuscleProblem) -> None:
    """AssertionError unless forces and moments on all bones cancel."""
    assert frame.scalars["muscle_force"] >= 0
    for kind, arm in (("force", 1.0), ("moment", 1e3)):
        total = [sum(frame.scalars[f"{kind}_on_{bone.name}_{axis}"] for bone in given.bones) for axis in "xyz"]
        assert np.abs(total).max() <= 1e-6 * arm * (1e-9 + frame.scalars["muscle_force"]), (
            f"{kind}s {total} do not cancel"
        )


@st.composite
def bundle_calls(draw: Any) -> Callable[[], Any]:
    """Muscles of rods or Gaussians."""
    given = draw(muscles())
    if draw(st.booleans()):
        stiff = [0.0, 0.5, 1.0], [-1, 1.5, math.nan, "1", True, 1e-320]
        settings: dict[str, Any] = {name: draw(mostly(*stiff)) for name in ("stretch", "bending", "volume", "bundle")}
        settings |= {
            "points": draw(mostly([4, 6, 9], [3, 0, -1, math.nan, 60])),
            "iterations": draw(mostly([1, 3, 10], [0, -1, 1.5])),
        }
        solver: Any = viper
    else:
        settings, solver = {"gaussians": draw(mostly([2, 3, 5, 10], [1, 0, 200, 10**400, True, math.nan]))}, rbf_muscle
        settings |= {
            "iterations": draw(mostly([1, 5], [0, math.nan])),
            "volume": draw(mostly([True, False], [None, 1])),
        }
    settings["contact"] = draw(mostly([False, True], [None, "x", 2]))
    return lambda: surfaces(given, solver, settings)


def surfaces(given: MuscleProblem, solver: Any, settings: dict[str, Any]) -> None:
    """The muscle, checked a second time."""
    (offer,) = solver.SOLVES
    record = parse(offer.settings, settings, "candidate[0]")
    frames: list[Frame] = []
    outcome: Outcome = solver.solve(given, record, frames.append)
    assert outcome.message
    if outcome.status != "converged":
        return
    assert [frame.number for frame in frames] == list(given.frames)
    for frame in frames:
        assert frame.surface is not None
        assert np.isfinite(frame.surface).all()
        assert all(map(math.isfinite, frame.scalars.values())), frame.scalars
        assert frame.fibres is None or np.isfinite(frame.fibres).all(), "fibres that are not finite"
        for entry in given.attached if frame.number > given.frames[0] else ():  # at rest, as scenes must be there
            wanted = apply(entry.bone.pose(frame.number), given.surface.points[entry.vertices])
            assert np.abs(frame.surface[entry.vertices] - wanted).max() < 1e-6, f"{entry.attachment} is off its bone"
