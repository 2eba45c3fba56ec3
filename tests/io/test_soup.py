"""Points, triangles and lines as readers return them: joined where they go on, refused where they are none."""

import numpy as np
import pytest

from fem_reference.io import soup

POINTS = np.arange(12.0).reshape(4, 3)


def test_arrays_are_floats_and_integers() -> None:
    points, triangles = soup.arrays((POINTS.astype(np.float32), [[0.0, 1.0, 2.0]]))
    assert (points.dtype, triangles.dtype) == (np.float64, np.int64)
    assert np.array_equal(points, POINTS)
    assert triangles.tolist() == [[0, 1, 2]]


@pytest.mark.parametrize(
    ("points", "corners", "problem"),
    [
        (POINTS, np.zeros((0, 3)), "no triangles"),
        (np.zeros((0, 3)), [[0, 1, 2]], "no vertices"),
        (POINTS[:, :2], [[0, 1, 2]], r"points of shape \(4, 2\)"),
        (POINTS, [[0, 1]], r"corners of shape \(1, 2\) that are not three point numbers each"),
        (POINTS, [[0, 1, 2.5]], "not three point numbers each"),
    ],
)
def test_what_is_no_surface_is_refused(points: np.ndarray, corners: list, problem: str) -> None:
    with pytest.raises(ValueError, match=problem):
        soup.arrays((points, corners))


def test_lines_go_on_where_another_ends() -> None:
    assert soup.joined([[0, 1], [1, 2, 3], [5, 6]]) == [[0, 1, 2, 3], [5, 6]]
    assert soup.joined([[0, 1], [1, 2], [1, 3]]) == [[0, 1], [1, 2], [1, 3]]
    with pytest.raises(ValueError, match="lines that form a closed ring"):
        soup.joined([[0, 1], [1, 0]])


def test_rows_bring_the_same_floats_back() -> None:
    wanted = np.array([[1 / 3, 1e-320, -0.0], [1e300, 0.1, 7]])
    assert np.array_equal([[float(word) for word in row.split()] for row in soup.rows(wanted)], wanted)
