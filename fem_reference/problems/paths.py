"""Prescribed paths: displacements of rest points over the frames, as callables that can be pickled."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from fem_reference.foundations.mesh import Floats, Ints
from fem_reference.foundations.motion import Turning, apply
from fem_reference.problems.resolved_paths import turning

Matrix = tuple[tuple[float, float, float], ...]
ONCE = ((0.0, 0.0), (1.0, 1.0))  # from rest at frame 0 to the full amount at frame 1


def amount(knots: tuple[tuple[float, float], ...], frame: float) -> float:
    """The prescribed amount at a frame: linear between ``knots`` of (frame, amount)."""
    frames, amounts = zip(*knots, strict=True)
    return float(np.interp(frame, frames, amounts))


@dataclass(frozen=True)
class Rest:
    """A path without motion."""

    def __call__(self, points: Floats, frame: float) -> Floats:  # noqa: ARG002
        """Displacements of zero, (n, 3) [mm]."""
        return np.zeros_like(points)

    def turning(self, points: Floats) -> Turning:  # noqa: ARG002
        """No frames and no angles, as there is no motion."""
        return (), ()


@dataclass(frozen=True)
class Affine:
    """``amount (gradient X + shift)`` at the rest position X: a displacement gradient (3, 3) and a shift [mm], times the amount."""

    gradient: Matrix
    shift: tuple[float, float, float] = (0.0, 0.0, 0.0)
    knots: tuple[tuple[float, float], ...] = ONCE

    def __call__(self, points: Floats, frame: float) -> Floats:
        """The displacement (n, 3) [mm] of rest points (n, 3)."""
        return np.asarray(amount(self.knots, frame) * (points @ np.array(self.gradient).T + np.array(self.shift)))

    def turning(self, points: Floats) -> Turning:  # noqa: ARG002
        """The frames of the knots, between which every point moves along a straight line, and an angle of 0 at each."""
        return tuple(frame for frame, _ in self.knots), (0.0,) * len(self.knots)


def radially(
    share: float, along: tuple[float, float, float] = (1.0, 1.0, 1.0), knots: tuple[tuple[float, float], ...] = ONCE
) -> Affine:
    """A displacement away from the origin by ``share`` times amount times distance, along axes whose entry in ``along`` is 1."""
    x, y, z = along
    return Affine(((share * x, 0.0, 0.0), (0.0, share * y, 0.0), (0.0, 0.0, share * z)), knots=knots)


@dataclass(frozen=True)
class Turn:
    """A rotation by ``angle`` [rad] times the amount at the frame, about ``axis`` through ``centre`` [mm]. If ``per_length`` is
    True, ``angle`` is the angle per mm of distance from the centre along the axis, as in a twist.
    """

    axis: tuple[float, float, float]
    angle: float
    centre: tuple[float, float, float] = (0.0, 0.0, 0.0)
    per_length: bool = False
    knots: tuple[tuple[float, float], ...] = ONCE

    def __call__(self, points: Floats, frame: float) -> Floats:
        """The displacement (n, 3) [mm] of rest points (n, 3)."""
        unit, arms, along = self._arms(points)
        angles = amount(self.knots, frame) * self.angle * along
        turned = Rotation.from_rotvec(angles[:, None] * unit).apply(arms)
        return np.asarray(turned - arms)

    def turning(self, points: Floats) -> Turning:
        """The frames of the knots, and at each knot the angle [rad] of the point that rotates most."""
        _, _, along = self._arms(points)
        most = abs(self.angle) * float(np.abs(along).max(initial=0.0))
        return tuple(frame for frame, _ in self.knots), tuple(most * much for _, much in self.knots)

    def _arms(self, points: Floats) -> tuple[Floats, Floats, Floats]:
        """The unit vector (3,) of the axis, the vectors (n, 3) from the centre to the points, and the factor (n,) of the angle."""
        unit = np.array(self.axis) / np.linalg.norm(self.axis)
        arms = points - np.array(self.centre)
        return unit, arms, arms @ unit if self.per_length else np.ones(len(points))


@dataclass(frozen=True)
class From:
    """A ``pose`` as a function of the frame number, without its motion before the frame ``first``: it is constant until then."""

    first: float
    pose: Callable[[float], Floats]

    def __call__(self, frame: float) -> Floats:
        """The 4 x 4 matrix at ``frame``."""
        return self.pose(max(frame, self.first))

    def turning(self, points: Floats) -> Turning | None:
        """The frames and angles of the pose, from the frame ``first`` on."""
        known = turning(self.pose, points)
        if known is None or not known[0]:
            return known
        frames = (self.first, *(frame for frame in known[0] if frame > self.first))
        return frames, tuple(np.interp(frames, *known).tolist())


@dataclass(frozen=True)
class Follows:
    """The displacement of points attached to a bone. ``pose``: its pose as a function of the frame number."""

    pose: Callable[[float], Floats]

    def __call__(self, points: Floats, frame: float) -> Floats:
        """The displacements (n, 3) [mm] of rest points (n, 3) at a frame number."""
        return apply(self.pose(frame), points) - points

    def turning(self, points: Floats) -> Turning | None:
        """The frames and angles of the pose."""
        return turning(self.pose, points)


@dataclass(frozen=True)
class Along:
    """A uniform fibre direction, a unit vector."""

    direction: tuple[float, float, float]

    def __call__(self, cells: Ints, points: Floats) -> Floats:  # noqa: ARG002
        """The direction (n, 3) at rest points (n, 3)."""
        return np.tile(np.array(self.direction), (len(points), 1))
