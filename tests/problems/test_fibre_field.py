"""Fibres of a case: lines that are given or traced, and the direction at any point."""

import numpy as np
import pytest
import random_scenes
import shapes
from auto_scenes import STILL, pennate

from fem_reference.foundations.mesh import Polylines, TetMesh
from fem_reference.io import files
from fem_reference.problems import fibre_field, muscle
from fem_reference.problems.estimates import estimates
from fem_reference.scenes import casefile


def test_given_fibres_stay_inside_the_muscle(bar) -> None:
    surface = muscle.setup(casefile.read(bar)).surface
    inside, far = [5.0, 5.0, 20.0], [5.0, 30.0, 20.0]
    given = Polylines(np.array([inside, far]), np.array([0, 2]))
    moved = fibre_field.inside(surface, given)
    assert np.array_equal(moved.points[0], inside)
    # The nearest point of the side, which bulges to y = 5 + 5 * 1.3 = 11.5 halfway up.
    assert moved.points[1] == pytest.approx([5, 11.5, 20], abs=1e-9)


@pytest.mark.slow
def test_given_fibres_are_read(bar) -> None:
    lines = Polylines(np.array([[5.0, 5, 2], [5, 5, 20], [5, 5, 38]]), np.array([0, 3]))
    files.write_polylines(bar / "lines.vtp", lines, lines.points)
    text = (bar / "case.toml").read_text()
    traced = 'traced = { count = 4, start = "origin", end = "insertion" }'
    assert traced in text
    (bar / "case.toml").write_text(text.replace(traced, 'polylines = { file = "lines.vtp", unit = "mm" }'))
    try:
        case = casefile.read(bar)
        assert muscle.build(case, muscle.setup(case)).fibres.lengths().tolist() == [36]
    finally:
        (bar / "case.toml").write_text(text)


def test_fibres_at_an_angle_lean_by_the_sine_of_twice_that(tmp_path) -> None:
    scene = pennate(tmp_path / "scene", "auto")
    assert estimates(scene, muscle.setup(scene)).lean == pytest.approx(np.sin(np.radians(50)))
    case = random_scenes.TEXT.format(**STILL, choice="auto", effects="")
    straight = random_scenes.write(tmp_path / "straight", case, random_scenes.lines(0.0, 0.0))
    assert estimates(straight, muscle.setup(straight)).lean == pytest.approx(0, abs=1e-6)


def test_lines_that_are_given_are_the_directions(tmp_path) -> None:
    """At 25 degrees to the axis, in the plane of x and z; no mesh is made for them."""
    case = pennate(tmp_path / "scene", "listed")
    surface = muscle.setup(case).surface
    lines, direction = fibre_field.of(case, surface, lambda _: pytest.fail("it was meshed"))
    places = np.random.default_rng(1).uniform((2, 2, 5), (8, 8, 35), (40, 3))
    along = direction(np.zeros(len(places), int), places)
    lean = np.radians(25)
    assert np.abs(along @ [np.sin(lean), 0, np.cos(lean)]) == pytest.approx(1, abs=1e-6)
    assert lines.points.min(axis=0).min() >= -1e-9
    assert (lines.points.max(axis=0) <= np.array([10, 10, 40]) + 1e-9).all()


def test_traced_fibres_of_a_straight_bar_go_straight_along_it(bar) -> None:
    """The field of a box between its two ends is linear: every line is as long as the box, and there is one direction."""
    sizes = []

    def fill(size: float) -> TetMesh:
        sizes.append(size)
        return shapes.box((2, 2, 6), (10.0, 10.0, 40.0))

    case = casefile.read(bar)
    traced = case.fibres.traced.model_copy(update={"start": "bottom", "end": "top"})
    case = case.model_copy(update={"fibres": case.fibres.model_copy(update={"traced": traced})})
    surface = shapes.skin(shapes.box((2, 2, 6), (10.0, 10.0, 40.0)))
    lines, direction = fibre_field.of(case, surface, fill)
    (size,) = sizes
    assert size**3 / (6 * np.sqrt(2)) == pytest.approx(4000 / fibre_field.TETS, rel=1e-9), (
        "the volume of a regular tetrahedron"
    )
    assert len(lines.lengths()) == case.fibres.traced.count
    assert lines.lengths() == pytest.approx(40, rel=1e-2)
    along = direction(np.zeros(2, int), np.array([[5.0, 5, 20], [3, 4, 11]]))
    assert along == pytest.approx(np.tile([0.0, 0, 1], (2, 1)), abs=1e-6)
