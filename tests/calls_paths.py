"""Paths around obstacles that anybody may put there, and a second look at those that count as found."""

import math
from collections.abc import Callable
from typing import Any

import numpy as np
from hypothesis import strategies as st
from odd import odd, often, rarely

from fem_reference.foundations.mesh import Floats
from fem_reference.foundations.records import parse
from fem_reference.geometry.obstacles import Quadric, Ring
from fem_reference.geometry.winding import Winding, around
from fem_reference.solvers.common.wraps import ObstacleOn

LENGTHS = ["3 mm", "1 mm", "0.2 mm", "6 mm", "20 mm"]
ODD_LENGTHS = [
    "1e-30 mm",
    "1e-9 mm",
    "1e-6 mm",
    "1e3 mm",
    "1e9 mm",
    "0 mm",
    "-1 mm",
    "nan mm",
    "inf mm",
    "3",
    3.0,
    "3 kPa",
    math.nan,
]
POINTS = ["5, 5, 15 mm", "8, 5, 15 mm", "5, 8, 12 mm", "3, 2, 20 mm", "5, 20, 15 mm"]
ODD_POINTS = [
    "5, 5, 0 mm",
    "5, 5, 30 mm",
    "1e9, 0, 0 mm",
    "nan, 0, 0 mm",
    "5, 5 mm",
    [5, 5, 15],
    "-1e9, 1e9, 1e9 mm",
    "0, 0, 0 mm",
]
AXES: list[Any] = [[1, 0, 0], [0, 0, 1], [0.3, 0.5, -0.8]]
ODD_AXES = [
    [0, 0, 0],
    [1e-12, 0, 0],
    [math.nan, 0, 0],
    [math.inf, 0, 0],
    [1, 0],
    "1, 0, 0",
    [1e8, 1e8, 0],
    [1e-8, 0, 0],
]


@st.composite
def mostly(draw: Any, usual: list[Any], other: list[Any], times: int = 12) -> Any:
    """One of what is usual, once in so many ``times`` of the ``other``, more rarely what nobody means."""
    return draw(often(other, 4)) if rarely(draw, times) else draw(st.sampled_from(usual))


@st.composite
def lengths(draw: Any, most: float = 12.0) -> Any:
    """A length as text."""
    if rarely(draw, 3):
        return draw(mostly(LENGTHS, ODD_LENGTHS))
    return f"{draw(st.floats(0.05, most))} mm"


@st.composite
def points(draw: Any) -> Any:
    """A point in or beside the bar, as text."""
    if rarely(draw, 3):
        return draw(mostly(POINTS, ODD_POINTS))
    x, y, z = (draw(st.floats(*range_)) for range_ in ((0, 10), (-2, 14), (4, 26)))
    return f"{x}, {y}, {z} mm"


@st.composite
def obstacles(draw: Any) -> Any:
    """An obstacle on a bone, or something like it."""
    kind, bone = (
        draw(often(["sphere", "cylinder", "ellipsoid", "torus"], 60)),
        draw(mostly(["bottom", "top"], ["x", ""], 60)),
    )
    shape: Any = {"centre": draw(points())}
    if not isinstance(kind, str):
        return {"bone": bone, "sphere": kind}
    if kind == "sphere":
        shape |= {"radius": draw(lengths())}
    elif kind == "cylinder":
        shape = {"start": draw(points()), "end": draw(points()), "radius": draw(lengths())}
    elif kind == "ellipsoid":
        shape |= {
            "radii": [draw(lengths()) for _ in range(3)],
            "turn": draw(mostly(["0, 0, 30 deg", "1, 2, 3 rad"], ["nan, 0, 0 deg"])),
        }
    else:
        shape |= {"axis": draw(mostly(AXES, ODD_AXES)), "radius": draw(lengths()), "tube": draw(lengths(3.0))}
    if rarely(draw, 40):
        shape = draw(odd)
    found = {"bone": bone, kind: shape}
    return found | ({"torus": shape, "x": 1} if rarely(draw, 60) else {})


@st.composite
def path_calls(draw: Any) -> Callable[[], Any]:
    """Paths around obstacles, of which a closed form or a file says no more than that ends are outside."""
    given = [draw(obstacles()) for _ in range(draw(st.integers(1, 3)))]
    size = draw(st.sampled_from([1.0, 1.0, 1.0, 1e-3, 1e3, 1e6]))
    ends = np.array(
        [
            [draw(st.floats(-5, 15)), draw(st.floats(-5, 15)), z]
            for z in draw(st.sampled_from([(0, 30), (-3, 33), (15, 15), (0, 8)]))
            for _ in range(2)
        ]
    )
    return lambda: paths(given, ends, size)


def paths(given: list[Any], ends: Floats, size: float) -> None:
    """Paths, checked a second time."""
    made = [parse(ObstacleOn, one, f"obstacle[{i}]").surface() for i, one in enumerate(given)]
    made = [scaled(one, size) for one in made]
    starts, stops = size * ends[:2], size * ends[2:]
    fixed = np.concatenate([starts, stops])
    if any(np.linalg.norm(one.pushed(fixed) - fixed, axis=1).max() > 1e-6 for one in made):
        return
    check_paths(made, around(made, starts, stops), starts, stops)


def scaled(one: Quadric | Ring, size: float) -> Quadric | Ring:
    """A surface in a space that is so many times as large."""
    pose = np.array(one.pose)
    pose[:3, 3] *= size
    return Ring(pose, size * one.radius, size * one.tube) if isinstance(one, Ring) else Quadric(pose, size * one.radii)


def check_paths(made: list[Quadric | Ring], found: Winding, starts: Floats, stops: Floats) -> None:
    """AssertionError where a path that counts as found is not one, or could be shorter."""
    good = np.flatnonzero(~found.failed)
    if not len(good):
        return
    which, shares = np.repeat(good, 301), np.tile(np.linspace(0, 1, 301), len(good))
    at = found.at(which, shares)
    assert np.isfinite(at).all(), "a path that is not finite"
    near = np.linalg.norm(stops - starts, axis=1)[good]
    long = found.lengths[good]
    assert (long >= near * (1 - 1e-9)).all(), f"{long} shorter than straight {near}"
    for one in made:
        outside(one, at, type(one).__name__)
    chords = np.linalg.norm(np.diff(at.reshape(len(good), 301, 3), axis=1), axis=2).sum(axis=1)
    assert (np.abs(chords - long) <= 1e-2 * long + 1e-9).all(), f"chords {chords}, lengths {long}"
    for along in found.directions():
        assert np.isfinite(along[good]).all()


def outside(surface: Quadric | Ring, at: Floats, name: str) -> None:
    """AssertionError where one of the points (n, 3) is inside the ``surface``."""
    value, slope = surface.level(at)
    deep = -float((value / np.maximum(np.linalg.norm(slope, axis=1), 1e-12)).min())
    assert deep < 1e-3 * surface.bend + 1e-5, f"{deep:.3g} mm inside the {name}"
