"""Shortest paths between two points around a sphere or a cylinder: a straight piece, a geodesic and a straight piece.

On the surface a path is a geodesic: a great circle of the sphere or a helix of the cylinder. Seen along the axis of rotation, each
is an arc of a circle between two tangents, so one closed form holds for both (the "obstacles" of Garner and Pandy 2000, Comput.
Methods Biomech. Biomed. Eng. 3(1), DOI 10.1080/10255840008915251; report DCSE/TR-2022-03, 5.3).
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from fem_reference.foundations.mesh import Floats, Ints
from fem_reference.geometry.obstacles import Quadric, Touch


@dataclass(frozen=True, eq=False)
class Paths:
    """n paths. ``parts`` (n, 3) [mm]: the lengths before, on and after the surface; the last two are 0 for a straight path.

    ``starts``, ``ends``: the end points; ``touches``: the points where each path arrives at the surface and leaves it, all
    (n, 3) [mm]. On the surface a path rotates by ``turns`` (n,) [rad] about the unit ``axes`` (n, 3) through ``middles`` (n, 3),
    and advances uniformly along these axes.
    """

    parts: Floats
    starts: Floats
    ends: Floats
    touches: tuple[Floats, Floats]
    middles: Floats
    axes: Floats
    turns: Floats

    @property
    def failed(self) -> NDArray[np.bool_]:
        """All False (n,): the closed form always gives a path."""
        return np.zeros(len(self.parts), dtype=bool)

    def touching(self) -> list[Touch]:
        """Return a contact for each path, from its start to its end, with the same resultant force as contact on the surface."""
        first, last = self.directions()
        return [Touch(np.zeros(len(self.parts), dtype=np.int64), self.starts, first, self.ends, last)]

    @property
    def lengths(self) -> Floats:
        """Length (n,) [mm] of each path."""
        return np.asarray(self.parts.sum(axis=1))

    def directions(self) -> tuple[Floats, Floats]:
        """Return the unit vectors (n, 3) along the paths at their starts and at their ends; 0 for a path of length 0."""
        straight, wraps = self.ends - self.starts, self.parts[:, 1] > 0
        climb = _along(self.touches[1] - self.touches[0], self.axes)
        arms = (_across(touch - self.middles, self.axes) for touch in self.touches)
        along = (self.turns[:, None] * np.cross(self.axes, arm) + climb for arm in arms)
        first, last = (np.where(wraps[:, None], found, straight) for found in along)
        return _units(first), _units(last)

    def at(self, which: Ints, shares: Floats) -> Floats:
        """Points (m, 3) of the paths ``which`` (m,) at the fractions ``shares`` (m,) of their lengths, from 0 to 1."""
        before, along, behind = self.parts[which].T
        path = shares * (before + along + behind)
        on = _clipped(path - before, along)
        straight = _between(self.starts[which], self.touches[0][which], _clipped(path, before))
        last = _between(self.touches[1][which], self.ends[which], _clipped(path - before - along, behind))
        beyond, wraps = path > before + along, (along > 0) & (path > before)
        return np.where(beyond[:, None], last, np.where(wraps[:, None], self._on_surface(which, on), straight))

    def _on_surface(self, which: Ints, share: Floats) -> Floats:
        """Points (m, 3) at the fraction ``share`` (m,) of the part of each path on the surface."""
        first, last, axes, middles = (values[which] for values in (*self.touches, self.axes, self.middles))
        height, climb = _along(first - middles, axes), share[:, None] * _along(last - first, axes)
        turned = _turned(first - middles - height, axes, share * self.turns[which])
        return np.asarray(middles + height + climb + turned)


def around(obstacle: Quadric, starts: Floats, ends: Floats) -> Paths:
    """Compute the shortest paths from ``starts`` (n, 3) to ``ends`` (n, 3) [mm] around a sphere, in the plane of its centre and
    both points, or around a cylinder, along a helix. Points inside the obstacle are treated as lying on its surface.
    """
    middle = obstacle.pose[:3, 3]
    if np.isfinite(obstacle.radii[2]):
        arms = starts - middle
        axes = _perpendicular(np.cross(arms, ends - middle), arms)
    else:
        axis = obstacle.pose[:3, 2]
        one, other = (_across(points - middle, axis) for points in (starts, ends))
        axes = np.where(np.cross(one, other) @ axis < 0, -1.0, 1.0)[:, None] * axis
    return _around(starts, ends, middle, axes, float(obstacle.radii[0]))


def straight(starts: Floats, ends: Floats) -> Paths:
    """Return straight paths from ``starts`` (n, 3) to ``ends`` (n, 3) [mm]."""
    parts = np.zeros((len(starts), 3))
    parts[:, 0] = np.linalg.norm(ends - starts, axis=1)
    return Paths(parts, starts, ends, (ends, ends), starts, np.zeros_like(starts), np.zeros(len(starts)))


def _around(starts: Floats, ends: Floats, middle: Floats, axes: Floats, radius: float) -> Paths:
    """Compute paths that rotate from starts to ends, by at most half a turn, about ``axes`` (n, 3) through ``middle`` (3,).

    Seen along the axis, two points at distances d1, d2 from it and at an angle t from each other are joined by tangents of length
    sqrt(d^2 - r^2) and an arc of length r (t - acos(r / d1) - acos(r / d2)). If the angle in brackets is not positive, the path
    is straight. The displacement along the axis is uniform over the length of tangents and arc: unrolled, the path is straight.
    """
    one, other = _across(starts - middle, axes), _across(ends - middle, axes)
    sines, cosines = np.sum(np.cross(one, other) * axes, axis=1), np.sum(one * other, axis=1)
    near, far = (np.maximum(np.linalg.norm(arm, axis=1), radius) for arm in (one, other))
    first, last = np.arccos(radius / near), np.arccos(radius / far)
    turns = np.arctan2(np.maximum(sines, 0.0), cosines) - first - last
    wraps = turns > 0
    flat = np.stack([np.sqrt(near**2 - radius**2), radius * turns, np.sqrt(far**2 - radius**2)], axis=1)
    climbs = np.sum((ends - starts) * axes, axis=1)
    rises = climbs[:, None] * flat / np.where(wraps, flat.sum(axis=1), 1.0)[:, None]
    on = middle + radius * _turned(_units(one), axes, first) + _along(starts - middle, axes) + rises[:, :1] * axes
    off = middle + radius * _turned(_units(other), axes, -last) + _along(ends - middle, axes) - rises[:, 2:] * axes
    plain, picked = straight(starts, ends), wraps[:, None]
    return Paths(
        parts=np.where(picked, np.hypot(flat, rises), plain.parts),
        starts=starts,
        ends=ends,
        touches=(np.where(picked, on, ends), np.where(picked, off, ends)),
        middles=np.broadcast_to(middle, starts.shape),
        axes=axes,
        turns=np.where(wraps, turns, 0.0),
    )


def _turned(arms: Floats, axes: Floats, angles: Floats) -> Floats:
    """Rotate ``arms`` (n, 3), which are perpendicular to the unit ``axes``, about these axes by ``angles`` (n,)."""
    return np.asarray(np.cos(angles)[:, None] * arms + np.sin(angles)[:, None] * np.cross(axes, arms))


def _units(vectors: Floats) -> Floats:
    """Unit vectors (n, 3) along ``vectors``, 0 for a zero vector."""
    sizes = np.linalg.norm(vectors, axis=1)[:, None]
    return np.asarray(vectors / np.where(sizes > 0, sizes, 1.0))


def _along(vectors: Floats, axes: Floats) -> Floats:
    """Component of ``vectors`` (n, 3) along the unit ``axes``, (3,) or (n, 3)."""
    return np.asarray(np.sum(vectors * axes, axis=1)[:, None] * axes)


def _across(vectors: Floats, axes: Floats) -> Floats:
    """Component of ``vectors`` (n, 3) perpendicular to the unit ``axes``, (3,) or (n, 3)."""
    return np.asarray(vectors - _along(vectors, axes))


def _perpendicular(normals: Floats, arms: Floats) -> Floats:
    """Scale ``normals`` (n, 3) to length 1; if a normal is only round-off, use any direction perpendicular to its arm."""
    sizes = np.linalg.norm(normals, axis=1)[:, None]
    squares = np.sum(arms**2, axis=1)[:, None]
    spare = np.cross(arms, np.eye(3)[np.argmin(np.abs(arms), axis=1)])
    return _units(np.where(sizes > 1e-9 * squares, normals, spare))


def _clipped(path: Floats, length: Floats) -> Floats:
    """Return ``path`` as a fraction of ``length``, from 0 to 1; 0 if the length is 0."""
    return np.clip(path / np.where(length > 0, length, 1.0), 0.0, 1.0)


def _between(one: Floats, other: Floats, shares: Floats) -> Floats:
    return np.asarray(one + shares[:, None] * (other - one))
