"""Rigid motion of a bone: frame number -> 4 x 4 pose, by an angle about a fixed axis or a distance along it, between keyframes."""

from dataclasses import dataclass

import numpy as np

from fem_reference.foundations.mesh import Floats

# Frame numbers between which a motion is steady, straight or about one axis, and the angle [rad] that it has turned by at each.
Turning = tuple[tuple[float, ...], tuple[float, ...]]


@dataclass(frozen=True)
class Rotation:
    """Turning about the line through ``centre`` [mm] along ``axis`` by ``angles`` [rad] at ``frames``, linear in between.

    Before the first and after the last keyframe the bone rests there. Right-handed: a positive angle about +x takes +y to +z.
    """

    axis: tuple[float, float, float]
    centre: tuple[float, float, float]
    frames: tuple[float, ...]
    angles: tuple[float, ...]

    def pose(self, frame: float) -> Floats:
        """The 4 x 4 matrix that takes rest positions to positions at ``frame``.

        >>> quarter = Rotation((1, 0, 0), (0, 0, 0), (0.0, 10.0), (0.0, np.pi / 2))
        >>> np.round(quarter.pose(10) @ [0, 1, 0, 1], 12).tolist()
        [0.0, 0.0, 1.0, 1.0]
        """
        angle = float(np.interp(frame, self.frames, self.angles))
        centre, (x, y, z) = np.asarray(self.centre), np.asarray(self.axis, float) / np.linalg.norm(self.axis)
        cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
        turn = np.eye(3) + np.sin(angle) * cross + (1 - np.cos(angle)) * cross @ cross  # Rodrigues' formula
        return _pose(turn, centre - turn @ centre)

    def turning(self, points: Floats) -> Turning:  # noqa: ARG002
        """The keyframes."""
        return self.frames, self.angles


@dataclass(frozen=True)
class Translation:
    """Sliding along ``direction``, of any length, by ``distances`` [mm] at ``frames``, linear in between.

    Before the first and after the last keyframe the bone rests there.
    """

    direction: tuple[float, float, float]
    frames: tuple[float, ...]
    distances: tuple[float, ...]

    def pose(self, frame: float) -> Floats:
        """The 4 x 4 matrix that takes rest positions to positions at ``frame``.

        >>> down = Translation((0, -2, 0), (0.0, 10.0), (0.0, 30.0))
        >>> (down.pose(5) @ [1, 1, 1, 1]).tolist()
        [1.0, -14.0, 1.0, 1.0]
        """
        distance = float(np.interp(frame, self.frames, self.distances))
        return _pose(np.eye(3), distance * np.asarray(self.direction, float) / np.linalg.norm(self.direction))

    def turning(self, points: Floats) -> Turning:  # noqa: ARG002
        """The keyframes, between which nothing turns."""
        return self.frames, (0.0,) * len(self.frames)


RigidMotion = Rotation | Translation


def _pose(turn: Floats, shift: Floats) -> Floats:
    pose = np.eye(4)
    pose[:3, :3], pose[:3, 3] = turn, shift
    return pose


def apply(pose: Floats, points: Floats) -> Floats:
    """``points`` (n, 3) [mm] moved by a ``pose`` (4, 4), (n, 3)."""
    return np.asarray(points @ pose[:3, :3].T + pose[:3, 3])
