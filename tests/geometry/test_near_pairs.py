"""Pairs of triangles that may intersect: none that does is left out, few that do not are kept, with and without a compiler."""

import itertools

import igl
import numpy as np
import pytest
import shapes
from igl import predicates
from scipy.spatial.transform import Rotation

from fem_reference.foundations import native
from fem_reference.foundations.mesh import Surface
from fem_reference.geometry import near_pairs as module
from fem_reference.geometry.intersections import crossings, self_crossings
from fem_reference.geometry.near_pairs import near_pairs, parts_of, reached

FLAT = np.array([[0.0, 0, 0], [2, 0, 0], [0, 2, 0]])


def pairs(one: Surface, other: Surface) -> set[tuple[int, ...]]:
    found = near_pairs(one, other)
    assert found is not None
    assert len(np.unique(found, axis=0)) == len(found)  # each once
    return set(map(tuple, found.tolist()))


def crumpled(seed: int, share: float) -> Surface:
    """A sphere at the hip, of which a ``share`` of the vertices is moved by half its radius, turned at random."""
    rng, ball = np.random.default_rng(seed), shapes.sphere(2, 30.0)
    moved = ball.points + 15 * (rng.random((len(ball.points), 1)) < share) * rng.uniform(-1, 1, ball.points.shape)
    return ball.moved_to(Rotation.random(rng=rng).apply(moved) + [146, 238, -431])


@pytest.mark.parametrize("share", [0.0, 0.1, 1.0])
def test_of_crumpled_surfaces_none_that_libigl_finds_to_cross_is_left_out(share) -> None:
    """Exact predicates of libigl on all triangles, whose pairs that touch at a corner or along an edge are no crossings."""
    for seed in range(4):
        given = crumpled(seed, share)
        kept, (_, exact, _) = pairs(given, given), predicates.find_self_intersections(given.points, given.triangles)
        assert {tuple(sorted(pair)) for pair in exact.tolist()} - {tuple(sorted(pair)) for pair in kept} == set()
        if not share:
            assert kept == set()  # of 320 triangles, each of which touches twelve others


def test_of_two_surfaces_none_that_touches_is_left_out() -> None:
    rng = np.random.default_rng(2)
    # Sizes from 0.01 to 10, so that triangles reach over many cells or lie in one.
    soups = [
        Surface(
            (
                rng.uniform(-5, 5, (80, 1, 3)) + 10 ** rng.uniform(-2, 1, (80, 1, 1)) * rng.normal(size=(80, 3, 3))
            ).reshape(-1, 3),
            np.arange(240).reshape(80, 3),
        )
        for _ in range(2)
    ]
    _, exact, _ = predicates.find_intersections(*(array for one in soups for array in (one.points, one.triangles)))
    exact = set(map(tuple, exact.tolist()))
    kept = pairs(*soups)
    assert len(exact) > 50
    assert exact <= kept
    assert len(kept) < 3 * len(exact)
    assert {pair[::-1] for pair in pairs(*soups[::-1])} == kept


def test_of_a_crowd_in_one_place_none_is_left_out() -> None:
    # 70 triangles of all directions through one point, in the same cells: each meets each.
    rng = np.random.default_rng(5)
    crowds = []
    for _ in range(2):
        corners = rng.normal(size=(70, 3, 3))
        corners[:, 2] = -(corners[:, 0] + corners[:, 1])  # the origin is in the middle of each
        crowds.append(Surface(corners.reshape(-1, 3), np.arange(210).reshape(70, 3)))
    assert pairs(*crowds) == set(itertools.product(range(70), repeat=2))
    itself = {tuple(sorted(pair)) for pair in pairs(crowds[0], crowds[0])}
    assert itself == set(itertools.combinations(range(70), 2))


@pytest.mark.parametrize("axis", range(3))
@pytest.mark.parametrize("side", [-1, 1])
def test_what_touches_the_whole_of_the_other_from_outside_is_kept(axis, side) -> None:
    ball = shapes.sphere(2, 30.0)
    tip = ball.points[np.argmax(side * ball.points[:, axis])]
    outwards = np.zeros(3)
    outwards[axis] = 5.0 * side
    around = np.roll([0.0, 3.0, 0.0], axis)
    corners = np.array([tip, tip + outwards + around, tip + outwards - around])
    touched = {t for t, corners in enumerate(ball.points[ball.triangles]) if (corners == tip).all(axis=1).any()}
    for turn in range(3):  # whichever of its corners touches
        beside = Surface(np.roll(corners, turn, axis=0), np.array([[0, 1, 2]]))
        assert {t for _, t in pairs(beside, ball)} >= touched
    assert pairs(beside.moved_to(beside.points + outwards), ball) == set()


@pytest.mark.parametrize("gap", [1e-6, 0.0, -1e-13])
def test_a_gap_of_a_nanometre_is_certain_and_what_touches_is_kept(gap) -> None:
    plate = Surface(FLAT, np.array([[0, 1, 2]]))
    beside = [] if gap > 0 else [[1.0 + gap, 1.0 + gap, 0.0]]  # at an edge
    for tip, apart in itertools.product(([0.5, 0.5, gap], *beside), ([0.0, 0, 3], [146, 238, -431])):
        spike = np.array([tip, [1.4, 1.5, 3], [1.6, 1.4, 3]])
        kept = pairs(plate.moved_to(plate.points + apart), Surface(spike + apart, np.array([[0, 1, 2]])))
        assert kept == (set() if gap > 0 else {(0, 0)})


def test_triangles_in_one_plane_that_overlap_or_touch_are_kept_and_neighbours_are_not() -> None:
    points = np.concatenate(
        [FLAT, [[0.5, 0.5, 0], [3, 1, 0], [1, 3, 0], [-1, -1, 0], [2, 2, 0], [-2, 0, 0], [0, -2, 0]]]
    )
    over, edge, corner, beside = [3, 4, 5], [1, 7, 2], [0, 8, 9], [0, 3, 4]
    both = [Surface(points, np.array([[0, 1, 2], other])) for other in (over, edge, corner, beside)]
    assert [len(pairs(one, one)) for one in both] == [1, 0, 0, 1]
    # An edge apart from the common corner goes through the other triangle, or ends a nanometre from it.
    for height, count in ((0.5, 1), (1e-9, 1), (-1e-6, 0)):
        through = Surface(np.concatenate([FLAT, [[1.0, 0.4, -height], [1, 0.6, 1]]]), np.array([[0, 1, 2], [0, 3, 4]]))
        assert len(pairs(through, through)) == count
        assert len(self_crossings(through)) == count


@pytest.mark.parametrize("size", [1e-300, 1e-60, 1e100, 1e300])
def test_of_sizes_whose_powers_are_no_numbers_nothing_is_certain(size) -> None:
    rng = np.random.default_rng(0)
    soup = Surface(size * rng.uniform(-1, 1, (30, 3)), np.arange(30).reshape(10, 3))
    unit = Surface(soup.points / size, soup.triangles)
    assert pairs(unit, unit) <= pairs(soup, soup)
    assert len(self_crossings(unit)) > 0


def test_a_surface_that_is_met_again_gives_what_a_new_one_gives() -> None:
    """Its sorted triangles are kept: those of ten surfaces, two more than that, must not be mixed up, nor be of a moved one."""
    bones = [crumpled(seed, 0.3) for seed in range(10)]
    body = crumpled(20, 0.3)
    for shift in (0.0, 7.0):
        moved = body.moved_to(body.points + shift)
        for bone in (*bones, bones[9].moved_to(bones[9].points + 3.0)):
            again = pairs(moved, bone)
            assert len(again) > 10
            assert again == pairs(moved, Surface(bone.points.copy(), bone.triangles.copy()))


def test_degenerate_and_empty_surfaces() -> None:
    point = Surface(np.zeros((3, 3)), np.array([[0, 1, 2]]))
    nothing = Surface(np.zeros((3, 3)), np.zeros((0, 3)))
    assert pairs(point, Surface(np.zeros((3, 3)), np.array([[0, 1, 2]]))) == {(0, 0)}
    assert pairs(point, nothing) == pairs(nothing, point) == pairs(nothing, nothing) == pairs(point, point) == set()
    lost = Surface(np.full((3, 3), np.nan), np.array([[0, 1, 2]]))
    assert near_pairs(point, lost) is None


# Points alone, near points, and reaches over many triangles.
@pytest.mark.parametrize("reach", [0.0, 1.0, 30.0])
@pytest.mark.parametrize("count", [1, 50])
def test_the_triangles_whose_boxes_points_reach_are_found(count, reach) -> None:
    """By comparing each box with each point."""
    found = 0
    for seed in range(4):
        rng, given = np.random.default_rng(seed), crumpled(seed, 0.3)
        corners = given.points[given.triangles]
        points = rng.choice(corners[:, 0], count) + reach * rng.uniform(-1, 1, (count, 3))
        reaches = reach * rng.uniform(0, 1, count)
        away = np.maximum(corners.min(axis=1)[:, None] - points, points - corners.max(axis=1)[:, None]).max(axis=2)
        meets = (away <= reaches).any(axis=1)
        assert reached(given, points, reaches).tolist() == np.flatnonzero(meets).tolist()
        found += meets.sum()
    assert found
    assert not len(reached(given, points + 500, reaches))


def test_parts_begin_at_their_first_vertices() -> None:
    """Of three spheres whose triangles and vertices are mixed, by libigl."""
    rng, balls = np.random.default_rng(0), [shapes.sphere(2, size) for size in (1.0, 2.0, 3.0)]
    starts = np.cumsum([0, *(len(ball.points) for ball in balls)])
    triangles = np.concatenate([ball.triangles + start for ball, start in zip(balls, starts, strict=False)])
    names = rng.permutation(starts[-1])
    surface = Surface(np.zeros((starts[-1], 3)), rng.permutation(names[triangles]))
    firsts, own = parts_of(surface)
    true = igl.vertex_components(surface.triangles)
    assert firsts.tolist() == sorted(np.flatnonzero(true == part)[0] for part in range(3))
    assert (own == firsts[[int(np.flatnonzero(true[firsts] == part)[0]) for part in true]]).all()


def test_vertices_without_triangles_are_parts_of_their_own() -> None:
    firsts, own = parts_of(Surface(np.zeros((6, 3)), np.array([[4, 1, 2]])))
    assert (firsts.tolist(), own.tolist()) == ([0, 1, 3], [0, 1, 1, 3, 1])


def test_without_a_compiler_the_answers_are_the_same(monkeypatch) -> None:
    given, other = crumpled(0, 0.3), crumpled(1, 0.0)
    with_it = self_crossings(given), crossings(given, other)
    middle, parts = given.points[:1], parts_of(given)
    near = reached(given, middle, np.ones(1))

    def missing(*_: object) -> None:
        raise OSError("cc")

    monkeypatch.setattr(native, "library", missing)
    module._code.cache_clear()
    try:
        assert near_pairs(given, given) is None
        for one, two in zip(with_it, (self_crossings(given), crossings(given, other)), strict=True):
            assert len(one) > 10
            assert set(map(tuple, one.tolist())) == set(map(tuple, two.tolist()))
        parts_of.cache_clear()
        assert [found.tolist() for found in parts_of(given)] == [found.tolist() for found in parts]
        assert reached(given, middle, np.ones(1)).tolist() == near.tolist()
    finally:
        module._code.cache_clear()


@pytest.mark.parametrize("far", [1e155, 1e300, 1.7e308])
def test_places_very_far_away_are_searched(far) -> None:
    """Differences of the farthest overflow, and so would the cells of a grid; of the others only squares do."""
    ball = shapes.sphere(1, 1.0)
    lost = ball.moved_to(ball.points * far)
    assert (near_pairs(lost, lost) is None) == (far > 1e307)
    assert len(reached(lost, np.zeros((1, 3)), np.array([far]))) > 0


def test_an_infinite_reach_is_of_all_triangles_and_no_points_of_none() -> None:
    ball = shapes.sphere(1, 1.0)
    found = reached(ball, np.zeros((2, 3)), np.array([np.inf, 1.0]))
    assert found.tolist() == list(range(len(ball.triangles)))
    assert len(reached(ball, np.zeros((0, 3)), np.zeros(0))) == 0


def test_a_negative_vertex_number_is_refused() -> None:
    with pytest.raises(ValueError, match="a triangle has a negative vertex number"):
        parts_of(Surface(FLAT, np.array([[0, -1, 2]])))
