"""Penetration of a closed body and a bone: the depth, and the volume of the overlap by random sampling."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import NamedTuple

import igl
import numpy as np
from numpy.typing import NDArray

from fem_reference.foundations.mesh import Floats, Ints, Surface, connected_parts, triangle_areas
from fem_reference.foundations.motion import apply
from fem_reference.geometry.boxes import bounds
from fem_reference.geometry.distance import distances, inside
from fem_reference.geometry.intersections import crossings
from fem_reference.geometry.near_pairs import parts_of, reached
from fem_reference.geometry.rigid_bodies import Obstacle
from fem_reference.geometry.skins import edge_lengths, quartered

_NORMALS = igl.SignedDistanceType.SIGNED_DISTANCE_TYPE_PSEUDONORMAL
_RINGS = 4  # rings of triangles that are searched one by one; then the rest is searched at once, by connected parts
# For up to this many points, computing winding numbers takes less time than building a search tree.
_FEW = 20
# A factor on distances that covers their rounding errors.
_MORE = 1 + 1e-9
# Sample points of a triangle that crosses another surface, in barycentric coordinates: a grid that divides each edge into quarters.
_GRID = np.array([(i, j, 4 - i - j) for i in range(5) for j in range(5 - i)]) / 4
_CORNERS = _GRID.argmax(axis=0)
# The maximum edge of the first cubes [mm], and the minimum number of first cubes along the longest extent of the surface.
_FIRST_EDGE, _FIRST_CUBES = 10.0, 20
# The volume is not computed if the box around the surface is larger than this many cubes of edge ``_FIRST_EDGE`` (a cubic metre).
_TOO_MANY = 1e6
# The maximum number of subdivisions; the maximum number of cubes after each of them, and of points drawn in the last cubes.
_ROUNDS, _MOST = 3, 8000
# The maximum number of times that a triangle is cut into four for sampling; the edges are then an eighth as long.
_PARTINGS = 3

Distance = Callable[[Floats], Floats]


@dataclass(frozen=True, eq=False)
class Depths:
    """Penetration depths of the vertices and triangles of a body and then of a bone. ``at`` (k,): their indices, in ascending
    order; ``values`` (k,) [mm]: the depths; ``places`` (k, 3) [mm]: the points with these depths. Only triangles that cross the
    other surface are sampled, and the deepest sample of each counts. All vertices and triangles that are not listed are outside.
    """

    at: Ints
    values: Floats
    places: Floats

    def deepest(self, rest: "Depths | None" = None) -> tuple[float, Floats]:
        """Return the maximum depth [mm] in excess of the depth at ``rest``, and the point (3,) [mm] at which it occurs."""
        beyond = self.values.copy()
        if rest is not None:
            _, here, there = np.intersect1d(self.at, rest.at, assume_unique=True, return_indices=True)
            beyond[here] = np.maximum(beyond[here] - rest.values[there], 0.0)
        worst = int(np.argmax(beyond))
        return float(beyond[worst]), self.places[worst]


def depths(body: Surface, bone: Surface, shape: Obstacle, pose: Floats) -> Depths:
    """Compute the penetration of a ``body`` and a ``bone`` at a ``pose`` (4, 4); ``shape`` gives the distance to the bone.

    The depth in the bone is as accurate as its distance field; the depth in the body is exact.
    """
    # In the bone's coordinates the bounding boxes of the bone stay the same; if the bone is at rest, those of the body do too.
    still = np.array_equal(pose, np.eye(4))
    local = body if still else body.moved_to(apply(np.linalg.inv(pose), body.points))
    pairs = crossings(local, bone)
    of_body, of_bone = (np.unique(side) for side in pairs.T)

    def into_bone(points: Floats) -> Floats:
        return np.maximum(-shape.distances(points), 0.0) if len(points) else np.zeros(0)

    def into_body(points: Floats) -> Floats:  # in the body's coordinates: its search tree serves all bones
        return depths_within(body, apply(pose, points), of_body)

    tips, bone_tips = (_tips(surface, crossing) for surface, crossing in ((body, of_body), (bone, of_bone)))
    first = _of_surface(local, of_body, into_bone, tips, into_bone(local.points[tips]) > 0)
    second = _of_surface(bone, of_bone, into_body, bone_tips, _inside(body, apply(pose, bone.points[bone_tips])))
    count = len(local.points) + len(local.triangles)
    joined = Depths(*(np.concatenate(arrays) for arrays in zip(first, (second[0] + count, *second[1:]), strict=True)))
    return replace(joined, places=apply(pose, joined.places))


def depths_within(body: Surface, points: Floats, known: Ints) -> Floats:
    """Depth (n,) [mm] of ``points`` (n, 3) in a closed ``body``, 0 outside; fast for points near the triangles ``known``.

    The sign is that of the angle-weighted normal at the closest point (Baerentzen and Aanaes 2005, doi 10.1109/TVCG.2005.49).
    """
    found, some = np.zeros(len(points)), _in_box(body, points)
    if not len(some):
        return found
    triangles = body.triangles[known] if len(known) else body.triangles
    squares = igl.point_mesh_squared_distance(points[some], body.points, triangles)[0]
    near = reached(body, points[some], _MORE * np.sqrt(squares))
    triangles = body.triangles[near][triangle_areas(body.points, body.triangles[near]) > 0]
    if len(triangles):
        vertices, numbers = np.unique(triangles, return_inverse=True)
        signed = igl.signed_distance(points[some], body.points[vertices], numbers.reshape(-1, 3), _NORMALS)[0]
        found[some] = np.maximum(-signed, 0.0)
    return found


def _inside(body: Surface, points: Floats) -> NDArray[np.bool_]:
    """Mask (n,) of the ``points`` (n, 3) inside a closed ``body``, by winding numbers; for few points no search tree is built."""
    found, some = np.zeros(len(points), bool), _in_box(body, points)
    if len(some) > _FEW:
        found[some] = inside(body, points[some])
    else:
        found[some] = [igl.winding_number(body.points, body.triangles, point) > 0.5 for point in points[some]]
    return found


def _in_box(body: Surface, points: Floats) -> Ints:
    """Indices (k,) of the ``points`` (n, 3) within the bounding box of a ``body``."""
    low, high = bounds(body) if len(points) else (points, points)
    return np.flatnonzero(((points >= low) & (points <= high)).all(axis=1))


def _of_surface(
    surface: Surface, crossing: Ints, depth: Callable[[Floats], Floats], tips: Ints, within: NDArray[np.bool_]
) -> tuple[Ints, Floats, Floats]:
    """Return the indices of vertices and then of triangles of a surface, their depths, and the points with these depths.

    The triangles are those ``crossing`` another surface, each with its deepest sample. The vertices are the ``tips``, which belong
    to parts without such triangles, and all vertices connected to a corner inside the other surface or to one of the tips
    ``within`` it. ``depth`` is a function of points.
    """
    points, corners = surface.points, surface.triangles[crossing]
    grid = np.einsum("gc,tci->tgi", _GRID, points[corners])
    inner = depth(grid.reshape(-1, 3)).reshape(grid.shape[:2])
    values = np.zeros(len(points))
    values[corners] = inner[:, _CORNERS]
    deep = values > 0
    deep[tips] |= within
    _flood(deep, surface.triangles, crossing)
    unknown = np.flatnonzero(deep & (values == 0))
    values[unknown] = depth(points[unknown])
    vertices = np.union1d(np.flatnonzero(deep), tips)
    places = grid[np.arange(len(crossing)), inner.argmax(axis=1)]
    return (
        np.concatenate([vertices, len(points) + crossing]),
        np.concatenate([values[vertices], inner.max(axis=1)]),
        np.concatenate([points[vertices], places]),
    )


def _flood(deep: NDArray[np.bool_], triangles: Ints, crossing: Ints) -> None:
    """Extend the mask ``deep`` (n,) of vertices to all vertices connected with them by ``triangles`` that are not ``crossing``."""
    if not deep.any():
        return
    goes_on = np.ones(len(triangles), bool)
    goes_on[crossing] = False
    for _ in range(_RINGS):
        one, two, three = (deep[corner] for corner in triangles.T)
        grown = triangles[(one | two | three) & ~(one & two & three) & goes_on]
        if not len(grown):
            return
        deep[grown] = True
    part = connected_parts(triangles[goes_on][:, :2].ravel(), triangles[goes_on][:, 1:].ravel(), len(deep))
    deep |= np.isin(part, part[deep])


def _tips(surface: Surface, crossing: Ints) -> Ints:
    """First vertex of each connected part that has no triangles ``crossing`` another surface and so lies on one side of it."""
    firsts, own = parts_of(surface)
    crossed = np.zeros(len(own), bool)
    crossed[own[surface.triangles[crossing, 0]]] = True
    return firsts[~crossed[firsts]]


class Shared(NamedTuple):
    """The ``volume`` [mm3] within a rigid body, and the depth [mm] of the ``deepest`` sample in it, 0 if there is none."""

    volume: float
    deepest: float


def shared(surface: Surface, counts: NDArray[np.bool_], gaps: Floats, distance: Distance, body: Floats) -> Shared:
    """Estimate the part of the inside of a closed ``surface`` with m triangles that lies in a rigid body.

    Space is cut into cubes, and cubes that may contain a part of the overlap are cut into smaller ones. In these, 4000 to 8000
    random points are drawn, the same every time. The estimate is unbiased; its standard deviation is at most half the volume that a
    point represents, times the square root of the number of points in cubes on the border of the overlap.

    A point counts if its nearest triangle is in the mask ``counts`` (m,). ``distance`` returns the distance (n,) [mm] of points
    (n, 3) to the rigid body, negative inside; ``gaps`` are the distances of the surface's points. ``body`` (k, 3) [mm]: points on
    all sides of the rigid body; if all of them are inside the surface, the entire body counts. (They are tested only if their mean
    is in the bounding box of the surface.) The volume is 0 if no counted triangle enters the body and no such point is inside the
    surface. It is NaN if the bounding box is larger than a cubic metre.
    """
    extent = np.ptp(surface.points, axis=0)
    within = _within(surface, body)
    if extent.max() == 0 or not (within.any() or _touches(surface, counts, gaps, distance)):
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
    """Mask (k,) of the points ``body`` (k, 3) inside the surface; all False if their mean is outside the surface's bounding box."""
    middle, low, high = body.sum(axis=0) / max(1, len(body)), surface.points.min(axis=0), surface.points.max(axis=0)
    boxed = len(body) > 0 and bool(((middle > low) & (middle < high)).all())
    return _inside(surface, body) if boxed else np.zeros(len(body), bool)


def _touches(surface: Surface, counts: NDArray[np.bool_], gaps: Floats, distance: Distance) -> bool:
    """True if a counted triangle enters the body, tested at vertices and, near the body, at the corners of pieces of triangles."""
    triangles = surface.triangles[counts]
    corners, away = surface.points[triangles], gaps[triangles]
    for _ in range(_PARTINGS):
        if (away < 0).any():
            return True
        corners = quartered(corners[away.min(axis=1) < edge_lengths(corners).max(axis=1)])
        away = distance(corners.reshape(-1, 3)).reshape(-1, 3)
    return bool((away < 0).any())


class _Sides:
    """The counted and the other triangles of a surface, for distance queries."""

    def __init__(self, surface: Surface, counts: NDArray[np.bool_]) -> None:
        self.surface = surface
        self.parts = [Surface(surface.points, surface.triangles[some]) for some in (counts, ~counts)]

    def may_count(self, centres: Floats, reach: float) -> NDArray[np.bool_]:
        """Mask (n,) of the spheres of radius ``reach`` about ``centres`` (n, 3) that may contain counted points."""
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
        """Distances (n,) [mm] of ``points`` (n, 3) to the counted triangles and to the others; infinite if there are none."""
        return [
            distances(points, part).distance if len(part.triangles) else np.full(len(points), np.inf)
            for part in self.parts
        ]


def _first_cubes(points: Floats) -> tuple[Floats, float]:
    """Return the centres (n, 3) of cubes that fill the bounding box of ``points``, and their edge [mm]."""
    low, extent = points.min(axis=0), np.ptp(points, axis=0)
    edge = min(_FIRST_EDGE, float(extent.max()) / _FIRST_CUBES)
    numbers = tuple(int(count) for count in np.maximum(1, np.ceil(extent / edge)))
    return low + edge * (np.moveaxis(np.indices(numbers), 0, -1).reshape(-1, 3) + 0.5), edge


def _cut(centres: Floats, edge: float, parts: int) -> tuple[Floats, float]:
    """Cut each cube into ``parts`` along each axis; returns the centres (n, 3) and the edge [mm]."""
    steps = (np.moveaxis(np.indices((parts,) * 3), 0, -1).reshape(-1, 3) + 0.5) / parts - 0.5
    return (centres[:, None] + edge * steps).reshape(-1, 3), edge / parts


def _reach(edge: float) -> float:
    """Distance [mm] from the centre of a cube to its corners."""
    return float(np.sqrt(3) / 2 * edge)
