"""Cross-sections of a field in tetrahedra: area, moments and the map to the unit square of shapes with closed forms."""

import numpy as np
import pytest
import shapes
from numpy.testing import assert_allclose

from fem_reference.foundations.mesh import TetMesh, triangle_areas
from fem_reference.geometry.cross_sections import CrossSection, carried, cross_section

Z = np.array([0.0, 0.0, 1.0])


@pytest.mark.parametrize("level", [17.3, 20.0])
def test_a_rectangle_has_its_area_moments_and_a_linear_map(level: float) -> None:
    """Moments of a rectangle are sides squared over 12; a level through points of the mesh is moved by 1e-4."""
    box = shapes.box((4, 3, 6), (14.0, 10.0, 60.0))
    found = cross_section(box, box.points[:, 2], level)
    assert triangle_areas(found.points, found.triangles).sum() == pytest.approx(140, rel=1e-6)
    assert_allclose(found.normal, Z, atol=1e-6)
    centre, product = found.moments
    assert_allclose(centre, [7, 5, level], atol=1e-3)
    assert_allclose(product[:2, :2], np.diag([14**2, 10**2]) / 12, atol=1e-5)
    assert_allclose(found.square(found.turns(np.array([1.0, 0, 0]))), found.points[:, :2] / [14, 10], atol=1e-5)
    turned = found.square(found.turns(np.array([0.0, 1, 0])))
    assert_allclose(turned, np.column_stack([found.points[:, 1] / 10, 1 - found.points[:, 0] / 14]), atol=1e-5)


def test_the_greatest_piece_counts_and_holes_do_not() -> None:
    """Of two bars the thicker one; a section around a hole, and one beyond the body, are none."""
    thick, thin = shapes.box((2, 2, 4), (6.0, 6.0, 20.0)), shapes.box((1, 1, 4), (2.0, 2.0, 20.0))
    both = TetMesh(
        np.concatenate([thin.points + [30, 0, 0], thick.points]),
        np.concatenate([thin.tets, thick.tets + len(thin.points)]),
    )
    found = cross_section(both, both.points[:, 2], 7.0)
    assert triangle_areas(found.points, found.triangles).sum() == pytest.approx(36, rel=1e-9)
    block = shapes.box((6, 6, 4), (6.0, 6.0, 4.0))
    middles = block.points[block.tets].mean(axis=1)
    pipe = TetMesh(block.points, block.tets[np.abs(middles[:, :2] - 3).max(axis=1) > 1])
    assert cross_section(pipe, pipe.points[:, 2], 1.7) is None
    assert cross_section(block, block.points[:, 2], 9.0) is None


AROUND = np.arange(80) / 80


def _fan(rim: np.ndarray, height: float = 0.0, first: int = 0) -> CrossSection:
    """The section at a ``height`` within a star-shaped ``rim`` (k, 2), whose points are numbered from the ``first`` on."""
    rim = np.roll(rim, -first, axis=0)
    points = np.column_stack([np.concatenate([rim, [[0, 0]]]), np.full(len(rim) + 1, height)])
    ends = np.arange(len(rim))
    return CrossSection(points, np.stack([ends, np.roll(ends, -1), np.full(len(rim), len(rim))], axis=1), Z)


def _square(side: float) -> np.ndarray:
    """A square (80, 2) of 20 points a side about the origin, from the corner right above."""
    along = np.linspace(-side / 2, side / 2, 21)[:-1]
    end = np.full(20, side / 2)
    sides = [(-along, end), (-end, -along), (along, -end), (end, along)]
    return np.concatenate([np.stack(one, axis=1) for one in sides])


def _turns(section: CrossSection) -> dict[tuple[float, float], float]:
    """The places of a section's rim around the unit square, its first side along x, by point."""
    return _by_point(section, section.turns(np.array([1.0, 0, 0])))


def _by_point(section: CrossSection, turns: np.ndarray) -> dict[tuple[float, float], float]:
    points = np.round(section.points[section.rim, :2], 9) + 0.0
    return {(x, y): turn for (x, y), turn in zip(points.tolist(), turns.tolist(), strict=True)}


def _away(one: float, other: float) -> float:
    return abs((one - other + 0.5) % 1 - 0.5)


@pytest.mark.parametrize("first", [0, 7, 53])
def test_the_same_rim_keeps_its_places_wherever_its_numbers_begin(first: int) -> None:
    known, other = _fan(_square(10)), _fan(_square(10), 3.0, first)
    want, found = _turns(known), _by_point(other, carried(known, known.turns(np.array([1.0, 0, 0])), other))
    assert max(_away(found[at], want[at]) for at in want) < 1e-9


def test_a_fin_on_one_side_moves_no_place_on_the_others() -> None:
    """Half of the upper side becomes a fin 15 mm high, which adds 30 mm to 40; on the other sides shares of length alone would move
    places by up to 3/16 of a turn. A tenth of that stays (7/360); one sample, and four to either side in the mean, are 5/360.
    """
    rim = _square(10)
    rim[5:11, 1] += np.array([0, 8, 15, 15, 8, 0])
    known, other = _fan(_square(10)), _fan(rim, 3.0)
    want, found = _turns(known), _by_point(other, carried(known, known.turns(np.array([1.0, 0, 0])), other))
    others = [at for at in want if at[1] < 4]
    assert len(others) > 50
    assert max(_away(found[at], want[at]) for at in others) < 12 / 360
    length = _turns(other)
    assert max(_away(length[at], want[at]) for at in others) > 25 / 360, "negative control: shares of length"


def test_places_stay_in_order_and_apart() -> None:
    """From a star to a disc: a tenth of the plain shift is in each match, so that none of 80 steps has less than half of that."""
    angle = 2 * np.pi * AROUND
    disc = 5 * np.stack([np.cos(angle), np.sin(angle)], axis=1)
    star = disc * (1 + 0.6 * np.cos(5 * angle))[:, None]
    known, other = _fan(star), _fan(disc, 2.0)
    turns = carried(known, known.turns(np.array([1.0, 0, 0])), other)
    steps = np.diff(turns, append=turns[:1]) % 1
    assert steps.min() > 0.05 / len(steps)
    assert steps.sum() == pytest.approx(1)


def test_a_step_along_the_muscle_costs_nothing() -> None:
    """An oblique prism: sections inclined by 45 degrees, the next one 40 mm further along their normal."""
    plane = np.array([[1, 0, -1], [0, np.sqrt(2), 0]]) / np.sqrt(2)
    flat = _fan(_square(10))
    known, other = (
        CrossSection(
            flat.points[:, :2] @ plane + along * np.array([1, 0, 1]), flat.triangles, np.array([1, 0, 1]) / np.sqrt(2)
        )
        for along in (0, 40 / np.sqrt(2))
    )
    turns = known.turns(plane[0])
    assert_allclose(carried(known, turns, other), turns, atol=1e-9)
