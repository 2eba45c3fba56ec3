"""Fibres inside a muscle from Catmull-Rom splines between fibres on its surface.

The method is that of Kohout and Cholt, called CHMD (report DCSE/TR-2022-03, 6.1.2).
"""

from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from fem_reference.foundations.errors import InputError
from fem_reference.foundations.mesh import Floats, Ints, Polylines
from fem_reference.geometry.curves import catmull_rom, knots
from fem_reference.geometry.fibres import POINTS, resample

_THIN = 1e-6  # the squared ratio of thickness to width of a section below which its lines count as lying on one surface
_GOLDEN = np.pi * (3 - np.sqrt(5))  # the golden angle [rad], as between consecutive seeds of a sunflower


def between(heads: Sequence[Polylines], count: int) -> Polylines:
    """Create ``count`` lines of 40 points between the surface fibres of ``heads``, more lines in heads of larger cross-section.

    The surface fibres of a head, three or more in any order, must surround it. Each point of a line is on a spline through three
    points: two opposite points of a closed spline around the head and, between them, the mean of the head's surface fibres.
    """
    grids = [_around(_alike(lines, i)) for i, lines in enumerate(heads)]
    lines = [line for grid, share in zip(grids, _shares(grids, count), strict=True) for line in _inside(grid, share)]
    return Polylines(np.concatenate(lines), np.arange(count + 1) * POINTS)


def _alike(lines: Polylines, head: int) -> Floats:
    """Resample the lines of a head to (m, 40, 3), all in the direction of the first line."""
    if len(lines) < 3:
        raise InputError(f"fibres.chmd.heads[{head}]", f"{len(lines)} surface fibres", "three or more, around the head")
    found = np.stack([resample(lines.points[low:high]) for low, high in pairwise(lines.offsets)])
    along = found[:, -1] - found[:, 0]
    back = along @ along[0] < 0
    found[back] = found[back, ::-1]
    return found


def _around(lines: Floats) -> Floats:
    """Sort ``lines`` (m, 40, 3) by the angles of their midpoints around their mean line, beginning with the farthest from it."""
    arms = _halfway(lines)
    angles = np.arctan2(arms[:, 1], arms[:, 0]) % (2 * np.pi)
    return np.asarray(lines[np.argsort(np.where(angles > 2 * np.pi - 1e-9, 0.0, angles))])


def _halfway(lines: Floats) -> Floats:
    """Positions (m, 2) [mm], in a plane across their mean line, of the midpoints of ``lines`` (m, 40, 3). The midpoint that is
    farthest from the mean line is on the first axis.
    """
    mean = lines.mean(axis=0)
    normal = mean[POINTS // 2 + 1] - mean[POINTS // 2 - 1]
    normal /= np.linalg.norm(normal)
    arms = lines[:, POINTS // 2] - mean[POINTS // 2]
    arms -= np.outer(arms @ normal, normal)
    first = arms[np.argmax(np.linalg.norm(arms, axis=1))]
    axes = np.array([first, np.cross(normal, first)]) / np.linalg.norm(first)
    return np.asarray(arms @ axes.T)


def outermost(lines: Polylines, count: int) -> Polylines:
    """Return at most ``count`` of ``lines``, with 40 points each: in each of ``count`` sectors, the line whose midpoint is
    outermost. The sectors are equal after a stretch that makes the section equally wide in all directions, so that all sides of a
    flat muscle have lines.
    """
    found = _alike(lines, 0)
    arms = _halfway(found)
    scales, axes = np.linalg.eigh(arms.T @ arms)
    if scales[0] <= _THIN * scales[1]:
        raise InputError("fibres.chmd.around", "lines on one surface", "a muscle with a thickness")
    round_ones = arms @ (axes / np.sqrt(scales)) @ axes.T
    angles = np.arctan2(round_ones[:, 1], round_ones[:, 0])
    angles -= angles[np.argmax(arms[:, 0])]  # relative to the farthest line
    sectors = np.rint(count * angles / (2 * np.pi)).astype(np.int64) % count
    order = np.lexsort((-np.linalg.norm(round_ones, axis=1), sectors))
    _, chosen = np.unique(sectors[order], return_index=True)
    best = found[order[chosen]]
    return Polylines(best.reshape(-1, 3), np.arange(len(best) + 1) * POINTS)


def _shares(grids: Sequence[Floats], count: int) -> Ints:
    """Number (len(grids),) of lines of each head, in proportion to its mean cross-section, ``count`` in total."""
    arms = [grid - grid.mean(axis=0) for grid in grids]
    corners = [np.cross(arm, np.roll(arm, -1, axis=0)).sum(axis=0) for arm in arms]
    areas = [np.linalg.norm(one, axis=1).mean() for one in corners]
    exact = count * np.array(areas) / sum(areas)
    shares = np.floor(exact).astype(np.int64)
    shares[np.argsort(shares - exact, kind="stable")[: count - shares.sum()]] += 1
    return shares


def _inside(grid: Floats, count: int) -> list[Floats]:
    """Create ``count`` lines (40, 3) in a head with surface fibres ``grid`` (m, 40, 3), spread like the seeds of a sunflower."""
    order = np.arange(count)
    radii, turns = np.sqrt((order + 0.5) / max(count, 1)), (order * _GOLDEN / (2 * np.pi)) % 1
    centres, found = grid.mean(axis=0), np.empty((count, POINTS, 3))
    for k, centre in enumerate(centres):
        rim, opposite = (_loop(grid[:, k], (turns + half) % 1) for half in (0, 0.5))
        for i in range(count):
            found[i, k] = _across(np.array([rim[i], centre, opposite[i]]), radii[i])
    return [resample(line) for line in found]


def _loop(points: Floats, turns: Floats) -> Floats:
    """Points (n, 3) at the fractions ``turns`` (n,) of a closed spline through ``points`` (m, 3), or a polygon if two coincide."""
    closed = np.concatenate([points[-2:], points, points[:3]])
    at = turns * len(points) + 2
    if np.linalg.norm(np.diff(closed, axis=0), axis=1).min() == 0:
        low = at.astype(np.int64)
        return np.asarray(closed[low] + (at - low)[:, None] * (closed[low + 1] - closed[low]))
    return catmull_rom(closed)(np.interp(at, np.arange(len(closed)), knots(closed, 0.5)))


def _across(points: Floats, radius: float) -> Floats:
    """Point (3,) on a spline through three ``points`` (3, 3), at a ``radius`` that is 1 at the first and 0 at the second."""
    if np.linalg.norm(np.diff(points, axis=0), axis=1).min() == 0:
        return np.asarray(points[1] + radius * (points[0] - points[1]))
    middle = knots(points, 0.5)[1]
    return np.asarray(catmull_rom(points)(middle * (1 - radius)))
