"""Smooth obstacles for paths: quadrics (ellipsoids and cylinders) and tori; level functions and their first two derivatives."""

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Self

import numpy as np

from fem_reference.foundations.mesh import Floats, Ints

# A point this close to the centre of an obstacle, relative to its size, is pushed out in an arbitrary direction.
_MIDDLE = 1e-9


@dataclass(frozen=True, eq=False)
class Touch:
    """Contacts of n paths with the ``obstacles`` (n,): the points (n, 3) [mm] at which each path arrives (``met``) and leaves
    (``left``), and the tangents (n, 3) ``into`` and ``out`` of the contact.
    """

    obstacles: Ints
    met: Floats
    into: Floats
    left: Floats
    out: Floats


@dataclass(frozen=True, eq=False)
class Quadric:
    """An ellipsoid with semi-axes ``radii`` (3,) [mm] along the axes of its ``pose`` (4, 4).

    An infinite semi-axis makes it a cylinder.
    """

    pose: Floats
    radii: Floats

    @property
    def bend(self) -> float:
        """Smallest radius of curvature [mm], which occurs at the ends of the longest finite axis."""
        finite = self.radii[np.isfinite(self.radii)]
        return float(finite.min() ** 2 / finite.max())

    def moved(self, pose: Floats) -> Self:
        """Return the surface moved by ``pose`` (4, 4)."""
        return replace(self, pose=pose @ self.pose)

    def level(self, points: Floats) -> tuple[Floats, Floats]:
        """Return the level (n,) at ``points`` (n, 3) and its gradients (n, 3). The level is the sum of (x / a)^2 minus 1."""
        own = self._own(points) / self.radii
        return np.vecdot(own, own) - 1, 2 * (own / self.radii) @ self.pose[:3, :3].T

    def bending(self, _: Floats, directions: Floats) -> Floats:
        """Second derivative (n,) of the level along ``directions`` (n, 3); it is the same at all points."""
        own = directions @ self.pose[:3, :3] / self.radii
        return np.asarray(2 * np.vecdot(own, own))

    def curving(self, points: Floats, directions: Floats) -> Floats:
        """Curvature vectors (n, 3) [1/mm] of the geodesics through ``points`` (n, 3) along ``directions`` (n, 3)."""
        slope = (points - self.pose[:3, 3]) @ self._form
        return np.asarray((-np.vecdot(directions @ self._form, directions) / np.vecdot(slope, slope))[:, None] * slope)

    @cached_property
    def _form(self) -> Floats:
        """Matrix (3, 3) of half the second derivatives of the level."""
        turn = self.pose[:3, :3] / self.radii
        return np.asarray(turn @ turn.T)

    def pushed(self, points: Floats) -> Floats:
        """Move inner ``points`` (n, 3) to the surface along its normal; points at the centre or axis are first moved off it."""
        own, thin = self._own(points), int(np.argmin(self.radii))
        own[np.sum((own / self.radii) ** 2, axis=1) < _MIDDLE**2, thin] = _MIDDLE * self.radii[thin]
        size = np.sqrt(np.sum((own / self.radii) ** 2, axis=1))
        scale = np.where(np.isfinite(self.radii), (0.8 / np.clip(size, _MIDDLE, 0.8))[:, None], 1.0)
        moved = (own * scale) @ self.pose[:3, :3].T + self.pose[:3, 3]
        inside = size < 1
        for _ in range(3):
            value, slope = self.level(moved)
            moved = moved - (inside * value / np.maximum(np.vecdot(slope, slope), 1e-12))[:, None] * slope
        return np.asarray(moved)

    def deepest(self, begins: Floats, ends: Floats) -> Floats:
        """Positions of the lowest level on the segments from ``begins`` to ``ends`` (..., 3), as fractions of their length."""
        one, other = self._own(begins) / self.radii, self._own(ends) / self.radii
        along = other - one
        return np.asarray(np.clip(-np.vecdot(one, along) / np.maximum(np.vecdot(along, along), 1e-300), 0, 1))

    def _own(self, points: Floats) -> Floats:
        return np.asarray((points - self.pose[:3, 3]) @ self.pose[:3, :3])


@dataclass(frozen=True, eq=False)
class Ring:
    """A torus about the third axis of ``pose`` (4, 4): a tube of radius ``tube`` [mm] around a circle of ``radius`` [mm].

    Paths pass through its hole.
    """

    pose: Floats
    radius: float
    tube: float

    @property
    def bend(self) -> float:
        """Radius of the tube [mm]."""
        return self.tube

    def moved(self, pose: Floats) -> Self:
        """Return the surface moved by ``pose`` (4, 4)."""
        return replace(self, pose=pose @ self.pose)

    def level(self, points: Floats) -> tuple[Floats, Floats]:
        """Return the level (n,) and its gradients (n, 3). The level is the squared distance from the circle minus ``tube**2``."""
        across = points - self._nearest(points)
        return np.vecdot(across, across) - self.tube**2, 2 * across

    def bending(self, points: Floats, directions: Floats) -> Floats:
        """Second derivative (n,) of the level at ``points`` (n, 3) along ``directions`` (n, 3)."""
        return self._bending(directions, *self._outward(points))

    def curving(self, points: Floats, directions: Floats) -> Floats:
        """Curvature vectors (n, 3) [1/mm] of the geodesics through ``points`` (n, 3) along ``directions`` (n, 3)."""
        outward, away = self._outward(points)
        slope = 2 * (points - self.pose[:3, 3] - self.radius * outward)
        bending = self._bending(directions, outward, away)
        return np.asarray((-bending / np.vecdot(slope, slope))[:, None] * slope)

    def _bending(self, directions: Floats, outward: Floats, away: Floats) -> Floats:
        squares = np.vecdot(directions, outward) ** 2 + (directions @ self.pose[:3, 2]) ** 2
        around = np.vecdot(directions, directions) - squares
        return np.asarray(2 * (squares + around * (1 - self.radius / away)))

    def pushed(self, points: Floats) -> Floats:
        """Move those ``points`` (n, 3) that are inside to the surface, away from the central circle of the tube."""
        middle = self._nearest(points)
        across = points - middle
        across[np.linalg.norm(across, axis=1) < _MIDDLE * self.tube] = _MIDDLE * self.tube * self.pose[:3, 2]
        size = np.linalg.norm(across, axis=1)[:, None]
        return np.asarray(middle + across * np.maximum(self.tube / size, 1.0))

    def through(self, starts: Floats, ends: Floats) -> Floats:
        """Points (n, 3) in the hole, nearest to where straight paths cross its plane; midpoints of paths that do not cross it."""
        axis, centre = self.pose[:3, 2], self.pose[:3, 3]
        low, high = (starts - centre) @ axis, (ends - centre) @ axis
        crosses = low * high < 0
        share = np.where(crosses, low / np.where(crosses, low - high, 1.0), 0.5)[:, None]
        point = starts + share * (ends - starts)
        outward, away = self._outward(point)
        inner = centre + np.minimum(away, self.radius - self.tube)[:, None] * outward
        return np.where(crosses[:, None], inner, point)

    def _outward(self, points: Floats) -> tuple[Floats, Floats]:
        """Return unit vectors (n, 3) away from the axis (or, on it, along the first axis of the pose), and distances (n,)."""
        arm = points - self.pose[:3, 3]
        flat = arm - (arm @ self.pose[:3, 2])[:, None] * self.pose[:3, 2]
        away = np.sqrt(np.vecdot(flat, flat))
        flat[away < _MIDDLE * self.radius] = _MIDDLE * self.radius * self.pose[:3, 0]
        away = np.maximum(away, _MIDDLE * self.radius)
        return flat / away[:, None], away

    def _nearest(self, points: Floats) -> Floats:
        """Points (n, 3) of the circle nearest to ``points`` (n, 3)."""
        return np.asarray(self.pose[:3, 3] + self.radius * self._outward(points)[0])


# A smooth surface, whose level is 0 on the surface and negative inside.
SmoothSurface = Quadric | Ring
