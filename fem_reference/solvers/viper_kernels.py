"""Rods in position based dynamics: operations on quaternions, and projections of constraints.

There are k rods with p points each. ``points`` (k, p, 3) [mm]: their positions. ``radii`` (k, p) [mm]: the radii there. ``turns``
(k, p + 1, 4) are unit quaternions (w, x, y, z), which rotate the frames of segments from rest; the first and the last quaternion of
a rod are the rotations of the two bones, which prescribe its end points. All constraints of a kind are projected simultaneously
(Jacobi), with steps small enough that the sum of neighbouring steps does not overshoot. If constraints contradict each other,
sweeps converge to the minimum of the sum of squared errors, which does not depend on the order of the points.
"""

import numpy as np

from fem_reference.foundations.mesh import Floats

_TINY = np.finfo(float).tiny


def product(p: Floats, q: Floats) -> Floats:
    """The products (..., 4) of quaternions ``p`` and ``q`` (..., 4)."""
    a, b, c, d = (p[..., [i]] for i in range(4))
    w, x, y, z = (q[..., [i]] for i in range(4))
    real, i = a * w - b * x - c * y - d * z, a * x + b * w + c * z - d * y
    return np.concatenate([real, i, a * y - b * z + c * w + d * x, a * z + b * y - c * x + d * w], axis=-1)


def pure(vectors: Floats) -> Floats:
    """The quaternions (..., 4) with the imaginary parts ``vectors`` (..., 3) and the real part 0."""
    return np.concatenate([np.zeros_like(vectors[..., :1]), vectors], axis=-1)


def conjugate(turns: Floats) -> Floats:
    """The inverses (..., 4) of the rotations ``turns``."""
    return np.asarray(turns * [1.0, -1.0, -1.0, -1.0])


def turned(turns: Floats, vectors: Floats) -> Floats:
    """The ``vectors`` (..., 3) rotated by ``turns`` (..., 4)."""
    return product(product(turns, pure(vectors)), conjugate(turns))[..., 1:]


def unit(quaternions: Floats) -> Floats:
    """The ``quaternions`` (..., 4) divided by their norm."""
    return np.asarray(quaternions / np.maximum(np.linalg.norm(quaternions, axis=-1, keepdims=True), _TINY))


def matrices(turns: Floats) -> Floats:
    """The rotation matrices (..., 3, 3) of ``turns`` (..., 4); NaN for quaternions that are NaN."""
    return turned(turns[..., None, :], np.eye(3)).swapaxes(-1, -2)


def project_stretch(points: Floats, turns: Floats, rest: Floats, stiffness: float) -> None:
    """Project ``C = (x_b - x_a) / l - turned(u, t)`` of each segment from point a to point b.

    ``rest`` (k, p - 1, 3) [mm]: the vectors ``l t`` of the segments at rest, with the length l and the unit vector t; u is the
    quaternion of the segment. If C is 0 there is neither stretch nor shear (Kugelstadt and Schoemer 2016): the segment has its rest
    length and the direction of its frame. The inverse mass of a frame is 1 / l^2, so that the result does not depend on the unit of
    length: the sum of inverse masses times squared gradients is (1 + 1 + 4) / l^2. The step is reduced as if the sum were larger
    by 2 / l^2, which bounds the effect of neighbouring segments.
    """
    lengths = np.linalg.norm(rest, axis=2, keepdims=True)
    tangents, u = rest / lengths, turns[:, 1:-1]
    step = stiffness / 8 * (turned(u, tangents) - np.diff(points, axis=1) / lengths)
    points[:, 1:-1] -= np.diff(lengths * step, axis=1)
    u += 2 * product(pure(step), product(u, pure(tangents)))
    u[:] = unit(u)


def project_bend(turns: Floats, stiffness: float) -> None:
    """Project bend and twist ``C = Im(conjugate(u_a) u_b)`` between neighbouring segments, and between outer segments and bones.

    C is the Darboux vector of Kugelstadt and Schoemer (2016) if all frames of a rod are chosen parallel at rest. With this choice C
    is 0 at rest for a curved rod too.
    """
    a, b, found = turns[:, :-1], turns[:, 1:], np.zeros_like(turns)
    step = pure(-stiffness / 4 * product(conjugate(a), b)[..., 1:])
    found[:, :-1] -= product(b, step)
    found[:, 1:] += product(a, step)
    turns[:, 1:-1] += found[:, 1:-1]
    turns[:, 1:-1] = unit(turns[:, 1:-1])


def volumes(points: Floats, radii: Floats) -> Floats:
    """The volumes (k, p - 1) [mm3] of segments, which are truncated cones: ``pi / 3 l (r_a^2 + r_a r_b + r_b^2)``."""
    a, b = radii[:, :-1], radii[:, 1:]
    return np.asarray(np.pi / 3 * np.linalg.norm(np.diff(points, axis=1), axis=2) * (a * a + a * b + b * b))


def project_volume(points: Floats, radii: Floats, rest: Floats, stiffness: float) -> None:
    """Project ``C = V / V_0 - 1`` of each segment by changing ``points`` and ``radii``, with ``rest`` V_0 (k, p - 1) [mm3].

    Each point and each radius changes by the mean of the steps of the two adjacent segments; a radius at an end of a rod changes by
    the step of its single segment.
    """
    steps, a, b = np.diff(points, axis=1), radii[:, :-1], radii[:, 1:]
    lengths, ratio = np.linalg.norm(steps, axis=2), volumes(points, radii) / rest
    square = a * a + a * b + b * b
    # The derivatives of C with respect to the length and both radii.
    cone = np.pi / 3 / rest
    along, of_a, of_b = cone * square, cone * lengths * (2 * a + b), cone * lengths * (a + 2 * b)
    step = stiffness / 2 * (1 - ratio) / (2 * along**2 + of_a**2 + of_b**2)
    tangents = steps / np.maximum(lengths, _TINY)[..., None]
    points[:, 1:-1] -= np.diff((step * along)[..., None] * tangents, axis=1)
    change = np.zeros_like(radii)
    change[:, :-1] += step * of_a
    change[:, 1:] += step * of_b
    change[:, [0, -1]] *= 2
    radii += change
