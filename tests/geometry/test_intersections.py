"""Self-intersections: against all pairs solved one by one, and against what is known of the report's surfaces."""

import itertools
from pathlib import Path

import numpy as np
import pytest
import shapes
from numpy.testing import assert_allclose, assert_array_equal
from scipy.spatial.transform import Rotation

from fem_reference.foundations.mesh import Surface
from fem_reference.geometry.intersections import crossings, overlaps, self_crossings, self_intersections
from fem_reference.io import files

HIP = np.array([146.0, 238.0, -431.0])  # [mm]
TURN = Rotation.random(rng=np.random.default_rng(4))


def _together(*surfaces: Surface) -> Surface:
    starts = np.cumsum([0, *(len(surface.points) for surface in surfaces)])
    triangles = [surface.triangles + start for surface, start in zip(surfaces, starts, strict=False)]
    return Surface(np.concatenate([surface.points for surface in surfaces]), np.concatenate(triangles))


def _by_brute_force(surface: Surface) -> list[int]:
    """Every edge against every triangle: begin + t (end - begin) = a + u (b - a) + v (c - a), solved as three equations."""
    hit = set()
    for one, other in itertools.permutations(range(len(surface.triangles)), 2):
        a, b, c = surface.points[surface.triangles[other]]
        for i, j in ((0, 1), (1, 2), (2, 0)):
            ends = surface.triangles[one][[i, j]]
            if set(ends) & set(surface.triangles[other]):
                continue
            begin, end = surface.points[ends]
            matrix = np.column_stack([begin - end, b - a, c - a])
            if abs(np.linalg.det(matrix)) < 1e-12:
                continue
            t, u, v = np.linalg.solve(matrix, begin - a)
            if 0 < t < 1 and u >= 0 and v >= 0 and u + v <= 1:
                hit |= {one, other}
    return sorted(hit)


def test_two_spheres_through_each_other() -> None:
    ball = shapes.sphere(0)
    both = _together(ball, ball.moved_to(TURN.apply(ball.points) + np.array([0.9, 0.7, 0.3])))
    found = self_intersections(both)
    assert len(found) > 10
    assert_array_equal(found, _by_brute_force(both))


def test_triangles_of_very_different_size() -> None:
    rng = np.random.default_rng(5)
    small = shapes.sphere(0)
    large = Surface(rng.uniform(-20, 20, (9, 3)), np.arange(9).reshape(3, 3))
    wall = Surface(np.array([[0.1, 0, -30], [0, 30, 30], [1, -30, 30]]), np.array([[0, 1, 2]]))
    both = _together(large, wall, small, small.moved_to(small.points + np.array([0.2, 0.1, 1.5])))
    found = self_intersections(both)
    assert 3 in found  # the wall
    assert_array_equal(found, _by_brute_force(both))


@pytest.mark.parametrize("surface", [shapes.sphere(3), shapes.skin(shapes.box((4, 3, 2), (4.0, 3.0, 2.0)))])
def test_a_clean_surface_has_none(surface: Surface) -> None:
    assert len(self_intersections(surface)) == 0


def test_spheres_apart_or_inside_each_other_have_none() -> None:
    ball = shapes.sphere(2)
    assert len(self_intersections(_together(ball, ball.moved_to(ball.points / 2), ball.moved_to(ball.points + 3)))) == 0


def test_moving_the_surface_changes_nothing() -> None:
    ball = shapes.sphere(2, 30.0)
    both = _together(ball, ball.moved_to(ball.points + np.array([17, 23, 31])))
    moved = both.moved_to(TURN.apply(both.points) + HIP)
    assert_array_equal(self_intersections(both), self_intersections(moved))


def test_only_edges_apart_from_the_triangle_count() -> None:
    points = np.array([[0.0, 0, 0], [2, 0, 0], [0, 2, 0], [0.5, 0.5, -1], [0.5, 0.5, 1], [5, 5, 0]])
    apart = Surface(points, np.array([[0, 1, 2], [3, 4, 5]]))
    sharing = Surface(points, np.array([[0, 1, 2], [0, 3, 4]]))
    hinge = Surface(points, np.array([[0, 1, 2], [0, 1, 4]]))
    assert_array_equal(self_intersections(apart), [0, 1])
    assert_array_equal(self_intersections(sharing), [0, 1])  # the edge 3-4 is apart from the first triangle
    assert_array_equal(self_intersections(hinge), [])


@pytest.mark.parametrize("reach", [1e-9, 0.0, -1e-9])
def test_a_tip_through_a_surface_by_a_millionth_of_a_micrometre_counts_and_one_that_touches_does_not(reach) -> None:
    """At the hip, where coordinates are rounded by 6e-14 mm: a spike over a plate of two triangles in the plane z = -431 mm."""
    plate = HIP + np.array([[0.0, 0, 0], [3, 0, 0], [3, 3, 0], [0, 3, 0]])
    spike = HIP + np.array([[1.0, 1.4, -reach], [0.8, 1.2, 4], [1.3, 1.1, 4], [1.1, 1.7, 4]])
    triangles = np.array([[0, 1, 2], [0, 2, 3], [4, 5, 6], [4, 6, 7], [4, 7, 5], [5, 7, 6]])
    both = Surface(np.concatenate([plate, spike]), triangles)
    assert_array_equal(self_intersections(both), [1, 2, 3, 4] if reach > 0 else [])


def test_what_overlaps_in_one_plane_or_folds_back_at_an_edge_does_not_count() -> None:
    flat = np.array([[0.0, 0, 0], [2, 0, 0], [0, 2, 0], [0.3, 0.3, 0], [2, 1, 0], [1, 2, 0], [0.4, 0.2, 0]])
    overlapping, folded = np.array([[0, 1, 2], [3, 4, 5]]), np.array([[0, 1, 2], [1, 0, 6]])
    for triangles in (overlapping, folded):
        assert len(self_crossings(Surface(flat, triangles))) == 0


def test_a_folded_sheet_crosses_where_brute_force_says() -> None:
    """Sheets of 4 x 4 cells, crumpled at random: neighbours by a vertex cross each other as well as triangles far apart."""
    corner, shared = np.arange(25).reshape(5, 5)[:-1, :-1].ravel(), set[int]()
    sheet = np.concatenate([corner[:, None] + [0, 5, 6], corner[:, None] + [0, 6, 1]])
    flat = np.stack([*np.divmod(np.arange(25), 5), np.zeros(25)], axis=1)
    for seed in range(6):
        crumpled = Surface(flat + np.random.default_rng(seed).uniform(-0.9, 0.9, (25, 3)), sheet)
        shared |= {len(set(sheet[one]) & set(sheet[other])) for one, other in self_crossings(crumpled)}
        assert_array_equal(self_intersections(crumpled), _by_brute_force(crumpled))
    assert shared == {0, 1}


@pytest.mark.parametrize(
    ("name", "count"),
    [("muscles/adductor_brevis", 3), ("muscles/gluteus_maximus", 0), ("bones/femur_report", 0)],
)
def test_the_report_surfaces(data: Path, name: str, count: int) -> None:
    # Counts of data/README.md, found there by another program.
    assert len(self_intersections(files.read_surface(data / "hip" / f"{name}.vtk", 1.0))) == count


def test_exact_pairs_are_those_of_brute_force() -> None:
    rng = np.random.default_rng(3)
    one, other = (Surface(rng.uniform(-1, 1, (30, 3)), np.arange(30).reshape(10, 3)) for _ in range(2))
    joined = Surface(np.concatenate([one.points, other.points]), np.arange(60).reshape(20, 3))
    pairs = self_crossings(joined)
    between = {(min(a, b), max(a, b) - 10) for a, b in pairs if min(a, b) < 10 <= max(a, b)}
    assert {tuple(pair) for pair in crossings(one, other).tolist()} == between
    assert len(between) > 5


def test_how_far_two_triangles_reach_through_each_other() -> None:
    flat = np.array([[[0.0, 0, 0], [4, 0, 0], [0, 4, 0]]])
    upright = np.array([[[1.0, 1, -0.3], [1, 1, 5], [2, 1.5, 5]]])
    turn = Rotation.random(rng=np.random.default_rng(1))
    assert_allclose(overlaps(flat, upright), [0.3])
    assert_allclose(overlaps(turn.apply(upright[0])[None], turn.apply(flat[0])[None]), [0.3])
    assert_array_equal(overlaps(flat, flat[:, [0, 0, 1]]), [0.0])
