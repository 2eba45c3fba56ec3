"""Distinct rows, compared with the same function of NumPy, which sorts rows instead of integers."""

import numpy as np
import pytest
from numpy.testing import assert_array_equal

from fem_reference.foundations.rows import distinct


@pytest.mark.parametrize(
    "rows",
    [
        np.random.default_rng(1).integers(0, 6, (400, 3)),
        np.random.default_rng(2).integers(-4, 3, (200, 2)),
        np.random.default_rng(3).integers(0, 5, (60, 1)),
        # The span of each column is so large that no 64-bit integer can number all rows.
        np.repeat(np.random.default_rng(4).integers(0, 10**15, (50, 5)), 2, axis=0),
        np.array([[-(2**62), 0], [2**62, 1], [-(2**62), 0]]),
        np.zeros((0, 3), np.int64),
        np.array([[7, 7, 7]]),
    ],
)
def test_rows_are_those_of_numpy_in_its_order(rows) -> None:
    wanted = np.unique(rows, axis=0, return_index=True, return_inverse=True, return_counts=True)
    for one, other in zip(distinct(rows), wanted, strict=True):
        assert_array_equal(one, other.reshape(one.shape))
