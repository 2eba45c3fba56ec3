"""Penetration of a closed body and a bone, where their surfaces cross or one is within the other."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache

import igl
import numpy as np

from fem_reference.foundations.mesh import Floats, Ints, Surface
from fem_reference.foundations.motion import apply
from fem_reference.geometry.distance import distances, inside
from fem_reference.geometry.intersections import crossings
from fem_reference.geometry.rigid_bodies import Obstacle

# Sample points of a triangle that crosses another surface: those of a grid of quarters, its corners among them.
_GRID = np.array([(i, j, 4 - i - j) for i in range(5) for j in range(5 - i)]) / 4


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
