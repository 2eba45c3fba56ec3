"""Errors of estimation techniques on shapes for which they are known."""

import numpy as np
import pytest
import shapes
import small
from scipy.spatial.transform import Rotation as Turn

from fem_reference.foundations.mesh import Polylines, Surface
from fem_reference.problems.setup import AttachedVertices, Bone, Setup
from fem_reference.scenes import casefile
from fem_reference.studies import estimation
from fem_reference.studies.estimation import answers, compared, crossings, of_rods


def fibres(*lines: np.ndarray) -> Polylines:
    return Polylines(np.concatenate(lines), np.cumsum([0, *map(len, lines)]))


def test_straight_fibres_are_met_by_all_but_the_constant() -> None:
    """The nearest of four points evenly along 30 mm is at most 5 mm away."""
    line = np.linspace(0, 30, 31)[:, None] * [[1.0, 0.0, 0.0]]
    for one in estimation.of_fibres("case", fibres(line, line + 5)):
        if one.technique == "constant" and one.known == 4:
            assert one.greatest == pytest.approx(5, abs=0.5)
        elif one.technique != "constant":
            assert one.greatest < 0.03  # curves are looked at in a thousand points


def test_a_chord_of_an_arc_misses_it_by_its_sagitta() -> None:
    """The sagitta is r (1 - cos(a / 2)), in the middle of each chord, where there are points of the fibre."""
    angles = np.linspace(0, np.pi / 2, 31)
    arc = 40 * np.stack([np.cos(angles), np.sin(angles), 0 * angles], axis=1)
    errors = {(one.technique, one.known): one.greatest for one in estimation.of_fibres("case", fibres(arc))}
    assert errors["piecewise linear", 4] == pytest.approx(40 * (1 - np.cos(np.pi / 12)), rel=1e-3)
    assert errors["Catmull-Rom, centripetal", 10] < errors["piecewise linear", 10] / 3
    short = {one.known for one in estimation.of_fibres("case", fibres(arc[::6]))}
    assert short == {4}, "of six points four are known; six leave none to compare with"


@pytest.mark.slow
def test_a_flat_attachment_has_no_error_and_a_ball_is_fitted() -> None:
    """A plane is a polynomial of (3.10) whatever the centres; a ball is a level of Gaussians in one place."""
    surface = shapes.skin(shapes.box((12, 12, 2), (24.0, 20.0, 4.0)))
    flat = np.flatnonzero(surface.points[:, 2] == 0)
    bone = Bone("bone", surface, None)
    setup = Setup(surface, (bone,), (AttachedVertices("origin", bone, flat),), (0, 1), None)
    heights = list(estimation.of_attachments("case", setup))
    assert {one.choice for one in heights} == {"grid", "Halton", "greedy", "features"}
    assert max(one.rms for one in heights) < 1e-9
    ball = Setup(shapes.sphere(3, 20.0), (), (), (0, 1), None)
    fits = list(estimation.of_surface("ball", ball))
    assert [one.gaussians for one in fits] == [10, 30, 100]
    assert max(one.rms for one in fits) < 0.5
    assert fits[0].fewer == 3 * 642 / 40


ROUNDED = ("Gaussian RBF", 20)


def test_a_muscle_turned_moved_scaled_and_renumbered_has_the_same_errors() -> None:
    """Errors of curves and attached areas to scale; condition numbers have no length. Surfaces: test_gaussian_surface."""
    ball, rng = shapes.sphere(3, 20.0), np.random.default_rng(0)
    surface = ball.moved_to(ball.points * [1, 1.3, 1.6] + rng.normal(scale=0.3, size=ball.points.shape))
    turn, order = Turn.random(rng=rng), rng.permutation(len(surface.points))
    back = np.argsort(order)
    other = Surface(2.5 * turn.apply(surface.points[order]) + [30, -50, 7], back[surface.triangles])
    cap = np.flatnonzero(surface.points[:, 2] > 20)
    arc = 40 * np.column_stack([np.cos(t := np.linspace(0, 1.5, 31)), np.sin(t), 0.1 * t])
    found = []
    for one, vertices, line in ((surface, cap, arc), (other, np.sort(back[cap]), 2.5 * turn.apply(arc) + [30, -50, 7])):
        bone = Bone("bone", one, None)
        rest = Setup(one, (bone,), (AttachedVertices("origin", bone, vertices),), (0, 1), None)
        heights = list(estimation.of_attachments("case", rest))
        # Gaussians through 20 points are so wide that their matrix is singular but for rounding: 0.01 mm of 0.04.
        errors = [one for one in estimation.of_fibres("case", fibres(line)) if (one.technique, one.known) != ROUNDED]
        curved = [error.rms for error in errors]
        found.append(([error.condition for error in heights], [error.rms for error in heights], curved))
    for own, great, factor in zip(*found, (1, 2.5, 2.5), strict=True):
        assert len(own) > 2
        assert great == pytest.approx([factor * value for value in own], rel=1e-3)


BOX = shapes.skin(shapes.box((2, 2, 4), (20.0, 20.0, 60.0)))


def _lines(*lines: np.ndarray) -> Polylines:
    return Polylines(np.concatenate(lines), np.cumsum([0, *map(len, lines)]))


def _line(degrees: float, length: float, start: tuple[float, float, float]) -> np.ndarray:
    along = np.array([np.sin(np.radians(degrees)), 0, np.cos(np.radians(degrees))])
    return start + np.linspace(0, length, 31)[:, None] * along


def test_angle_length_and_share_outside_are_those_of_lines() -> None:
    """12 degrees, 30 over 40 mm; of two lines one runs outside."""
    known = _lines(_line(0, 40, (5, 5, 10)), _line(0, 40, (15, 5, 10)))
    lines = _lines(_line(12, 30, (5, 5, 10)), _line(12, 30, (5, 30, 10)))
    found = compared("case", BOX, ("mine", lines), ("theirs", known))
    assert (found.median, found.most) == pytest.approx((12, 12), abs=1e-6)
    assert found.length == pytest.approx(0.75)
    assert found.outside == pytest.approx(0.5)
    assert found.crossings == 0


def test_rods_fill_what_their_radius_reaches() -> None:
    """One rod along a bar of 20 x 20 x 60 mm has a radius of 11.28 mm, which the sides cut off: four segments of its circle.

    Half an angle of each is acos(10 / r). Half balls beyond its ends are outside too. Within 1 % at random points.
    """
    lines = _lines(_line(0, 60, (10, 10, 0)))
    found = of_rods("bar", BOX, lines)
    radius = 20 / np.sqrt(np.pi)
    half = np.arccos(10 / radius)
    inside = 1 - 4 * radius**2 * (half - np.sin(half) * np.cos(half)) / 400
    union = 400 * 60 + 4 / 3 * np.pi * radius**3
    assert (found.rods, found.radius) == (1, pytest.approx(radius))
    assert found.filled == pytest.approx(inside, abs=0.01)
    assert found.outside == pytest.approx(1 - inside * 400 * 60 / union, abs=0.01)
    twice = of_rods("bar", BOX, _lines(_line(0, 60, (10, 10, 0)), _line(0, 60, (10, 10, 0))))
    assert twice.radius == pytest.approx(radius / np.sqrt(2))
    assert twice.overlap == pytest.approx(
        1 / 2 - 2 / 3 * twice.radius / 60, abs=0.02
    )  # one rod with round ends, of two


def test_lines_that_cross_are_counted_once_a_pair() -> None:
    crossing = _lines(_line(0, 40, (10, 5, 0)), _line(20, 40, (3, 5, 0)), _line(0, 40, (10, 15, 0)))
    assert crossings(crossing) == 1
    assert crossings(_lines(_line(0, 40, (10, 5, 0)), _line(20, 40, (10, 5, 0)))) == 0, "their ends may meet"


@pytest.mark.slow
def test_the_same_fibres_change_no_answer_and_others_do(tmp_path, monkeypatch) -> None:
    """The Laplace field under another name; and the template's lines, which in a bar are the field's to a few degrees."""
    case = casefile.read_muscle(small.write(tmp_path / "bar"))
    own = estimation.variants
    monkeypatch.setattr(estimation, "variants", lambda one: (found := own(one)) | {"again": found["Laplace field"]})
    found = {one.source: one for one in answers(case, tmp_path / "runs")}
    assert set(found) == {"Kohout and Kukacka", "CHMD", "again"}
    assert found["again"].status == "converged"
    assert max(found["again"].changes.values()) == 0
    assert {"surface_deviation.rms", "fibre_length.max", "joint_moment.force"} <= set(found["again"].changes)
    assert 0 < found["Kohout and Kukacka"].changes["surface_deviation.rms"] < 1
    assert found["again"].bars["surface_deviation.rms"] > 0
