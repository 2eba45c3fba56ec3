"""Rims of consecutive sections of a muscle matched point by point, so that a changing outline does not turn lines along it."""

import numpy as np

from fem_reference.foundations.mesh import Floats, Ints
from fem_reference.geometry.cross_sections import CrossSection

_SAMPLES = 360  # points of a rim that are matched
_REACH = 60  # samples by which a match may be ahead of the shift of the whole rim, or behind it
_STEPS = (-1, 0, 1, 2, 3)  # samples that a match may gain on the one before: none passes another
_STIFFNESS = 0.01  # of a rim's length: a rim twice as long costs as much as one so far away
_WINDOW = 9  # samples whose mean smooths a match
_LEAST = 0.1  # share of the plain shift in a match: no two points meet


def carried(known: CrossSection, turns: Floats, other: CrossSection) -> Floats:
    """The places (m,) around the unit square of the ``other`` section's rim, from those (n,) of the ``known`` one's.

    The points of the other rim are matched in order with points of the known one, so that the mean square of their distance across
    the muscle is least, and with it a cost of stretch.
    """
    normal = known.normal + other.normal
    normal /= max(float(np.linalg.norm(normal)), 1e-12)
    one, two = (_flat(section.points[section.rim], normal) for section in (known, other))
    old, new = (_shares(section.points[section.rim]) for section in (known, other))
    begin = _continued(np.zeros(1), turns, old)
    start = _nearest(two, new, _at(begin, old, one)[0])
    at = np.arange(_SAMPLES) / _SAMPLES
    ahead = _matched(_at(begin + at, old, one), _at(start + at, new, two))
    relative = new - start
    place = begin + relative + np.interp(relative, at, ahead, period=1)
    return _continued(place, old, turns) % 1


def _flat(points: Floats, normal: Floats) -> Floats:
    return points - np.outer(points @ normal, normal)


def _shares(rim: Floats) -> Floats:
    """The shares (k,) of its length from the first point of a closed ``rim`` (k, 3) to each."""
    lengths = np.linalg.norm(np.roll(rim, -1, axis=0) - rim, axis=1)
    return np.concatenate([[0.0], np.cumsum(lengths)[:-1]]) / lengths.sum()


def _at(places: Floats, shares: Floats, rim: Floats) -> Floats:
    """Points (n, 3) at ``places`` (n,) of a closed ``rim`` (k, 3) that has its points at ``shares`` (k,)."""
    return np.stack([np.interp(places, shares, axis, period=1) for axis in rim.T], axis=1)


def _continued(places: Floats, known: Floats, values: Floats) -> Floats:
    """Cyclic values (n,) at cyclic ``places`` (n,), between ``values`` (k,) at ``known`` places (k,) around a rim, all in turns."""
    return places + np.interp(places, known, np.unwrap(values - known, period=1), period=1)


def _nearest(rim: Floats, shares: Floats, point: Floats) -> float:
    """The place at which a closed ``rim`` (k, 3) is nearest to a ``point`` (3,)."""
    ahead = np.roll(rim, -1, axis=0) - rim
    squares = np.maximum((ahead**2).sum(axis=1), np.finfo(float).tiny)
    along = np.clip(((point - rim) * ahead).sum(axis=1) / squares, 0, 1)
    i = int(np.argmin(np.linalg.norm(rim + along[:, None] * ahead - point, axis=1)))
    return float(shares[i] + along[i] * (np.append(shares, 1.0)[i + 1] - shares[i]))


def _matched(one: Floats, other: Floats) -> Floats:
    """The shares (n,) of its length by which each sample of a rim ``one`` (n, 3) is ahead of its match on the ``other``."""
    shift = int(np.argmin([((np.roll(one, -by, axis=0) - other) ** 2).sum() for by in range(len(one))]))
    reach = range(shift - _REACH, shift + _REACH + 1)
    apart = np.stack([((np.roll(one, -by, axis=0) - other) ** 2).sum(axis=1) for by in reach], axis=1)
    length = np.linalg.norm(np.diff(other, axis=0, append=other[:1]), axis=1).sum()
    first = int(np.argmin(apart[:, _REACH]))
    gains = np.roll(_least(np.roll(apart, -first, axis=0), (_STIFFNESS * length) ** 2), first)
    around = np.concatenate([gains[-(_WINDOW // 2) :], gains, gains[: _WINDOW // 2]])
    smooth = np.convolve(around, np.full(_WINDOW, 1 / _WINDOW), "valid")
    ahead = shift - len(one) if shift > len(one) / 2 else shift
    return np.asarray((ahead + (1 - _LEAST) * smooth) / len(one))


def _least(apart: Floats, stiffness: float) -> Ints:
    """The gains (n,) from -60 to 60 of least sum of squares ``apart`` (n, 121), with a cost of each step; the first is 0."""
    count, width = apart.shape
    costs, steps = np.full(width, np.inf), np.zeros((count + 1, width), np.int64)
    costs[_REACH] = apart[0, _REACH]
    for i in range(1, count + 1):
        tried = np.full((len(_STEPS), width), np.inf)
        for row, step in zip(tried, _STEPS, strict=True):
            row[max(step, 0) : width + min(step, 0)] = costs[max(-step, 0) : width - max(step, 0)] + stiffness * step**2
        best = np.argmin(tried, axis=0)
        steps[i], costs = np.array(_STEPS)[best], tried[best, np.arange(width)] + apart[i % count]
    gains = np.full(count + 1, _REACH)
    for i in range(count, 0, -1):
        gains[i - 1] = gains[i] - steps[i, gains[i]]
    return gains[:-1] - _REACH
