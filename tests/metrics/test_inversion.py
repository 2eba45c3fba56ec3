"""Parts of a surface that are inside out or inside another part: reflected, crossed and turned bodies of known area."""

import numpy as np
import pytest
import shapes
from numpy.testing import assert_allclose
from scipy.spatial.transform import Rotation

from fem_reference.assessment.judge import judge
from fem_reference.foundations.mesh import Polylines, Surface, triangle_areas
from fem_reference.geometry.distance import outer_windings
from fem_reference.metrics import MeasurementContext, at_rest, inversion
from fem_reference.runs.store import Outcome, Run

BALL = shapes.sphere(3, 10.0)
BAR = shapes.skin(shapes.box((15, 1, 1), (15.0, 1.0, 1.0)))


def run_of(rest: Surface, *frames: np.ndarray) -> Run:
    return Run("run", "test", Outcome("converged", ""), tuple(range(len(frames))), rest, np.array(frames))


def shares(run: Run, reference: Run | None = None) -> tuple[np.ndarray, np.ndarray]:
    """``inside_out`` and ``overlapping`` [%] per frame, against rest where there is no reference."""
    reference = at_rest(run) if reference is None else reference
    fibre = Polylines(run.surface.points[:2], np.array([0, 2]))
    inside_out, overlapping = inversion.measure(run, reference, MeasurementContext.of(at_rest(run), fibre, ()))
    assert (inside_out.statistic, overlapping.statistic) == ("inside_out", "overlapping")
    return inside_out.values, overlapping.values


def looped(points: np.ndarray) -> np.ndarray:
    """The bar led once round, its first arm in x 0 to 6, y -0.5 to 0.5, z 0 to 1 and its last in x -3 to 3, y -0.25 to 0.75,
    z 0.5 to 1.5.
    """
    corners = [[6.0, 4.0, 0.2], [-3.0, 4.0, 0.4], [-3.0, 0.25, 0.5]]
    line = np.array([[x, 0, 0] for x in range(7)] + corners + [[x, 0.25, 0.5] for x in range(-2, 4)])
    across = np.tile([0.0, 1, 0], (len(line), 1))
    across[6:10] = [[-1, 1, 0], [-1, -1, 0], [1, -1, 0], [1, 1, 0]]
    station = np.round(points[:, 0]).astype(int)
    return line[station] + (points[:, 1, None] - 0.5) * across[station] + points[:, 2, None] * [0, 0, 1]


def test_a_sound_body_is_bounded_by_all_its_triangles() -> None:
    for surface in (BALL, BAR):
        assert outer_windings(surface).tolist() == [0.0] * len(surface.triangles)


def test_a_reflected_body_is_inside_out_all_over() -> None:
    found = outer_windings(BALL.moved_to(BALL.points * [1, 1, -1]))
    assert found.tolist() == [-1.0] * len(BALL.triangles)
    inside_out, overlapping = shares(run_of(BALL, BALL.points, BALL.points * [1, 1, -1]))
    assert_allclose(inside_out, [0, 100], atol=1e-12)
    assert_allclose(overlapping, 0, atol=1e-12)


def test_a_cap_moved_out_through_the_far_side_is_inside_out_where_it_comes_out() -> None:
    """The top cap, mirrored down at z = 6 mm by 18 mm, ends at -14 mm: what lies beyond the sphere is turned inside out.

    Down there the cap faces the part it went through, and so does the sphere where it is covered.
    """
    points = BALL.points.copy()
    cap = points[:, 2] > 6
    points[cap, 2] = 6 - 5 * (points[cap, 2] - 6)
    moved = BALL.moved_to(points)
    found, centres = outer_windings(moved), points[BALL.triangles].mean(axis=1)
    outside = np.linalg.norm(centres, axis=1) > 10.01
    whole = cap[BALL.triangles].all(axis=1)
    assert outside.any()
    assert (found[outside & whole] == -1).all()
    assert (found[~outside & whole & (np.linalg.norm(centres, axis=1) < 9.5)] == 0).all()
    inside_out, overlapping = shares(run_of(BALL, points))
    areas = triangle_areas(BALL.points, BALL.triangles)
    assert_allclose(inside_out, 100 * areas[found < 0].sum() / areas.sum(), rtol=1e-12)
    assert_allclose(overlapping, 0, atol=1e-12)


def test_a_bar_that_passes_through_itself_overlaps() -> None:
    """Overlapping are the triangles whose middle lies in the other arm, and none is inside out."""
    points = looped(BAR.points)
    middles = points[BAR.triangles].mean(axis=1)
    first = (BAR.points[BAR.triangles, 0] <= 6).all(axis=1)
    last = (BAR.points[BAR.triangles, 0] >= 9).all(axis=1)
    in_first = ((middles > [0, -0.5, 0]) & (middles < [6, 0.5, 1])).all(axis=1)
    in_last = ((middles > [-2, -0.25, 0.5]) & (middles < [3, 0.75, 1.5])).all(axis=1)
    expected = (last & in_first) | (first & in_last)
    areas = triangle_areas(BAR.points, BAR.triangles)
    inside_out, overlapping = shares(run_of(BAR, points))
    assert expected.sum() > 10
    assert_allclose(inside_out, 0, atol=1e-12)
    assert_allclose(overlapping, 100 * areas[expected].sum() / areas.sum(), rtol=1e-12)


def test_shares_are_against_those_of_the_reference() -> None:
    reflected = BALL.points * [1, 1, -1]
    assert_allclose(shares(run_of(BALL, BALL.points), run_of(BALL, reflected))[0], -100, rtol=1e-12)
    assert_allclose(shares(run_of(BALL, reflected), run_of(BALL, reflected)), 0, atol=0)


def test_rigid_motion_and_the_order_of_vertices_change_nothing() -> None:
    random = np.random.default_rng(4)
    points = BALL.points.copy()
    points[points[:, 2] > 6, 2] *= -1.4
    turned = Rotation.random(rng=random).apply(points) + [150, 240, -430]
    order = random.permutation(len(points))
    other = Surface(BALL.points[order], random.permutation(np.argsort(order)[BALL.triangles]))
    before = shares(run_of(BALL, points))
    assert before[0] > 1
    # Whole numbers of triangles: rounding of the sum of their areas only.
    assert_allclose(shares(run_of(BALL, turned)), before, rtol=1e-12)
    assert_allclose(shares(run_of(other, points[order])), before, rtol=1e-12)


@pytest.mark.parametrize("bad", [np.nan, np.inf, 1e200])
def test_what_is_not_a_number_never_passes(bad: float) -> None:
    damaged = BALL.points.copy()
    damaged[5] = bad
    for values in shares(run_of(BALL, BALL.points, damaged)):
        assert np.isnan(values).tolist() == [False, True]
        assert judge(float(values[1]), 0.0, 1e6) == "fail"


def test_a_triangle_that_collapsed_has_no_outer_side() -> None:
    points = BALL.points.copy()
    points[BALL.triangles[0, 0]] = points[BALL.triangles[0, 1]]
    assert np.isnan(shares(run_of(BALL, points))).all()


def test_where_names_a_triangle_and_nothing_where_all_is_well() -> None:
    run = run_of(BALL, BALL.points, BALL.points * [1, 1, -1])
    inside_out, overlapping = inversion.measure(run, at_rest(run), None)
    x, y, z = (BALL.points[BALL.triangles[0]] * [1, 1, -1]).mean(axis=0)
    assert inside_out.where == ("", f"triangle 0 at ({x:.1f}, {y:.1f}, {z:.1f}) mm")
    assert overlapping.where == ("", "")
