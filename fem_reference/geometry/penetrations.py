"""Penetration of a closed body and a bone, where their surfaces cross or one is within the other."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import lru_cache

import igl
import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from fem_reference.foundations.mesh import Floats, Ints, Surface, triangle_areas
from fem_reference.foundations.motion import apply
from fem_reference.geometry.boxes import around, boxes_of, touching
from fem_reference.geometry.distance import inside
from fem_reference.geometry.intersections import crossings
from fem_reference.geometry.rigid_bodies import Obstacle

_NORMALS = igl.SignedDistanceType.SIGNED_DISTANCE_TYPE_PSEUDONORMAL
# So many winding numbers take as long as a tree for them.
_FEW = 20
# Sample points of a triangle that crosses another surface: those of a grid of quarters, its corners among them.
_GRID = np.array([(i, j, 4 - i - j) for i in range(5) for j in range(5 - i)]) / 4
_CORNERS = _GRID.argmax(axis=0)


@dataclass(frozen=True, eq=False)
class Depths:
    """Penetration depths (k,) [mm] of some vertices and triangles of a body and then of a bone, and their ``places`` (k, 3) [mm];
    ``at`` are their numbers (k,), rising. All others are outside. Only triangles that cross the other surface are sampled, where
    they are deepest.
    """

    at: Ints
    values: Floats
    places: Floats

    def deepest(self, rest: "Depths | None" = None) -> tuple[float, Floats]:
        """The greatest depth [mm] beyond that at ``rest``, and its place (3,) [mm]."""
        beyond = self.values.copy()
        if rest is not None:
            _, here, there = np.intersect1d(self.at, rest.at, assume_unique=True, return_indices=True)
            beyond[here] = np.maximum(beyond[here] - rest.values[there], 0.0)
        worst = int(np.argmax(beyond))
        return float(beyond[worst]), self.places[worst]


def depths(body: Surface, bone: Surface, shape: Obstacle, pose: Floats) -> Depths:
    """Penetration of a ``body`` and a ``bone`` at a ``pose`` (4, 4); ``shape`` gives the distance to the bone.

    Depth in the bone is as exact as its distance field, depth in the body exact.
    """
    local = body.moved_to(
        apply(np.linalg.inv(pose), body.points)
    )  # in the frame of the bone, whose boxes do not change
    pairs = crossings(local, bone)
    of_body, of_bone = (np.unique(side) for side in pairs.T)

    def into_bone(points: Floats) -> Floats:
        return np.maximum(-shape.sample(points).distance, 0.0)

    def into_body(points: Floats) -> Floats:
        return depths_within(local, points, of_body)

    tips, bone_tips = _tips(body.triangles.tobytes()), _bone_tips(bone)
    first = _of_surface(local, of_body, into_bone, tips, into_bone(local.points[tips]) > 0)
    second = _of_surface(bone, of_bone, into_body, bone_tips, _inside(local, bone.points[bone_tips]))
    count = len(local.points) + len(local.triangles)
    joined = Depths(*(np.concatenate(arrays) for arrays in zip(first, (second[0] + count, *second[1:]), strict=True)))
    return replace(joined, places=apply(pose, joined.places))


def depths_within(body: Surface, points: Floats, known: Ints) -> Floats:
    """Depths (n,) [mm] of ``points`` (n, 3) in a closed ``body``, 0 outside; fast where they are near triangles that are ``known``.

    The sign is that of the angle-weighted normal at the closest point (Baerentzen and Aanaes 2005, doi 10.1109/TVCG.2005.49).
    """
    found, some = np.zeros(len(points)), _in_box(body, points)
    corners = np.unique(body.triangles[known]) if len(known) else np.arange(len(body.points))
    reach = cKDTree(body.points[corners]).query(points[some])[0]
    near = touching(around(points[some], reach), boxes_of(body))[1]
    triangles = body.triangles[near][triangle_areas(body.points, body.triangles[near]) > 0]
    if len(triangles):
        vertices, numbers = np.unique(triangles, return_inverse=True)
        signed = igl.signed_distance(points[some], body.points[vertices], numbers.reshape(-1, 3), _NORMALS)[0]
        found[some] = np.maximum(-signed, 0.0)
    return found


def _inside(body: Surface, points: Floats) -> NDArray[np.bool_]:
    """Mask (n,) of the ``points`` (n, 3) that a closed ``body`` winds round; of few without a tree of its triangles."""
    found, some = np.zeros(len(points), bool), _in_box(body, points)
    if len(some) > _FEW:
        found[some] = inside(body, points[some])
    else:
        found[some] = [igl.winding_number(body.points, body.triangles, point) > 0.5 for point in points[some]]
    return found


def _in_box(body: Surface, points: Floats) -> Ints:
    """The ``points`` (k,) of n within the box around a ``body``."""
    low, high = boxes_of(body).hull
    return np.flatnonzero(((points >= low) & (points <= high)).all(axis=1))


def _of_surface(
    surface: Surface, crossing: Ints, depth: Callable[[Floats], Floats], tips: Ints, within: NDArray[np.bool_]
) -> tuple[Ints, Floats, Floats]:
    """Numbers of vertices and then of triangles of a surface, their ``depth`` and places: of triangles ``crossing`` another
    surface where they are deepest, and of vertices reached from their inside corners, or from the ``tips`` that are ``within``.
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
    """Extend the mask ``deep`` (n,) of vertices over the ``triangles`` that are not ``crossing``."""
    goes_on = np.ones(len(triangles), bool)
    goes_on[crossing] = False
    while deep.any():
        one, two, three = (deep[corner] for corner in triangles.T)
        grown = triangles[(one | two | three) & ~(one & two & three) & goes_on]
        if not len(grown):
            break
        deep[grown] = True


@lru_cache(maxsize=16)
def _bone_tips(bone: Surface) -> Ints:
    return _tips(bone.triangles.tobytes())


@lru_cache(maxsize=8)
def _tips(triangles: bytes) -> Ints:
    """A vertex of each part of a surface of ``triangles``, 64 bit integers; the side of a part without a crossing is its side."""
    parts = np.asarray(igl.vertex_components(np.frombuffer(triangles, np.int64).reshape(-1, 3)))
    return np.unique(parts, return_index=True)[1]
