"""Values that nobody means, and strategies that draw them now and then."""

import math
from pathlib import Path
from typing import Any

import damage
import numpy as np
from hypothesis import strategies as st

import fem_reference as fr

NAN, INF = math.nan, math.inf
ARRAYS = [
    np.zeros(0),
    np.zeros((0, 3)),
    np.full((2, 3), NAN),
    np.arange(6).reshape(2, 3),
    np.array("x"),
    np.array(None),
]
ARRAYS += [np.ones((8, 3), bool), np.ones((8, 3)) * 1e300, np.zeros((8, 3), complex), np.array([[0, 1, 2, -1]])]
ODD: list[Any] = [
    *damage.NASTY,
    *ARRAYS,
    b"x",
    object(),
    Path("x"),
    lambda: 0,
    lambda *_: NAN,
    print,
    int,
    1j,
    np.float64(NAN),
]
ODD += [
    {},
    {"a": 1},
    {1: 2},
    (),
    (NAN,),
    (1, 0),
    ("x",),
    {1, 2},
    range(3),
    np.int64(2),
    np.bool_(True),
    fr.InputError,
    fr,
]

odd = st.sampled_from(ODD)


def rarely(draw: Any, times: int) -> bool:
    """Once in so many ``times``."""
    return bool(draw(st.integers(1, times)) == times)


@st.composite
def often(draw: Any, usual: list[Any], times: int = 32) -> Any:
    """One of what is usual, or once in so many ``times`` what nobody means."""
    return draw(odd) if rarely(draw, times) else draw(st.sampled_from(usual))


@st.composite
def altered(draw: Any, array: np.ndarray) -> Any:
    """An array with one number, or its shape or type, changed; or something else."""
    what = draw(st.integers(0, 11))
    if what > 4 or not array.size:
        return array
    found = np.array(array)
    place = np.unravel_index(draw(st.integers(0, found.size - 1)), found.shape)
    if what == 0:
        return draw(odd)
    if what == 1:
        return [found.T, found[:-1], found[:0], found.tolist(), found.astype(object), found.astype(complex)][
            draw(st.integers(0, 5))
        ]
    values = [-1, 0, 7, 8, 2**40] if found.dtype.kind == "i" else [NAN, INF, 1e300, 1e-300, 0.0, -3.0, 0.5]
    found[place] = draw(st.sampled_from(values))
    return found
