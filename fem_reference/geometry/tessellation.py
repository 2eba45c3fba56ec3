"""Closed triangulated surfaces of bones of simple shapes, for pictures and for code that needs triangles.

The vertices lie on the surface of the shape. Spheres, capsules and boxes are all built from the octants of a sphere, moved apart.
"""

import numpy as np

from fem_reference.foundations.mesh import Floats, Ints, Surface, diagonal
from fem_reference.geometry.block import lattice_skin
from fem_reference.geometry.rigid_bodies import Box, Capsule, Cylinder, HalfSpace, Obstacle, Sphere, Vector

# The number of sides of a full circle, a multiple of eight. Triangles then lie at most 0.36 % of the radius inside the shape.
TURN = 64
# For a half-space: half the width of its slab, and the slab's thickness, relative to the diagonal of the points ``beside``.
_REACH, _THICKNESS = 1.5, 0.1


def tessellated(solid: Obstacle, beside: Floats, place: str, turn: int = TURN) -> Surface:
    """Triangulate a bone of a simple shape: a closed outward surface with ``turn`` sides per full circle; errors name ``place``.

    A half-space, which is infinite, is represented by a slab that extends beyond the points ``beside`` (n, 3) [mm]; only the slab's
    vertices in the plane lie on the surface of the half-space.
    """
    match solid:
        case HalfSpace():
            points, triangles = _slab(solid, beside)
        case Box():
            points, triangles = _rounded(solid.size, solid.rounding, turn)
            points = points + solid.centre
        case Sphere():
            points, triangles = _rounded((2 * solid.radius,) * 3, solid.radius, turn)
            points = points + solid.centre
        case Capsule():
            width, middle, frame = 2 * solid.radius, *_placed(solid.start, solid.end)
            length = float(np.linalg.norm(np.subtract(solid.end, solid.start)))
            points, triangles = _rounded((width, width, length + width), solid.radius, turn)
            points = points @ frame + middle
        case Cylinder():
            points, triangles = _prism(solid, turn)
        case _:
            raise TypeError(f"{type(solid).__name__} is not a body of a simple shape")
    return Surface(points, triangles, place)


def _slab(half_space: HalfSpace, beside: Floats) -> tuple[Floats, Ints]:
    """Slab behind a square in the plane of a half-space, centred below the points ``beside``."""
    middle = (beside.max(axis=0) + beside.min(axis=0)) / 2
    size = diagonal(beside)
    frame = _frame(np.asarray(half_space.normal, float))
    foot = middle - ((middle - half_space.point) @ frame[2]) * frame[2]
    lattice, triangles = lattice_skin((1, 1, 1))
    points = (lattice - [0.5, 0.5, 1]) * [2 * _REACH * size, 2 * _REACH * size, _THICKNESS * size]
    return points @ frame + foot, triangles


def _rounded(size: Vector, rounding: float, turn: int) -> tuple[Floats, Ints]:
    """Box about the origin with outer ``size`` and with edges and corners of the radius ``rounding``."""
    corners = [_ticks(length / 2 - rounding, rounding, turn // 8) for length in size]
    lattice, triangles = lattice_skin(tuple(len(tangents) - 1 for tangents, _ in corners))  # type: ignore[arg-type]
    direction = np.stack([tangents[lattice[:, axis]] for axis, (tangents, _) in enumerate(corners)], axis=1)
    middle = np.stack([centres[lattice[:, axis]] for axis, (_, centres) in enumerate(corners)], axis=1)
    return middle + rounding * direction / np.linalg.norm(direction, axis=1)[:, None], triangles


def _ticks(half: float, rounding: float, count: int) -> tuple[Floats, Floats]:
    """Return the tangents of the angles, and the centres, of the rounded corners at -``half`` and ``half`` along an axis. Each
    corner has ``count`` equal steps of angle from the centre of a face to the edge of a cube. Two corners with one centre share the
    tangent 0.
    """
    if rounding == 0:
        return np.array([-1.0, 1.0]), np.array([-half, half])
    steps = np.tan(np.linspace(0, np.pi / 4, count + 1))
    shared = 1 if half == 0 else 0
    tangents = np.concatenate([-steps[::-1], steps[shared:]])
    centres = np.concatenate([np.full(len(steps), -half), np.full(len(steps) - shared, half)])
    return tangents, centres


def _prism(cylinder: Cylinder, turn: int) -> tuple[Floats, Ints]:
    """Surface of a cylinder: both ends, as fans about their centres, and the lateral surface."""
    angles = 2 * np.pi * np.arange(turn) / turn
    length = float(np.linalg.norm(np.subtract(cylinder.end, cylinder.start)))
    ring = cylinder.radius * np.column_stack([np.cos(angles), np.sin(angles), np.zeros(turn)])
    up = np.array([0.0, 0.0, length / 2])
    low = np.arange(turn)
    after, bottom, top = np.roll(low, -1), np.full(turn, 2 * turn), np.full(turn, 2 * turn + 1)
    fans = [(bottom, after, low), (top, low + turn, after + turn)]
    side = [(low, after, after + turn), (low, after + turn, low + turn)]
    triangles = np.concatenate([np.column_stack(corners) for corners in (*fans, *side)])
    middle, frame = _placed(cylinder.start, cylinder.end)
    return np.concatenate([ring - up, ring + up, [-up, up]]) @ frame + middle, triangles


def _placed(start: Vector, end: Vector) -> tuple[Floats, Floats]:
    """Return the midpoint (3,) of a segment and a frame (3, 3) whose last axis is along it."""
    return np.add(start, end) / 2, _frame(np.subtract(end, start, dtype=float))


def _frame(direction: Floats) -> Floats:
    """Three right-handed unit vectors in rows (3, 3), the last of them along ``direction`` (3,)."""
    third = direction / np.linalg.norm(direction)
    first = np.cross(np.eye(3)[np.abs(third).argmin()], third)
    first /= np.linalg.norm(first)
    return np.stack([first, np.cross(third, first), third])
