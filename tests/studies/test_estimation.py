"""Errors of estimation techniques on shapes for which they are known."""

import numpy as np
import pytest
import shapes

from fem_reference.foundations.mesh import Polylines
from fem_reference.problems.setup import AttachedVertices, Bone, Setup
from fem_reference.studies import estimation


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
