"""Rigid motion of a bone: frame number -> 4 x 4 pose, by an angle about a fixed axis or a distance along it, between keyframes."""

from dataclasses import dataclass

import numpy as np

from fem_reference.foundations.mesh import Floats

# Frame numbers between which a motion is steady (straight, or about one axis), and the angle [rad] of the rotation at each.
Turning = tuple[tuple[float, ...], tuple[float, ...]]


@dataclass(frozen=True)
class RigidMotion:
    """Rotation about the line through ``centre`` [mm] along ``axis`` by ``amounts`` [rad] at ``frames``, or, without a centre,
    sliding along the ``axis``, which may have any length, by ``amounts`` [mm]; linear in between.

    Before the first keyframe and after the last, the bone does not move. Right-handed: a positive angle about +x takes +y to +z.
    """

    axis: tuple[float, float, float]
    centre: tuple[float, float, float] | None
    frames: tuple[float, ...]
    amounts: tuple[float, ...]

    def pose(self, frame: float) -> Floats:
        """The 4 x 4 matrix that takes rest positions to positions at ``frame``.

        >>> quarter = RigidMotion((1, 0, 0), (0, 0, 0), (0.0, 10.0), (0.0, np.pi / 2))
        >>> np.round(quarter.pose(10) @ [0, 1, 0, 1], 12).tolist()
        [0.0, 0.0, 1.0, 1.0]
        >>> down = RigidMotion((0, -2, 0), None, (0.0, 10.0), (0.0, 30.0))
        >>> (down.pose(5) @ [1, 1, 1, 1]).tolist()
        [1.0, -14.0, 1.0, 1.0]
        """
        pose, amount = np.eye(4), float(np.interp(frame, self.frames, self.amounts))
        if self.centre is None:
            pose[:3, 3] = amount * self.along
            return pose
        centre, (x, y, z) = np.asarray(self.centre), self.along
        cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
        turn = np.eye(3) + np.sin(amount) * cross + (1 - np.cos(amount)) * cross @ cross  # Rodrigues' formula
        pose[:3, :3], pose[:3, 3] = turn, centre - turn @ centre
        return pose

    @property
    def along(self) -> Floats:
        """The unit vector (3,) of the axis."""
        return np.asarray(self.axis, float) / np.linalg.norm(self.axis)

    def turning(self, points: Floats) -> Turning:  # noqa: ARG002
        """The keyframes and their angles [rad], all 0 if the bone slides."""
        return self.frames, self.amounts if self.centre is not None else (0.0,) * len(self.frames)


def apply(pose: Floats, points: Floats) -> Floats:
    """``points`` (n, 3) [mm] moved by a ``pose`` (4, 4), (n, 3)."""
    return np.asarray(points @ pose[:3, :3].T + pose[:3, 3])
