"""Rigid motion of a bone: the 4 x 4 pose at each frame number, from rotation about a fixed axis or sliding along it."""

from dataclasses import dataclass

import numpy as np

from fem_reference.foundations.mesh import Floats

# Frame numbers between which a motion is uniform (straight, or about one axis), and the rotation angle [rad] at each of them.
Turning = tuple[tuple[float, ...], tuple[float, ...]]


@dataclass(frozen=True)
class RigidMotion:
    """Motion of a bone between keyframes ``frames``, by linear interpolation of ``amounts``.

    The bone rotates about the line through ``centre`` [mm] along ``axis`` by ``amounts`` [rad] or, without a centre, slides along
    ``axis``, which may have any length, by ``amounts`` [mm]. It does not move before the first keyframe or after the last.
    Rotation is right-handed: a positive angle about +x takes +y to +z.
    """

    axis: tuple[float, float, float]
    centre: tuple[float, float, float] | None
    frames: tuple[float, ...]
    amounts: tuple[float, ...]

    def pose(self, frame: float) -> Floats:
        """Matrix (4, 4) that maps rest positions to positions at ``frame``.

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
        """Unit vector (3,) along the axis."""
        return np.asarray(self.axis, float) / np.linalg.norm(self.axis)

    def turning(self, points: Floats) -> Turning:  # noqa: ARG002
        """Return the keyframes and the rotation angles [rad] at them; all angles are 0 if the bone slides."""
        return self.frames, self.amounts if self.centre is not None else (0.0,) * len(self.frames)


def apply(pose: Floats, points: Floats) -> Floats:
    """Move ``points`` (n, 3) [mm] by a ``pose`` (4, 4); returns (n, 3)."""
    return np.asarray(points @ pose[:3, :3].T + pose[:3, 3])
