"""Fibres between surface fibres: straight in a prism, arcs in a bent bar, shared among heads, whatever the order."""

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.spatial.transform import Rotation

from fem_reference.foundations.errors import InputError
from fem_reference.foundations.mesh import Polylines
from fem_reference.geometry.surface_fibres import between, outermost

ANGLES = np.array([0.0, 0.9, 2.0, 3.1, 4.0, 5.2])


def _lines(*lines: np.ndarray) -> Polylines:
    return Polylines(np.concatenate(lines), np.cumsum([0, *map(len, lines)]))


def _cylinder(radius: float = 8.0, at: float = 0.0) -> list[np.ndarray]:
    """Lines of 50 mm along z around a cylinder, the first of them a little farther out."""
    rims = radius * np.column_stack([np.cos(ANGLES), np.sin(ANGLES)]) * np.where(ANGLES == 0, 1.1, 1)[:, None]
    heights = np.linspace(0, 50, 12)
    return [np.column_stack([np.tile(rim + [at, 0], (12, 1)), heights]) for rim in rims]


def _bent() -> list[np.ndarray]:
    """Arcs of a right angle about the y axis, at radii from 15 to 32 mm."""
    turn = np.linspace(0, np.pi / 2, 60)
    rims = [24, 0] + 7 * np.column_stack([np.cos(ANGLES), np.sin(ANGLES)]) * np.where(ANGLES == 0, 1.1, 1)[:, None]
    return [np.column_stack([r * np.cos(turn), np.full(60, y), r * np.sin(turn)]) for r, y in rims]


def test_fibres_between_straight_ones_are_straight_as_long_and_inside() -> None:
    found = between([_lines(*_cylinder())], 15)
    assert_allclose(found.lengths(), 50, rtol=1e-9)
    across = found.points.reshape(15, 40, 3)[:, :, :2]
    assert_allclose(np.ptp(across, axis=1), 0, atol=1e-9)
    assert np.linalg.norm(across[:, 0], axis=1).max() < 8.8
    assert np.linalg.norm(across[:, 0], axis=1).min() < 3


def test_fibres_between_arcs_are_arcs_as_long() -> None:
    points = between([_lines(*_bent())], 15).points
    radii = np.linalg.norm(points[:, [0, 2]], axis=1).reshape(15, 40)
    assert np.ptp(radii, axis=1).max() < 0.01
    assert_allclose(between([_lines(*_bent())], 15).lengths(), radii.mean(axis=1) * np.pi / 2, rtol=1e-3)


def test_order_direction_place_and_size_do_not_matter() -> None:
    lines = _bent()
    turn = Rotation.random(rng=np.random.default_rng(2))
    moved = [3 * turn.apply(lines[i]) + 100 for i in (2, 0, 5, 1, 4, 3)]
    moved[3] = moved[3][::-1]
    found, again = (between([_lines(*some)], 9).points for some in (lines, moved))
    assert_allclose(again, 3 * turn.apply(found) + 100, atol=1e-6)


def test_heads_have_fibres_by_their_sections() -> None:
    """Radii of 8 and 4 mm: four to one."""
    found = between([_lines(*_cylinder()), _lines(*_cylinder(4.0, 30.0))], 20).points.reshape(20, 40, 3)
    assert (found[:, 0, 0] > 15).sum() == 4


def test_fibres_that_meet_are_no_obstacle() -> None:
    lines = [np.concatenate([line, [[0.0, 0.0, 60.0]]]) for line in _cylinder()]
    assert_allclose(between([_lines(*lines)], 5).points.reshape(5, 40, 3)[:, -1], [[0, 0, 60]] * 5, atol=1e-9)


def test_two_surface_fibres_are_too_few() -> None:
    with pytest.raises(InputError, match=r"heads\[0\].*2 surface fibres.*three or more"):
        between([_lines(*_cylinder()[:2])], 5)


def _spindle(out: float, turn: float) -> np.ndarray:
    """A fibre of a spindle of 50 mm about the z axis, half as thick at its ends as in its middle, of radius ``out`` [mm]."""
    heights = np.linspace(0, 50, 200)
    radii = out * (1 + np.sin(np.pi * heights / 50)) / 2
    return np.column_stack([radii * np.cos(turn), radii * np.sin(turn), heights])


def test_fibres_between_those_on_a_spindle_are_those_inside_it() -> None:
    """Inside, fibres are at the same share of the radius in each section: where 8 mm thick, and 4 mm at the ends.

    Twelve fibres on the surface; splines between them leave the circle by less than 1 %.
    """
    found = between([_lines(*(_spindle(8.0, turn) for turn in np.arange(12) * np.pi / 6))], 25).points.reshape(
        25, 40, 3
    )
    shares = np.linalg.norm(found[:, :, :2], axis=2) / (4 * (1 + np.sin(np.pi * found[:, :, 2] / 50)))
    assert np.ptp(shares, axis=1).max() < 0.01
    assert shares.min() < 0.2
    assert shares.max() > 0.9


def _flat(across: np.ndarray) -> list[np.ndarray]:
    """Straight lines of 50 mm along z at places ``across`` (k, 2), which are four times as wide as thick."""
    heights = np.linspace(0, 50, 12)
    return [np.column_stack([np.tile(place * [4, 1], (12, 1)), heights]) for place in across]


def test_the_outermost_lines_are_on_all_sides_of_a_flat_section() -> None:
    """Rings of 24 lines: of 12 outermost all are of the outer one, and on a circle where the section is drawn as one."""
    turns = np.arange(24) * np.pi / 12
    rings = np.concatenate([radius * np.column_stack([np.cos(turns), np.sin(turns)]) for radius in (2, 5, 8)])
    found = outermost(_lines(*_flat(rings)), 12)
    places = found.points.reshape(12, 40, 3)[:, 20, :2] / [4, 1]
    assert_allclose(np.linalg.norm(places, axis=1), 8, rtol=1e-9)
    around = np.sort(np.arctan2(places[:, 1], places[:, 0]))
    assert np.diff(around).max() < np.pi / 3  # a sector of 30 degrees on either side of one without a line, at most


def test_order_place_and_size_do_not_matter_to_the_outermost() -> None:
    rng, turn = np.random.default_rng(5), Rotation.random(rng=np.random.default_rng(2))
    lines = _flat(rng.normal(size=(60, 2)))
    moved = [3 * turn.apply(lines[i]) + 100 for i in rng.permutation(60)]
    moved[7:] = [line[::-1] for line in moved[7:]]
    found, again = (outermost(_lines(*some), 10).points.reshape(-1, 40, 3)[:, 20] for some in (lines, moved))
    there = 3 * turn.apply(found) + 100
    assert len(found) == len(again) == 10
    assert_allclose(
        np.linalg.norm(there[:, None] - again, axis=2).min(axis=1), 0, atol=4
    )  # of one line, halfway to a step


def test_lines_on_one_surface_have_no_outside() -> None:
    lines = _lines(*_flat(np.column_stack([np.arange(9.0), np.zeros(9)])))
    with pytest.raises(InputError, match="lines on one surface"):
        outermost(lines, 6)
