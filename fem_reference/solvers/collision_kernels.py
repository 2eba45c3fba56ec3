"""Contact of vertices with bones, as constraints ``C = distance - allowed >= 0``. Report section 6.1.1.

The distance to a bone is computed only for vertices that may be near the bone: a vertex that has moved relative to the bone by less
than its distance at the last check is still outside. Only vertices are checked, and only at their new positions. Therefore a sharp
edge of a bone may pass between vertices, and a vertex that crosses a thin bone in one step ends on the other side. The distance to
a bone made of triangles is stored on a grid that at rest is aligned with the coordinate axes, so results depend on these axes: if
the entire scene of hip_flexion is rotated, positions of vertices with ``pbd`` differ by up to 1.2 mm (mean 0.1 mm).
"""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from fem_reference.foundations.mesh import Floats, Ints
from fem_reference.geometry.signed_distance import FAR, Grid
from fem_reference.problems.setup import Bone
from fem_reference.solvers.compiled_kernels import compiled
from fem_reference.solvers.pbd_kernels import Vector

# A safety factor on distances, as the length of the gradient of an interpolated distance differs from 1 by a few percent.
_SURE = 0.9

Four = tuple[float, float, float, float]


class Contacts(NamedTuple):
    """The checked ``vertices`` (k,), the ``value`` of each constraint (k,) [mm], and unit vectors ``away`` (k, 3) from the bone."""

    vertices: Ints
    value: Floats
    away: Floats


@compiled
def _splines(t: float) -> tuple[Four, Four]:
    """The values and the derivatives of the four cubic B-splines that are not zero in a cell, at ``t`` from 0 to 1 in the cell."""
    s = 1 - t
    values = (s * s * s / 6, (4 - 6 * t * t + 3 * t * t * t) / 6, (4 - 6 * s * s + 3 * s * s * s) / 6, t * t * t / 6)
    slopes = (-s * s / 2, (3 * t * t - 4 * t) / 2, (4 * s - 3 * s * s) / 2, t * t / 2)
    return values, slopes


@compiled
def _cell(place: float, count: int) -> tuple[int, float]:
    """The index of the cell that contains the position ``place`` [cells], and the position in this cell, from 0 to 1.

    ``count``: the number of nodes along the axis.
    """
    cell = min(int(place), count - 3)
    return cell, place - cell


@compiled
def _spline(coefficients: Floats, x: float, y: float, z: float) -> tuple[float, Vector]:
    """The value of a spline and its gradient [1/cells] at the position ``x``, ``y``, ``z`` [cells] from the grid's origin."""
    i, within_x = _cell(x, coefficients.shape[0])
    j, within_y = _cell(y, coefficients.shape[1])
    k, within_z = _cell(z, coefficients.shape[2])
    of_x, along_x = _splines(within_x)
    of_y, along_y = _splines(within_y)
    of_z, along_z = _splines(within_z)
    value, slope_x, slope_y, slope_z = 0.0, 0.0, 0.0, 0.0
    for a in range(4):
        for b in range(4):
            line, along_line = 0.0, 0.0
            for c in range(4):
                coefficient = coefficients[i + a - 1, j + b - 1, k + c - 1]
                line += of_z[c] * coefficient
                along_line += along_z[c] * coefficient
            value += of_x[a] * of_y[b] * line
            slope_x += along_x[a] * of_y[b] * line
            slope_y += of_x[a] * along_y[b] * line
            slope_z += of_x[a] * of_y[b] * along_line
    return value, (slope_x, slope_y, slope_z)


@compiled
def sample(coefficients: Floats, origin: Floats, spacing: float, points: Floats) -> tuple[Floats, Floats]:
    """The distance (n,) [mm] and its gradient (n, 3) at ``points`` (n, 3) [mm], by interpolation on a ``Grid``."""
    distance, gradient = np.full(len(points), FAR), np.zeros_like(points)
    last_x, last_y, last_z = coefficients.shape[0] - 2, coefficients.shape[1] - 2, coefficients.shape[2] - 2
    for n in range(len(points)):
        x = (points[n, 0] - origin[0]) / spacing
        y = (points[n, 1] - origin[1]) / spacing
        z = (points[n, 2] - origin[2]) / spacing
        if not math.isfinite(x + y + z):
            distance[n] = math.nan
        elif 1 <= x <= last_x and 1 <= y <= last_y and 1 <= z <= last_z:
            distance[n], slope = _spline(coefficients, x, y, z)
            for axis in range(3):
                gradient[n, axis] = slope[axis] / spacing
    return distance, gradient


@compiled
def approached(points: Floats, pose: Floats, asked_at: Floats, clear: Floats) -> tuple[Ints, Floats]:
    """The indices (k,) and positions (k, 3) [mm] of the points that have moved ``clear`` (n,) [mm] or more since their last check.

    ``points`` (n, 3) [mm]: the present positions. ``pose`` (4, 4): the present pose of the bone. ``asked_at`` (n, 3) [mm]: the
    positions at the last check. The returned positions and ``asked_at`` are in the frame of the bone at rest.
    """
    found, places = np.empty(len(points), np.int64), np.empty_like(points)
    count = 0
    for n in range(len(points)):
        gone = 0.0
        for axis in range(3):
            place = 0.0
            for other in range(3):
                place += pose[other, axis] * (points[n, other] - pose[other, 3])
            places[count, axis] = place
            gone += (place - asked_at[n, axis]) ** 2
        if gone >= clear[n] * clear[n]:
            found[count] = n
            count += 1
    return found[:count].copy(), places[:count].copy()


class CollidingBone:
    """A bone with which vertices collide.

    ``allowed`` (n,) [mm]: the minimum distance of each vertex. This is ``gap`` [mm], or the distance at rest if that is smaller, so
    that no vertex jumps in the first step. ``clear`` (n,) [mm]: the displacement after which a vertex is checked again. Vertices
    that are not ``free`` (n,) are never checked.
    """

    def __init__(self, bone: Bone, rest: Floats, free: NDArray[np.bool_], gap: float) -> None:
        self.bone, shape = bone, bone.shape
        self.grid = shape if isinstance(shape, Grid) else None
        self.coefficients = np.array(shape.coefficients) if isinstance(shape, Grid) else np.zeros((0, 0, 0))
        self.known_to = math.inf if self.grid is None else self.grid.margin  # a grid is coarse at larger distances
        self.asked_at, self.clear = np.array(rest), np.where(free, 0.0, np.inf)
        distance, _ = self._sample(self.asked_at)
        self.allowed = np.minimum(distance, gap)
        self.pose = np.eye(4)

    def move(self, frame: float) -> None:
        """Move the bone to its pose at ``frame``."""
        self.pose = np.array(self.bone.pose(frame), np.float64)

    def near(self, points: Floats) -> Contacts:
        """The constraints that vertices at ``points`` (n, 3) [mm] may violate."""
        vertices, places = approached(points, self.pose, self.asked_at, self.clear)
        distance, gradient = self._sample(places)
        allowed = self.allowed[vertices]
        self.asked_at[vertices] = places
        self.clear[vertices] = _SURE * np.maximum(np.minimum(distance, self.known_to) - allowed, 0)
        length = np.linalg.norm(gradient, axis=1, keepdims=True)
        away = np.divide(gradient, length, out=np.zeros_like(gradient), where=length > 0)
        return Contacts(vertices, distance - allowed, away @ self.pose[:3, :3].T)

    def watch(self, vertices: Ints) -> None:
        """Include ``vertices`` (k,) in the next check, whatever their distance."""
        self.clear[vertices] = 0

    def _sample(self, places: Floats) -> tuple[Floats, Floats]:
        if self.grid is not None:
            return sample(self.coefficients, np.array(self.grid.origin), self.grid.spacing, places)
        found = self.bone.shape.sample(places)
        return found.distance, found.gradient


def colliding_bones(bones: Sequence[Bone], rest: Floats, attached: Ints, gap: float) -> list[CollidingBone]:
    """The ``bones``, with which all points at ``rest`` (n, 3) [mm] collide except the ``attached`` points (k,)."""
    free = np.ones(len(rest), bool)
    free[attached] = False
    return [CollidingBone(bone, rest, free, gap) for bone in bones]


def move_out(points: Floats, bones: Sequence[CollidingBone], stiffness: float) -> None:
    """Move ``points`` (n, 3) [mm] out of all bones, in place.

    A point that several bones contain moves by the sum of the displacements out of each. ``stiffness``: the fraction of each
    displacement that is applied. Masses cancel, because each constraint has a single vertex.
    """
    moves = np.zeros_like(points)
    for one in bones:
        near = one.near(points)
        inside = near.value < 0
        moves[near.vertices[inside]] -= stiffness * near.value[inside, None] * near.away[inside]
    points += moves
