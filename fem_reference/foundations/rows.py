"""Distinct rows of arrays of integers, such as the edges and facets of a mesh."""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray


class Distinct(NamedTuple):
    """The m distinct rows of an array of integers (n, k), in lexicographic order.

    ``rows`` (m, k): the distinct rows. ``first`` (m,): the first index of each. ``which`` (n,): for each of the n rows,
    the index of the equal distinct row. ``counts`` (m,): how often each distinct row occurs.
    """

    rows: NDArray[np.int64]
    first: NDArray[np.int64]
    which: NDArray[np.int64]
    counts: NDArray[np.int64]


def distinct(rows: NDArray[np.int64]) -> Distinct:
    """The distinct ``rows`` (n, k), as ``np.unique(rows, axis=0)`` finds them. This function is several times faster, because it
    sorts one integer for each row.
    """
    lowest, highest = (bound(axis=0, initial=0) for bound in (rows.min, rows.max))
    spans = [high - low + 1 for low, high in zip(lowest.tolist(), highest.tolist(), strict=True)]
    if math.prod(spans) < 2**63:
        strides = np.array([math.prod(spans[i + 1 :]) for i in range(len(spans))], np.int64)
        keys = (rows - lowest) @ strides
    else:  # too many for 64-bit integers
        keys = np.unique(rows, axis=0, return_inverse=True)[1].ravel()
    _, first, which, counts = np.unique(keys, return_index=True, return_inverse=True, return_counts=True)
    return Distinct(rows[first], first, which, counts)
