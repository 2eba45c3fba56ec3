"""The law of contact: a pressure that is the slope of an energy, without a jump in itself or in its slope."""

import numpy as np
import pytest

from fem_reference.geometry.rigid_bodies import Box, Sphere
from fem_reference.geometry.signed_distance import Grid, build
from fem_reference.geometry.tessellation import tessellated
from fem_reference.problems.contact import ContactLaw

D, K = 0.1, 2.0
LAW = ContactLaw("top", K, D)


def test_the_slope_is_that_of_the_pressure() -> None:
    # Central differences; the law is quadratic by pieces, so that they are exact away from its joints.
    gaps = np.array([-0.5, -0.15, -0.05, 0.0, 0.07, 0.15, 2.0])
    pressure, slope = LAW.pressure(gaps)
    after, before = (LAW.pressure(gaps + sign * 1e-6)[0] for sign in (1, -1))
    assert slope == pytest.approx((after - before) / 2e-6, abs=1e-9)
    assert (pressure >= 0).all()


def test_it_begins_at_the_smoothing_and_is_a_spring_deep_inside() -> None:
    pressure, slope = LAW.pressure(np.array([D, 0.0, -D, -1.0]))
    assert pressure == pytest.approx([0, K * D / 4, K * D, K * 1.0])
    assert slope == pytest.approx([0, -K / 2, -K, -K])


def test_neither_pressure_nor_slope_jumps() -> None:
    for joint in (D, -D):
        (before, after), slopes = LAW.pressure(np.array([joint - 1e-9, joint + 1e-9]))
        assert before == pytest.approx(after, abs=1e-8)
        assert slopes[0] == pytest.approx(slopes[1], abs=1e-7)


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["sphere", "box", "grid"])
def test_no_way_as_long_as_the_clearance_comes_near(kind) -> None:
    shape = {"sphere": Sphere((0.0, 0.0, 0.0), 10.0), "box": Box((0.0, 0.0, 0.0), (16.0, 10.0, 6.0), 0.0)}.get(
        kind
    ) or ball()
    random = np.random.default_rng(5)
    points, directions = random.uniform(-40, 40, (20_000, 3)), random.normal(size=(20_000, 3))
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    clear, gap = shape.clearance(D)(points), shape.sample(points).distance
    assert (clear[gap <= D] <= 0).all()
    some = clear > 0
    ends = points[some] + 0.999999 * clear[some, None] * directions[some]
    assert (shape.sample(ends).distance > D).all()
    # and on a grid it is not less than there is by more than the diagonals of two cells
    true = np.linalg.norm(points, axis=1) - 10.0 - D if kind != "box" else gap - D
    on_grid = (np.abs(points) < 16).all(axis=1)
    assert (true - clear)[some & on_grid].max() < (2 * 3**0.5 if kind == "grid" else 1e-9)


@pytest.mark.slow
def test_where_a_point_without_a_place_is_nobody_knows() -> None:
    assert np.isnan(ball().clearance(D)(np.array([[0.0, np.nan, 0.0], [np.inf, 0.0, 0.0]]))).all()


@pytest.mark.slow
def test_what_is_nowhere_as_near_as_wanted_is_clear_everywhere() -> None:
    assert (ball().clearance(-30.0)(np.zeros((2, 3))) == np.inf).all()


def ball() -> Grid:
    form = Sphere((0.0, 0.0, 0.0), 10.0)
    return build(tessellated(form, np.zeros((1, 3)), "ball"), 1.0, 6.0)


@pytest.mark.slow
def test_a_gradient_is_nowhere_steeper_than_said() -> None:
    grid = ball()
    points = np.random.default_rng(6).uniform(-18, 18, (20_000, 3))
    lengths = np.linalg.norm(grid.sample(points).gradient, axis=1)
    assert 1 <= lengths.max() <= grid.steepest


def test_what_overlaps_at_rest_is_felt_more_and_more() -> None:
    law = ContactLaw("skin", 1.0, 0.1, relaxed=(-4.0, 0.0))
    assert [law.allowance(frame) for frame in (-5.0, -4.0, -3.0, -2.0, 0.0, 7.0)] == [1, 1, 0.75, 0.5, 0, 0]
    assert ContactLaw("skin", 1.0, 0.1).allowance(-4.0) == 0


def test_a_gap_is_that_of_its_pressure() -> None:
    gaps = np.array([-3.0, -D, -0.4 * D, 0.0, 0.9 * D, D])
    assert LAW.gap(LAW.pressure(gaps)[0]) == pytest.approx(gaps, abs=1e-12)


def test_a_body_in_situ_feels_the_change_of_its_gap_at_any_frame() -> None:
    law = ContactLaw("skin", 1.0, 0.1, in_situ=0.0)
    assert [law.allowance(frame) for frame in (-4.0, 0.0, 7.0)] == [1, 1, 1]
