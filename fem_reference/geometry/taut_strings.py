"""Taut strings of points around obstacles. They approximate the shortest paths and show which obstacles the paths touch."""

from collections.abc import Sequence
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from fem_reference.foundations.mesh import Floats, Ints
from fem_reference.geometry.obstacles import Ring, SmoothSurface

Flags = NDArray[np.bool_]

# The number of pieces of a string, the number of sweeps over it, and the overrelaxation of a sweep (1 moves a point to the midpoint
# of its neighbours).
_PIECES, _SWEEPS, _BEYOND = 48, 120, 1.8
# The maximum number of points of a string; very thin tubes would need more, so that no piece slips past them.
MOST = 10_000


def taut(obstacles: Sequence[SmoothSurface], starts: Floats, ends: Floats) -> Floats:
    """Points (n, N, 3) of n strings that are nearly taut: each point is at the midpoint of its neighbours or on an obstacle."""
    rings = [one for one in obstacles if isinstance(one, Ring)]
    string = _piecewise([starts, *(ring.through(starts, ends) for ring in rings), ends])
    # Points are moved aside slightly, because the outward direction is undefined at the centre of an obstacle.
    aside = 1e-6 * np.cross(ends - starts, np.eye(3)[np.argmin(np.abs(ends - starts), axis=1)])
    string[:, 1:-1] += aside[:, None]
    for ring in rings:  # no piece may slip past the tube
        while string.shape[1] <= MOST and np.linalg.norm(np.diff(string, axis=1), axis=2).max() > ring.tube / 2:
            string = halved(string)
    for first in (1, 2) * _SWEEPS:
        inner = np.arange(first, string.shape[1] - 1, 2)
        middle = (string[:, inner - 1] + string[:, inner + 1]) / 2
        points = (string[:, inner] + _BEYOND * (middle - string[:, inner])).reshape(-1, 3)
        for obstacle in obstacles:
            points = obstacle.pushed(points)
        string[:, inner] = points.reshape(middle.shape)
    return string


def _piecewise(stations: list[Floats]) -> Floats:
    """Points (n, N, 3) of n strings, on the straight segments between successive ``stations``: one point of each string (n, 3)."""
    shares = (np.arange(_PIECES) / _PIECES)[:, None]
    parts = [one[:, None] + shares * (other - one)[:, None] for one, other in pairwise(stations)]
    return np.concatenate([*parts, stations[-1][:, None]], axis=1)


def halved(string: Floats) -> Floats:
    """Insert a point at the midpoint of each piece of the strings (n, N, 3); returns (n, 2 N - 1, 3)."""
    finer = np.repeat(string, 2, axis=1)[:, :-1]
    finer[:, 1::2] = (string[:, :-1] + string[:, 1:]) / 2
    return finer


def touching(obstacle: SmoothSurface, string: Floats) -> Flags:
    """Mask (n, N) of the points of a halved ``string`` that may touch an obstacle: those whose gap to it is no larger than the
    gap of a tangent line a third of a piece away from the point of tangency. The pieces are those before the string was halved.
    """
    value, slope = obstacle.level(string.reshape(-1, 3))
    away = (value / np.maximum(np.linalg.norm(slope, axis=1), 1e-12)).reshape(string.shape[:2])
    piece = np.linalg.norm(np.diff(string, axis=1), axis=2).max(axis=1) * 2
    return np.asarray(away < (piece**2 / (16 * obstacle.bend))[:, None] + 1e-9)


def met(obstacles: Sequence[SmoothSurface], string: Floats) -> list[tuple[int, ...]]:
    """Return the obstacles that each path may touch, in the order in which the path passes them."""
    flags = np.array([touching(obstacle, halved(string)) for obstacle in obstacles])
    count = flags.sum(axis=2)
    middle = (flags * np.arange(flags.shape[2])).sum(axis=2) / np.maximum(count, 1)
    order = np.argsort(middle, axis=0, kind="stable")
    return [tuple(int(j) for j in column if count[j, i]) for i, column in enumerate(order.T)]


def longest(flags: Flags) -> tuple[Ints, Ints]:
    """Return the indices of the first and the last entry of the longest run of True in each row (n, N)."""
    run = np.zeros(flags.shape, dtype=np.int64)
    for i, column in enumerate(flags.T):
        run[:, i] = np.where(column, run[:, i - 1] + 1, 0)
    last = run.argmax(axis=1)
    return last + 1 - run.max(axis=1), last
