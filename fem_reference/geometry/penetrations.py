"""Penetration of a closed body and a bone: the depth where their surfaces cross or one is within the other, and the volume of
the body within the bone, by random sampling.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache
from typing import NamedTuple

import igl
import numpy as np
from numpy.typing import NDArray

from fem_reference.foundations.mesh import Floats, Ints, Surface
from fem_reference.foundations.motion import apply
from fem_reference.geometry.distance import distances, inside
from fem_reference.geometry.intersections import crossings
from fem_reference.geometry.rigid_bodies import Obstacle
from fem_reference.geometry.skins import edge_lengths, quartered

# Sample points of a triangle that crosses another surface: those of a grid of quarters, its corners among them.
_GRID = np.array([(i, j, 4 - i - j) for i in range(5) for j in range(5 - i)]) / 4
# The first cubes are at most this long [mm], and at most the longest extent of the surface over this number.
_FIRST_EDGE, _FIRST_CUBES = 10.0, 20
# In a box of more first cubes, a cubic metre or more, the volume is not computed.
_TOO_MANY = 1e6
# The number of rounds of subdivision, the most cubes after each, and the most points drawn in them.
_ROUNDS, _MOST = 3, 8000
# A triangle is sampled in parts of down to an eighth of its size.
_PARTINGS = 3

Distance = Callable[[Floats], Floats]


@dataclass(frozen=True, eq=False)
class Depths:
    """Penetration depths [mm] of the vertices and triangles of a body and then those of a bone, 0 outside, and their ``places``
    [mm]; only triangles that cross the other surface are sampled, where they are deepest.
    """

    values: Floats
    places: Floats

    def deepest(self, rest: "Depths | None" = None) -> tuple[float, Floats]:
        """The greatest depth [mm] beyond that at ``rest``, and its place (3,) [mm]."""
        beyond = self.values if rest is None else np.maximum(self.values - rest.values, 0.0)
        worst = int(np.argmax(beyond))
        return float(beyond[worst]), self.places[worst]


def depths(body: Surface, bone: Surface, shape: Obstacle, pose: Floats) -> Depths:
    """Penetration of a ``body`` and a ``bone`` at a ``pose`` (4, 4); ``shape`` gives the distance to the bone.

    Depth in the bone is as exact as its distance field, depth in the body exact.
    """
    posed, back = bone.moved_to(apply(pose, bone.points)), np.linalg.inv(pose)
    pairs = crossings(body, posed)

    def into_bone(points: Floats) -> Floats:
        return np.maximum(-shape.sample(apply(back, points)).distance, 0.0)

    parts = [
        *_of_surface(body, np.unique(pairs[:, 0]), into_bone),
        *_of_surface(posed, np.unique(pairs[:, 1]), lambda points: depths_within(body, points)),
    ]
    values, places = (np.concatenate(arrays) for arrays in zip(*parts, strict=True))
    return Depths(values, places)


def depths_within(body: Surface, points: Floats) -> Floats:
    """Depths (n,) [mm] of ``points`` (n, 3) in a closed ``body``, 0 outside."""
    found = np.zeros(len(points))
    low, high = body.points.min(axis=0), body.points.max(axis=0)
    some = np.flatnonzero(((points >= low) & (points <= high)).all(axis=1))
    within = some[inside(body, points[some])]
    found[within] = distances(points[within], body).distance
    return found


def _of_surface(surface: Surface, crossing: Ints, depth: Callable[[Floats], Floats]) -> list[tuple[Floats, Floats]]:
    """The ``depth`` of the vertices and triangles of a surface, and their places: of triangles ``crossing`` another surface where
    they are deepest, and of vertices reached from their inside corners, or from one in each of its parts.
    """
    triangles, points = surface.triangles, surface.points
    within = np.zeros(len(points), bool)
    corners = np.union1d(triangles[crossing], _tips(triangles.tobytes()))
    within[corners] = depth(points[corners]) > 0
    goes_on = np.delete(triangles, crossing, axis=0)
    while (grown := within[goes_on].any(axis=1) & ~within[goes_on].all(axis=1)).any():
        within[goes_on[grown]] = True
    vertices, deepest, places = np.zeros(len(points)), np.zeros(len(triangles)), points[triangles[:, 0]]
    vertices[within] = depth(points[within])
    grid = np.einsum("gc,tci->tgi", _GRID, points[triangles[crossing]])
    found = depth(grid.reshape(-1, 3)).reshape(len(crossing), len(_GRID))
    deepest[crossing] = found.max(axis=1)
    places[crossing] = grid[np.arange(len(crossing)), found.argmax(axis=1)]
    return [(vertices, points), (deepest, places)]


@lru_cache(maxsize=8)
def _tips(triangles: bytes) -> Ints:
    """A vertex of each part of a surface of ``triangles``, 64 bit integers; the side of a part without a crossing is its side."""
    parts = np.asarray(igl.vertex_components(np.frombuffer(triangles, np.int64).reshape(-1, 3)))
    return np.unique(parts, return_index=True)[1]


class Shared(NamedTuple):
    """The ``volume`` [mm3] within the rigid body, and the depth [mm] of the ``deepest`` sample there, 0 without."""

    volume: float
    deepest: float


def shared(surface: Surface, counts: NDArray[np.bool_], distance: Distance, body: Floats) -> Shared:
    """The part of the inside of a closed ``surface`` of m triangles that is in a rigid body.

    Space is cut into cubes, those that may contain a part of it into smaller ones, and 4000 to 8000 random points are drawn in
    these, the same every time. On average the count is exact. Its standard deviation is at most half the volume of one point,
    times the square root of the number of points in cubes on the border of the overlap.

    A point counts where its nearest triangle is in the mask ``counts`` (m,). The rigid body is given by the ``distance`` (n,)
    [mm] of points (n, 3) to it, negative inside, and by points ``body`` (k, 3) [mm] on all its sides: where all are inside the
    surface, the whole body counts. The volume is 0 where no counted triangle enters the body, and the body does not reach into
    the surface up to its middle. It is NaN where the surface has blown up beyond a cubic metre.
    """
    extent = np.ptp(surface.points, axis=0)
    within = _within(surface, body)
    if extent.max() == 0 or not (within.any() or _touches(surface, counts, distance)):
        return Shared(0.0, 0.0)
    if np.prod(extent / _FIRST_EDGE) > _TOO_MANY:
        return Shared(np.nan, 0.0)
    sides = _Sides(surface, counts | (len(body) > 0 and within.all()))
    centres, edge = _first_cubes(surface.points)
    for _ in range(_ROUNDS):
        centres = centres[distance(centres) < _reach(edge)]
        centres = centres[sides.may_count(centres, _reach(edge))]
        parts = int(np.cbrt(_MOST / max(1, len(centres))))
        if len(centres) == 0 or parts < 2:
            break
        centres, edge = _cut(centres, edge, parts)
    each = max(1, _MOST // max(1, len(centres)))
    points = np.repeat(centres, each, axis=0)
    points += edge * np.random.default_rng(0).uniform(-0.5, 0.5, points.shape)
    points = points[distance(points) < 0]
    points = points[sides.count(points)]
    return Shared(float(edge**3 / each * len(points)), float(-distance(points).min(initial=0.0)))


def _within(surface: Surface, body: Floats) -> NDArray[np.bool_]:
    """Mask of the points (k, 3) of a body that are inside; none where their middle is not in the surface's box."""
    middle, low, high = body.sum(axis=0) / max(1, len(body)), surface.points.min(axis=0), surface.points.max(axis=0)
    boxed = len(body) > 0 and bool(((middle > low) & (middle < high)).all())
    return inside(surface, body) if boxed else np.zeros(len(body), bool)


def _touches(surface: Surface, counts: NDArray[np.bool_], distance: Distance) -> bool:
    """True where a counted triangle enters the body; tested at its vertices, and near the body at ever smaller parts."""
    triangles = surface.triangles[counts]
    corners, away = surface.points[triangles], distance(surface.points)[triangles]
    for _ in range(_PARTINGS):
        if (away < 0).any():
            return True
        longest = edge_lengths(corners).max(axis=1)
        corners = quartered(corners[away.min(axis=1) < longest])
        away = distance(corners.reshape(-1, 3)).reshape(-1, 3)
    return bool((away < 0).any())


class _Sides:
    """The counted and the other triangles of a surface, for distance queries."""

    def __init__(self, surface: Surface, counts: NDArray[np.bool_]) -> None:
        self.surface = surface
        self.parts = [Surface(surface.points, surface.triangles[some]) for some in (counts, ~counts)]

    def may_count(self, centres: Floats, reach: float) -> NDArray[np.bool_]:
        """Mask (n,) of the balls of radius ``reach`` about ``centres`` (n, 3) that may contain counted points."""
        counting, other = self._distances(centres)
        found = counting - other <= 2 * reach
        deep = found & (np.minimum(counting, other) > reach)
        found[deep] = inside(self.surface, centres[deep])
        return np.asarray(found)

    def count(self, points: Floats) -> NDArray[np.bool_]:
        """Mask (n,) of the ``points`` (n, 3) that are inside and nearest to a counted triangle."""
        found = inside(self.surface, points)
        counting, other = self._distances(points[found])
        found[found] = counting <= other
        return found

    def _distances(self, points: Floats) -> list[Floats]:
        """Distance (n,) [mm] of ``points`` (n, 3) to the counted triangles, and to the others; infinite where there are none."""
        return [
            distances(points, part).distance if len(part.triangles) else np.full(len(points), np.inf)
            for part in self.parts
        ]


def _first_cubes(points: Floats) -> tuple[Floats, float]:
    """Centres (n, 3) of cubes that fill the box around ``points``, and their edge [mm]."""
    low, extent = points.min(axis=0), np.ptp(points, axis=0)
    edge = min(_FIRST_EDGE, float(extent.max()) / _FIRST_CUBES)
    numbers = tuple(int(count) for count in np.maximum(1, np.ceil(extent / edge)))
    return low + edge * (np.moveaxis(np.indices(numbers), 0, -1).reshape(-1, 3) + 0.5), edge


def _cut(centres: Floats, edge: float, parts: int) -> tuple[Floats, float]:
    """Every cube cut into ``parts`` along each axis: centres (n, 3) and edge [mm]."""
    steps = (np.moveaxis(np.indices((parts,) * 3), 0, -1).reshape(-1, 3) + 0.5) / parts - 0.5
    return (centres[:, None] + edge * steps).reshape(-1, 3), edge / parts


def _reach(edge: float) -> float:
    """The distance [mm] from the centre of a cube to its corners."""
    return float(np.sqrt(3) / 2 * edge)
