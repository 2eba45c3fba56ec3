"""Winding numbers just outside triangles: 0 on a sound body, 1 within another part, -1 where a part is inside out."""

import numpy as np
import shapes

from fem_reference.foundations.mesh import Surface
from fem_reference.geometry.windings import inside, outer_windings

BALL = shapes.sphere(2, 10.0)
COUNT = len(BALL.triangles)


def together(*surfaces: Surface) -> Surface:
    """Surfaces as parts of one."""
    before = np.cumsum([0, *(len(one.points) for one in surfaces)])
    triangles = [one.triangles + first for one, first in zip(surfaces, before, strict=False)]
    return Surface(np.concatenate([one.points for one in surfaces]), np.concatenate(triangles))


def test_points_are_inside_where_the_surface_winds_round_them() -> None:
    points = np.array([[0.0, 0, 0], [9, 0, 0], [11, 0, 0]])
    assert inside(BALL, points).tolist() == [True, True, False]
    assert inside(BALL, points[:0]).tolist() == []


def test_nothing_winds_round_the_outside_of_a_sound_body() -> None:
    assert not outer_windings(BALL).any()
    assert not outer_windings(BALL.moved_to(BALL.points * [1, 2, 0.1] + 1e3)).any()


def test_a_body_that_is_inside_out_is_negative() -> None:
    assert (outer_windings(Surface(BALL.points, BALL.triangles[:, ::-1])) == -1).all()


def test_a_part_within_another_is_above_zero() -> None:
    found = outer_windings(together(BALL, BALL.moved_to(BALL.points / 2)))
    assert (found[:COUNT] == 0).all()
    assert (found[COUNT:] == 1).all()


def test_a_cavity_is_sound() -> None:
    assert not outer_windings(together(BALL, Surface(BALL.points / 2, BALL.triangles[:, ::-1]))).any()


def test_what_has_no_normal_has_no_number() -> None:
    points = np.array(BALL.points)
    points[BALL.triangles[7]] = points[BALL.triangles[7, 0]]
    assert np.isnan(outer_windings(BALL.moved_to(points))[7])
    points[0] = np.nan
    assert np.isnan(outer_windings(BALL.moved_to(points))).all()
