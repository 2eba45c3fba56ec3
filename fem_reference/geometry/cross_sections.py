"""Triangulated cross-sections of a muscle, which are isosurfaces of a field, each mapped to the unit square.

The rims of consecutive sections are matched point by point, so that a changing outline does not twist lines along the muscle.
"""

from dataclasses import dataclass
from functools import cached_property

import igl
import numpy as np

from fem_reference.foundations.mesh import Floats, Ints, TetMesh, normals
from fem_reference.foundations.rows import distinct

# A point whose value is this close to the level counts as above it, so that no triangle has two coincident corners.
_NUDGE = 1e-4
# Points on the boundary of the unit square, counter-clockwise: the midpoint of the side x = 1, the four corners, and the midpoint
# again. Their positions along the boundary, as fractions of its length, and their x and y coordinates.
_SHARES = (0, 1 / 8, 3 / 8, 5 / 8, 7 / 8, 1)
_SQUARE = ((1, 1, 0, 0, 1, 1), (0.5, 1, 1, 0, 0, 0.5))
_SAMPLES = 360  # the number of points on each rim that are matched
_REACH = 60  # the maximum deviation of a match from the common shift of the rims, in samples
# Possible changes of the shift between consecutive matches, in samples; with -2 or less, matches would not stay in order.
_STEPS = (-1, 0, 1, 2, 3)
# The distance between matched points, divided by the rim's length, that costs as much as stretching the rim to twice its length.
_STIFFNESS = 0.01
_WINDOW = 9  # the number of samples in the moving mean that smooths the matches
_LEAST = 0.1  # the weight of the common shift in a match, which keeps matched points distinct


@dataclass(frozen=True, eq=False)
class CrossSection:
    """A connected cross-section without holes: ``triangles`` (m, 3) of ``points`` (n, 3) [mm], and its unit ``normal`` (3,)."""

    points: Floats
    triangles: Ints
    normal: Floats

    @property
    def moments(self) -> tuple[Floats, Floats]:
        """Return the centroid (3,) [mm], and the second moments of area (3, 3) [mm2] about it, divided by the area."""
        corners = self.points[self.triangles]
        areas = np.linalg.norm(normals(corners), axis=1) / 2
        centre = areas @ corners.mean(axis=1) / areas.sum()
        corners, sums = corners - centre, 3 * (corners.mean(axis=1) - centre)
        products = np.einsum("mki,mkj->mij", corners, corners) + sums[:, :, None] * sums[:, None, :]
        return centre, np.einsum("m,mij->ij", areas / 12, products) / areas.sum()

    @cached_property
    def rim(self) -> Ints:
        """Indices (k,) of the points on the boundary, counter-clockwise about the normal."""
        loop = np.asarray(igl.boundary_loop(self.triangles.astype(np.int64)))
        corners = self.points[loop] - self.points[loop].mean(axis=0)
        upward = np.cross(corners, np.roll(corners, -1, axis=0)).sum(axis=0) @ self.normal > 0
        return loop if upward else loop[::-1]

    def turns(self, first: Floats) -> Floats:
        """Positions (k,) of the rim points on the boundary of the unit square, from 0 to 1 around it, 0 at x = 1, y = 1/2.

        ``first`` (3,): the direction in the section that is mapped to the x axis of the square. Positions are fractions of the
        rim's length after a stretch that makes the width and height of the section equal, so that a rectangle is mapped linearly.
        """
        centre, product = self.moments
        axes = np.stack([first, np.cross(self.normal, first)])
        values, vectors = np.linalg.eigh(axes @ product @ axes.T)
        return _around((self.points[self.rim] - centre) @ axes.T @ (vectors / np.sqrt(values)) @ vectors.T)

    def square(self, turns: Floats) -> Floats:
        """Positions (n, 2) of all points in the unit square, by a harmonic map. ``turns`` (k,): the result of :meth:`turns`."""
        rim = np.stack([np.interp(turns, _SHARES, side) for side in _SQUARE], axis=1)
        return np.asarray(igl.harmonic(self.points, self.triangles.astype(np.int64), self.rim, rim, 1))


def _around(loop: Floats) -> Floats:
    """Positions (k,) of the points of a counter-clockwise ``loop`` (k, 2), as fractions of its length. Position 0 is
    the outermost point at which the loop crosses the positive first axis.
    """
    ahead = np.roll(loop, -1, axis=0)
    lengths = np.linalg.norm(ahead - loop, axis=1)
    rises = np.flatnonzero((loop[:, 1] < 0) & (ahead[:, 1] >= 0))
    shares = loop[rises, 1] / (loop[rises, 1] - ahead[rises, 1])
    farthest = np.argmax(loop[rises, 0] + shares * (ahead[rises, 0] - loop[rises, 0]))
    along = np.concatenate([[0.0], np.cumsum(lengths)])
    begin = along[rises[farthest]] + shares[farthest] * lengths[rises[farthest]]
    return np.asarray(((along[:-1] - begin) / along[-1]) % 1)


def cross_section(mesh: TetMesh, values: Floats, level: float) -> CrossSection | None:
    """Cut ``mesh`` where the field with ``values`` (n,) at its points equals ``level``, and return the largest connected piece of
    this section, with its normal towards larger values. Returns None if there is no section or if that piece has holes.
    """
    above = values - level
    above = np.where(np.abs(above) < _NUDGE, _NUDGE, above)
    ends, rise = _cut(mesh, above)
    if len(ends) == 0:
        return None
    edges, _, triangles, _ = distinct(np.sort(ends.reshape(-1, 2), axis=1))
    low, high = above[edges].T
    one, other = (mesh.points[ends] for ends in edges.T)
    points = one + (low / (low - high))[:, None] * (other - one)
    triangles = triangles.reshape(-1, 3)
    turned = np.einsum("ij,ij->i", normals(points[triangles]), rise) < 0
    triangles[turned] = triangles[turned][:, ::-1]
    return _greatest(points, triangles)


def _cut(mesh: TetMesh, above: Floats) -> tuple[Ints, Floats]:
    """Return the ends (k, 3, 2) of the edges of tets on which the corners of each triangle of a section lie, and a vector (k, 3)
    from each triangle towards larger values.
    """
    order = np.take_along_axis(mesh.tets, np.argsort(above[mesh.tets], axis=1, kind="stable"), axis=1)
    below = (above[order] < 0).sum(axis=1)
    patterns = {
        1: [((0, 1), (0, 2), (0, 3))],
        2: [((0, 2), (0, 3), (1, 3)), ((0, 2), (1, 3), (1, 2))],
        3: [((0, 3), (1, 3), (2, 3))],
    }
    found = [(order[below == count], np.array(corners)) for count, some in patterns.items() for corners in some]
    ends = np.concatenate([tets[:, corners] for tets, corners in found])
    up = np.concatenate([mesh.points[tets[:, 3]] - mesh.points[tets[:, 0]] for tets, _ in found])
    return ends, up


def _greatest(points: Floats, triangles: Ints) -> CrossSection | None:
    """Return the connected piece with the largest area, or None if that piece has holes."""
    _, pieces = igl.facet_components(triangles.astype(np.int64))
    areas = np.bincount(pieces, weights=np.linalg.norm(normals(points[triangles]), axis=1))
    triangles = triangles[pieces == np.argmax(areas)]
    used, triangles = np.unique(triangles, return_inverse=True)
    triangles = triangles.reshape(-1, 3)
    sides = distinct(np.sort(triangles[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)).rows
    if len(used) - len(sides) + len(triangles) != 1:
        return None
    upward = normals(points[used][triangles]).sum(axis=0)
    return CrossSection(points[used], triangles, upward / np.linalg.norm(upward))


def carried(known: CrossSection, turns: Floats, other: CrossSection) -> Floats:
    """Positions (m,) of the rim points of the ``other`` section on the boundary of the unit square, transferred from the positions
    ``turns`` (n,) of the rim points of the ``known`` section.

    Points on the other rim are matched, in order, with points on the known rim. The matching minimises the mean square of the
    distance, across the muscle, between matched points, plus a penalty on stretch.
    """
    normal = known.normal + other.normal
    normal /= max(float(np.linalg.norm(normal)), 1e-12)
    rims = [section.points[section.rim] for section in (known, other)]
    one, two = (rim - np.outer(rim @ normal, normal) for rim in rims)
    old, new = (_shares(rim) for rim in rims)
    begin = _continued(np.zeros(1), turns, old)
    start = _nearest(two, new, _at(begin, old, one)[0])
    at = np.arange(_SAMPLES) / _SAMPLES
    ahead = _matched(_at(begin + at, old, one), _at(start + at, new, two))
    relative = new - start
    place = begin + relative + np.interp(relative, at, ahead, period=1)
    return _continued(place, old, turns) % 1


def _shares(rim: Floats) -> Floats:
    """Positions (k,) of the points of a closed ``rim`` (k, 3), as fractions of its length from the first point."""
    lengths = np.linalg.norm(np.roll(rim, -1, axis=0) - rim, axis=1)
    return np.concatenate([[0.0], np.cumsum(lengths)[:-1]]) / lengths.sum()


def _at(places: Floats, shares: Floats, rim: Floats) -> Floats:
    """Points (n, 3) on a closed ``rim`` (k, 3) at the positions ``places`` (n,); ``shares`` (k,): the positions of its points."""
    return np.stack([np.interp(places, shares, axis, period=1) for axis in rim.T], axis=1)


def _continued(places: Floats, known: Floats, values: Floats) -> Floats:
    """Interpolate ``values`` (k,), given at the positions ``known`` (k,) around a rim, at ``places`` (n,). All have period 1."""
    return places + np.interp(places, known, np.unwrap(values - known, period=1), period=1)


def _nearest(rim: Floats, shares: Floats, point: Floats) -> float:
    """Position on a closed ``rim`` (k, 3) nearest to ``point`` (3,), as a fraction of the rim's length like ``shares`` (k,)."""
    ahead = np.roll(rim, -1, axis=0) - rim
    squares = np.maximum((ahead**2).sum(axis=1), np.finfo(float).tiny)
    along = np.clip(((point - rim) * ahead).sum(axis=1) / squares, 0, 1)
    i = int(np.argmin(np.linalg.norm(rim + along[:, None] * ahead - point, axis=1)))
    return float(shares[i] + along[i] * (np.append(shares, 1.0)[i + 1] - shares[i]))


def _matched(one: Floats, other: Floats) -> Floats:
    """Match each sample of the rim ``other`` (n, 3) with a point of the rim ``one`` (n, 3). Returns the lead (n,) of the match over
    the sample of ``one`` with the same index, as a fraction of the rim's length.
    """
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
    """Find the shifts (n,), from -60 to 60, with the smallest sum of the squared distances ``apart`` (n, 121) and of the cost of
    changes, ``stiffness`` times the square of each change. The first shift is 0.
    """
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
