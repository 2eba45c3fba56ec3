"""Rods of position based dynamics: quaternions and the projections of constraints.

k rods of p points each have ``points`` (k, p, 3) and ``radii`` (k, p) [mm], and ``turns`` (k, p + 1, 4): unit quaternions
(w, x, y, z) that rotate each segment's frame from rest; the first and last are the rotations of the two bones, which prescribe the
end points. All constraints of a kind are projected at once (Jacobi), with steps so small that their sum with the steps of
neighbours does not overshoot. If constraints contradict each other, the limit is the least sum of squares, for any order of points.
"""

import numpy as np

from fem_reference.foundations.mesh import Floats

_TINY = np.finfo(float).tiny


def product(p: Floats, q: Floats) -> Floats:
    """Products (..., 4) of quaternions."""
    a, b, c, d = (p[..., [i]] for i in range(4))
    w, x, y, z = (q[..., [i]] for i in range(4))
    real, i = a * w - b * x - c * y - d * z, a * x + b * w + c * z - d * y
    return np.concatenate([real, i, a * y - b * z + c * w + d * x, a * z + b * y - c * x + d * w], axis=-1)


def pure(vectors: Floats) -> Floats:
    """The quaternions (..., 4) without real part of ``vectors`` (..., 3)."""
    return np.concatenate([np.zeros_like(vectors[..., :1]), vectors], axis=-1)


def conjugate(turns: Floats) -> Floats:
    """The inverses (..., 4) of the rotations ``turns``."""
    return np.asarray(turns * [1.0, -1.0, -1.0, -1.0])


def turned(turns: Floats, vectors: Floats) -> Floats:
    """The ``vectors`` (..., 3) turned by ``turns`` (..., 4)."""
    return product(product(turns, pure(vectors)), conjugate(turns))[..., 1:]


def unit(quaternions: Floats) -> Floats:
    """The ``quaternions`` (..., 4) divided by their norm."""
    return np.asarray(quaternions / np.maximum(np.linalg.norm(quaternions, axis=-1, keepdims=True), _TINY))


def matrices(turns: Floats) -> Floats:
    """The rotations (..., 3, 3) of ``turns`` (..., 4); NaN if they are NaN."""
    return turned(turns[..., None, :], np.eye(3)).swapaxes(-1, -2)


def project_stretch(points: Floats, turns: Floats, rest: Floats, stiffness: float) -> None:
    """Project ``C = (x_b - x_a) / l - turned(u, t)`` of each segment, which is ``l t`` at ``rest`` (k, p - 1, 3) [mm].

    Where C is 0 there is neither stretch nor shear (Kugelstadt and Schoemer 2016): the segment has its rest length and the
    direction of its frame. A frame has the inverse mass 1 / l^2, so nothing depends on the unit of length: the sum of inverse
    masses times squared slopes is (1 + 1 + 4) / l^2, and another 2 / l^2 bounds the effect of neighbours.
    """
    lengths = np.linalg.norm(rest, axis=2, keepdims=True)
    tangents, u = rest / lengths, turns[:, 1:-1]
    step = stiffness / 8 * (turned(u, tangents) - np.diff(points, axis=1) / lengths)
    points[:, 1:-1] -= np.diff(lengths * step, axis=1)
    u += 2 * product(pure(step), product(u, pure(tangents)))
    u[:] = unit(u)


def project_bend(turns: Floats, stiffness: float) -> None:
    """Project ``C = Im(conjugate(u_a) u_b)``, bend and twist, of neighbouring segments and of the outer segments and bones.

    C is the Darboux vector of Kugelstadt and Schoemer (2016) if frames at rest are parallel: rods curved at rest remain so.
    """
    a, b, found = turns[:, :-1], turns[:, 1:], np.zeros_like(turns)
    step = pure(-stiffness / 4 * product(conjugate(a), b)[..., 1:])
    found[:, :-1] -= product(b, step)
    found[:, 1:] += product(a, step)
    turns[:, 1:-1] += found[:, 1:-1]
    turns[:, 1:-1] = unit(turns[:, 1:-1])


def volumes(points: Floats, radii: Floats) -> Floats:
    """Volumes (k, p - 1) [mm3] of segments as truncated cones, ``pi / 3 l (r_a^2 + r_a r_b + r_b^2)``."""
    a, b = radii[:, :-1], radii[:, 1:]
    return np.asarray(np.pi / 3 * np.linalg.norm(np.diff(points, axis=1), axis=2) * (a * a + a * b + b * b))


def project_volume(points: Floats, radii: Floats, rest: Floats, stiffness: float) -> None:
    """Project ``C = V / V_0 - 1`` of each segment by changing ``points`` and ``radii``; ``rest`` V_0 (k, p - 1) [mm3].

    Each point and radius changes by the mean of the steps of its two segments; a radius at an end has one segment.
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
