"""Guesses before a case is solved: the path of a muscle, guessed from the motion of its bones, and its shape as a beam."""

from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation

from fem_reference.foundations.mesh import Floats, diagonal, enclosed_volume, triangle_areas
from fem_reference.foundations.motion import apply
from fem_reference.geometry.signed_distance import signed_distances
from fem_reference.problems.setup import Bone, Setup


@dataclass(frozen=True, eq=False)
class Guess:
    """A guess of the path of ``points`` (n, 3), which follow ``bones`` with ``weights`` (n, b). There is a bone for each
    attachment. The weights are in proportion to the inverse distances from the attachments, so that the muscle between two
    attachments remains straight, as under tension. If nothing is attached, the weights are in proportion to the inverse distances
    from the bones.
    """

    points: Floats
    bones: tuple[Bone, ...]
    weights: Floats

    @classmethod
    def of(cls, points: Floats, rest: Setup) -> "Guess":
        """The guess for ``points`` of the muscle with the set-up ``rest``."""
        if rest.attached:
            away = [cKDTree(rest.surface.points[entry.vertices]).query(points)[0] for entry in rest.attached]
        else:
            away = [np.abs(distance(bone, points)) for bone in rest.bones]
        near = 1 / np.maximum(np.stack(away, axis=1), 1e-3)
        bones = tuple(entry.bone for entry in rest.attached) or rest.bones
        return cls(points, bones, near / near.sum(axis=1, keepdims=True))

    def at(self, frame: float) -> Floats:
        """Positions (n, 3) [mm] at a frame."""
        parts = zip(self.bones, self.weights.T, strict=True)
        return np.sum([share[:, None] * apply(bone.pose(frame), self.points) for bone, share in parts], axis=0)


def distance(bone: Bone, points: Floats) -> Floats:
    """The signed distance (n,) [mm] of ``points`` to a bone at rest."""
    return bone.solid.sample(points).distance if bone.solid else signed_distances(points, bone.surface)


def motion(guess: Guess, axis: Floats, numbers: tuple[int, ...]) -> tuple[float, float, float, float]:
    """The maximum speed, speed perpendicular to an ``axis`` (3,), jump in velocity, and acceleration of a ``guess``, in this order,
    with frame numbers as time. Each is a root mean square over the points. A jump is a change of velocity of more than five times
    the median change.
    """
    some = slice(None, None, max(1, len(guess.points) // 100))
    guess = replace(guess, points=guess.points[some], weights=guess.weights[some])
    at = np.linspace(numbers[0], numbers[-1], min(401, 4 * (numbers[-1] - numbers[0]) + 1))
    velocity = np.diff(np.stack([guess.at(frame) for frame in at]), axis=0) / (at[1] - at[0])
    change = rms(np.diff(velocity, axis=0, prepend=0.0))  # from rest
    sudden = change > 5 * np.median(change) + 1e-12
    jump, smooth = (float(change[some].max(initial=0.0)) for some in (sudden, ~sudden))
    sideways = velocity - (velocity @ axis)[..., None] * axis
    return float(rms(velocity).max()), float(rms(sideways).max()), jump, smooth / (at[1] - at[0])


def strain(points: Floats, moved: Floats) -> float:
    """The strain of ``points`` (n, 3) that move to ``moved`` (n, 3), at most 1: the root-mean-square residual of the best rigid
    motion (Kabsch 1976, doi 10.1107/S0567739476001873), divided by the root-mean-square distance from the centroid.
    """
    rest, now = points - points.mean(axis=0), moved - moved.mean(axis=0)
    left, _, right = np.linalg.svd(now.T @ rest)
    turned = rest @ (left @ np.diag((1.0, 1.0, np.linalg.det(left @ right))) @ right).T
    return float(min(1.0, np.linalg.norm(now - turned) / np.linalg.norm(rest)))


def rms(vectors: Floats) -> Floats:
    """The root mean square length of ``vectors`` (n, 3) over n; for vectors (f, n, 3), an array (f,)."""
    return np.asarray(np.sqrt((vectors**2).sum(axis=-1).mean(axis=-1)))


def centres(rest: Setup) -> list[Floats]:
    """The mean (3,) [mm] of the vertices of each attachment at rest."""
    return [rest.surface.points[entry.vertices].mean(axis=0) for entry in rest.attached]


def spans(rest: Setup, numbers: tuple[int, ...]) -> Floats:
    """The distances (f,) [mm] between the centres of the first and the last attachment at frame ``numbers``.

    The array is empty if there are fewer than two attachments.
    """
    if len(rest.attached) < 2:
        return np.zeros(0)
    middles = centres(rest)
    first, last = ([apply(rest.attached[i].bone.pose(number), middles[i]) for number in numbers] for i in (0, -1))
    return np.asarray(np.linalg.norm(np.subtract(first, last), axis=1))


def described_motion(rest: Setup) -> str:
    """The influence of the bones' motion on the length of the muscle, in words; empty if there are fewer than two attachments."""
    lengths = spans(rest, rest.frames)
    if not len(lengths):
        return ""
    most = int(np.abs(lengths - lengths[0]).argmax())
    how = "longer" if lengths[most] > lengths[0] else "shorter"
    change = f"{100 * abs(lengths[most] / lengths[0] - 1):.0f} % {how}, at frame {rest.frames[most]}"
    names = f"{rest.attached[0].attachment} to {rest.attached[-1].attachment}"
    return f"the distance from {names} is {lengths[0]:.4g} mm at rest, and at most {change}"


def axis_of(rest: Setup) -> Floats:
    """The unit vector (3,) from the first attachment to the last; 0 if there are fewer than two attachments."""
    if len(rest.attached) < 2:
        return np.zeros(3)
    middles = centres(rest)
    return np.asarray((middles[-1] - middles[0]) / np.linalg.norm(middles[-1] - middles[0]))


def sag(rest: Setup, frames: list[int], travel: float) -> float:
    """The deviation [mm] of the muscle's axis from the straight line between two attachments. It is the sum of three parts: the
    deviation at rest in the middle third, the deviation due to rotating bones, and 1/20 of the ``travel`` [mm] (a sideways shift
    bends the axis into two waves, which are stiffer than one).
    """
    if len(rest.attached) < 2:
        return 0.0
    axis, away = axis_of(rest), rest.surface.points - centres(rest)[0]
    along = away @ axis / length_of(rest)
    middle = away[(along > 1 / 3) & (along < 2 / 3)]
    off = middle - (middle @ axis)[:, None] * axis
    at_rest = float(np.linalg.norm(off.mean(axis=0))) if len(off) else 0.0
    return at_rest + max(turn(rest, frame) for frame in frames) * length_of(rest) / 8 + 0.05 * travel


def turn(rest: Setup, frame: float) -> float:
    """The rotation [rad] of the last attached bone relative to the first attached bone, from rest to a ``frame``."""
    first, last = (rest.attached[i].bone.pose(frame)[:3, :3] for i in (0, -1))
    return float(Rotation.from_matrix(first.T @ last).magnitude())


def length_of(rest: Setup) -> float:
    """The length [mm] from the first attachment to the last, or of the entire muscle if there are fewer than two attachments."""
    middles = centres(rest) or [np.zeros(3)]
    return float(np.linalg.norm(middles[0] - middles[-1])) or diagonal(rest.surface.points)


def thickness_of(rest: Setup) -> float:
    """The thickness [mm] of a plate with the volume and the area of the muscle."""
    points, triangles = rest.surface.points, rest.surface.triangles
    return 2 * enclosed_volume(points, triangles) / float(triangle_areas(points, triangles).sum())
