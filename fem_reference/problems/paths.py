"""Prescribed paths: displacements of rest points over the frames, as callables that can be pickled."""

from dataclasses import dataclass

import numpy as np
from scipy.spatial.transform import Rotation

from fem_reference.foundations.mesh import Floats, Ints

Matrix = tuple[tuple[float, float, float], ...]
ONCE = ((0.0, 0.0), (1.0, 1.0))  # from rest at frame 0 to all of it at frame 1


def amount(knots: tuple[tuple[float, float], ...], frame: float) -> float:
    """How much is prescribed at a frame: linear between ``knots`` of (frame, amount)."""
    frames, amounts = zip(*knots, strict=True)
    return float(np.interp(frame, frames, amounts))


@dataclass(frozen=True)
class Rest:
    """Nothing moves."""

    def __call__(self, points: Floats, frame: float) -> Floats:  # noqa: ARG002
        """Zero, (n, 3) [mm]."""
        return np.zeros_like(points)


@dataclass(frozen=True)
class Affine:
    """``amount (gradient X + shift)``: the displacement gradient (3, 3) and a shift [mm], times the amount at the frame."""

    gradient: Matrix
    shift: tuple[float, float, float] = (0.0, 0.0, 0.0)
    knots: tuple[tuple[float, float], ...] = ONCE

    def __call__(self, points: Floats, frame: float) -> Floats:
        """The displacement (n, 3) [mm] of rest points (n, 3)."""
        return np.asarray(amount(self.knots, frame) * (points @ np.array(self.gradient).T + np.array(self.shift)))


@dataclass(frozen=True)
class Turn:
    """A rotation by ``angle`` [rad] times the amount at the frame, about ``axis`` through ``centre`` [mm]; with ``per_length`` the
    angle is per mm along the axis from the centre: a twist.
    """

    axis: tuple[float, float, float]
    angle: float
    centre: tuple[float, float, float] = (0.0, 0.0, 0.0)
    per_length: bool = False
    knots: tuple[tuple[float, float], ...] = ONCE

    def __call__(self, points: Floats, frame: float) -> Floats:
        """The displacement (n, 3) [mm] of rest points (n, 3)."""
        unit = np.array(self.axis) / np.linalg.norm(self.axis)
        arms = points - np.array(self.centre)
        along = arms @ unit if self.per_length else np.ones(len(points))
        angles = amount(self.knots, frame) * self.angle * along
        turned = Rotation.from_rotvec(angles[:, None] * unit).apply(arms)
        return np.asarray(turned - arms)


@dataclass(frozen=True)
class Radial:
    """Away from the origin along the axes that ``along`` counts (1) or not (0), by ``share`` of the distance times the amount."""

    share: float
    along: tuple[float, float, float] = (1.0, 1.0, 1.0)
    knots: tuple[tuple[float, float], ...] = ONCE

    def __call__(self, points: Floats, frame: float) -> Floats:
        """The displacement (n, 3) [mm] of rest points (n, 3)."""
        return np.asarray(amount(self.knots, frame) * self.share * points * np.array(self.along))


@dataclass(frozen=True)
class Along:
    """One fibre direction everywhere, a unit vector."""

    direction: tuple[float, float, float]

    def __call__(self, cells: Ints, points: Floats) -> Floats:  # noqa: ARG002
        """The direction (n, 3) at rest points (n, 3)."""
        return np.tile(np.array(self.direction), (len(points), 1))
