"""Sums of radial basis functions: interpolation, polynomials, centres."""

from collections.abc import Callable

import numpy as np
import pytest

from fem_reference.foundations.errors import InputError
from fem_reference.foundations.mesh import Floats
from fem_reference.geometry import radial_basis as rb

POINTS = np.random.default_rng(5).uniform(size=(60, 2))
VALUES = np.sin(3 * POINTS[:, 0]) * np.cos(2 * POINTS[:, 1])


def test_halton_begins_as_printed() -> None:
    """The report's section 3.5.1, and (3.9) in base 2."""
    np.testing.assert_allclose(rb.halton(3, 2), [[1 / 2, 1 / 3], [1 / 4, 2 / 3], [3 / 4, 1 / 9]], atol=1e-15)
    binary = [1 / 2, 1 / 4, 3 / 4, 1 / 8, 5 / 8, 3 / 8, 7 / 8]
    np.testing.assert_allclose(rb.halton(7, 1)[:, 0], binary, atol=1e-15)


@pytest.mark.parametrize("terms", [0, 1, 3])
def test_as_many_centres_as_points_interpolate(terms: int) -> None:
    found = rb.radial_sum(POINTS[:20], VALUES[:20], POINTS[:20], 3.0, terms=terms)
    np.testing.assert_allclose(found(POINTS[:20]), VALUES[:20], atol=1e-6)


def test_a_plane_is_kept_by_the_polynomial_and_not_without_it() -> None:
    plane = 2 - POINTS[:, 0] + 3 * POINTS[:, 1]
    centres = rb.halton_centres(POINTS, 8)
    kept = rb.radial_sum(POINTS, plane, centres, 4.0, terms=3)
    np.testing.assert_allclose(kept(POINTS), plane, atol=1e-10)
    np.testing.assert_allclose(kept.polynomial, [2, -1, 3], atol=1e-9)
    np.testing.assert_allclose(kept.weights, 0, atol=1e-9)
    assert np.abs(rb.radial_sum(POINTS, plane, centres, 4.0)(POINTS) - plane).max() > 0.1


def test_weights_are_orthogonal_to_the_polynomial() -> None:
    """The last rows of (3.10)."""
    found = rb.radial_sum(POINTS, VALUES, POINTS[:15], 3.0, terms=3)
    np.testing.assert_allclose(
        [found.weights.sum(), *(found.weights @ POINTS[:15])], 0, atol=1e-7 * abs(found.weights).max()
    )


def test_more_centres_are_never_worse_and_greedy_finds_the_bump() -> None:
    """A greedy sum's mean square error falls with each centre, as each space contains the one before."""
    off = []
    for count in (4, 8, 16, 32):
        centres = rb.greedy_centres(POINTS, VALUES, count, 3.0)
        off.append(np.square(rb.radial_sum(POINTS, VALUES, centres, 3.0)(POINTS) - VALUES).sum())
    assert off == sorted(off, reverse=True)
    bump = np.exp(-200 * ((POINTS - POINTS[7]) ** 2).sum(axis=1))
    np.testing.assert_array_equal(rb.greedy_centres(POINTS, bump, 1, 3.0)[0], POINTS[7])
    np.testing.assert_array_equal(rb.feature_centres(POINTS, bump, 1)[0], POINTS[7])


def test_grid_has_the_corners_and_at_most_the_count() -> None:
    found = rb.grid_centres(POINTS, 10)
    assert len(found) == 9
    np.testing.assert_allclose(found[[0, -1]], [POINTS.min(axis=0), POINTS.max(axis=0)])


@pytest.mark.parametrize("choose", [rb.greedy_centres, rb.feature_centres])
def test_turned_scaled_and_renumbered_points_have_the_same_sum(choose: Callable[..., Floats]) -> None:
    """With centres chosen among the points; those of a grid and Halton's are in a box along the axes. A shape is over a length."""
    rng, shape = np.random.default_rng(2), 3.0
    turn, order = np.linalg.qr(rng.normal(size=(2, 2))).Q, rng.permutation(len(POINTS))
    there, values = (2.5 * POINTS @ turn.T + [30, -5])[order], VALUES[order]
    kept = {"shape": shape, "terms": 3} if choose is rb.greedy_centres else {}
    own = choose(POINTS, VALUES, 12, **kept)
    other = choose(there, values, 12, **(kept and kept | {"shape": shape / 2.5}))
    np.testing.assert_allclose(other, 2.5 * own @ turn.T + [30, -5], atol=1e-9)
    asked = rng.uniform(size=(9, 2))
    here = rb.radial_sum(POINTS, VALUES, own, shape, terms=3)(asked)
    found = rb.radial_sum(there, values, other, shape / 2.5, terms=3)(2.5 * asked @ turn.T + [30, -5])
    np.testing.assert_allclose(found, here, atol=1e-7)
    assert np.ptp(here) > 0.5


@pytest.mark.parametrize("count", [0, 3, 61])
def test_too_few_or_too_many_centres_are_refused(count: int) -> None:
    with pytest.raises(InputError, match="centres"):
        rb.radial_sum(POINTS, VALUES, np.zeros((count, 2)), 3.0, terms=3)
