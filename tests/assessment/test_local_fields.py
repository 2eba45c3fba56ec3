"""Quantities at every vertex and fibre point, by closed forms."""

from dataclasses import replace

import numpy as np
import shapes
from numpy.testing import assert_allclose

from fem_reference.assessment import local_fields
from fem_reference.foundations.mesh import Polylines
from fem_reference.metrics import MeasurementContext
from fem_reference.metrics.fibre_length import fibre_points
from fem_reference.runs.store import Outcome, Run

BALL = shapes.sphere(3, 10.0)
LINES = Polylines(np.array([[0.0, 0, -4], [0, 0, 0], [0, 0, 2], [1, 0, 0], [3, 0, 0]]), np.array([0, 3, 5]))


def run(*factors: float) -> Run:
    positions = np.stack([factor * BALL.points for factor in factors])
    inside = np.stack([factor * LINES.points for factor in factors])
    numbers = tuple(range(len(factors)))
    return Run("ball", "test", Outcome("converged", ""), numbers, BALL, positions, LINES, inside)


def test_distances_of_concentric_balls_are_those_of_their_radii() -> None:
    small, large = run(1.0, 1.0), run(1.0, 1.2)
    assert_allclose(
        local_fields.to_same_vertex(large, small), [[0] * len(BALL.points), [2] * len(BALL.points)], atol=1e-9
    )
    outside, inside = local_fields.to_surface(large, small)[1], local_fields.to_surface(small, large)[1]
    assert_allclose(outside, 2, rtol=0.01)
    assert_allclose(inside, -2, rtol=0.08)  # the facets of the large ball lie below its radius
    lost = replace(small, positions=np.where([[[False]], [[True]]], np.nan, small.positions))
    assert np.isnan(local_fields.to_surface(lost, small)[1]).all()


def test_without_bones_nothing_is_near() -> None:
    still = run(1.0)
    gaps = local_fields.to_bones(still, MeasurementContext.of(still, LINES, ()))
    assert gaps is not None
    assert len(np.unique(gaps)) == 1


def test_fibres_are_those_of_the_run_or_carried_by_its_surface() -> None:
    grown = run(1.0, 1.5)
    context = MeasurementContext.of(grown, LINES, ())
    bare = replace(grown, fibres=None, fibre_positions=None)
    assert_allclose(fibre_points(grown, context), grown.fibre_positions)
    assert_allclose(fibre_points(bare, context), grown.fibre_positions, atol=1e-9)


def test_stretch_is_of_the_pieces_that_meet_and_of_no_other_line() -> None:
    moved = LINES.points.copy()
    moved[2] = [0, 0, 4]  # its last piece, 2 mm, is twice as long: with 4 mm before it, 8 for 6 where they meet
    assert_allclose(local_fields.stretch_along(LINES, moved[None]), [[1, 8 / 6, 2, 1, 1]])
