"""Detection of points that pass through moving triangles from the front to the back."""

import numpy as np
from numpy.typing import NDArray

from fem_reference.foundations.mesh import Floats, normals

_SHARES = np.arange(4) / 3
# Matrices that map the values of a cubic at these fractions to its coefficients, and to its Bernstein coefficients, which bound it.
_CUBIC = np.linalg.inv(np.vander(_SHARES, 4))
_BERNSTEIN = np.linalg.inv(
    np.stack([(1, 3, 3, 1)[i] * _SHARES**i * (1 - _SHARES) ** (3 - i) for i in range(4)], axis=1)
)


def passed(starts: Floats, ends: Floats, before: Floats, after: Floats) -> NDArray[np.bool_]:
    """Mask (n,) of the points that pass through the triangle in the same row from its front to its back. The points move straight
    from ``starts`` to ``ends`` (n, 3), and the corners of the triangles from ``before`` to ``after`` (n, 3, 3).

    The volume of the tetrahedron formed by point and triangle is a cubic function of the fraction of the path, and is 0 where the
    point is in the plane (Provot 1997, Collision and self-collision handling in cloth model dedicated to design garments).
    """

    def at(share: float, some: NDArray[np.int64] | slice) -> tuple[Floats, Floats]:
        return tuple(a[some] + share * (b[some] - a[some]) for a, b in ((starts, ends), (before, after)))  # type: ignore[return-value]

    every = slice(None)
    volumes = np.stack([_volume(*at(share, every)) for share in _SHARES])
    found = np.zeros(len(starts), bool)
    for i in np.flatnonzero((volumes[0] > 0) & ~((_BERNSTEIN @ volumes).min(axis=0) > 0)):
        roots = np.roots(_CUBIC @ volumes[:, i])
        shares = roots.real[(np.abs(roots.imag) < 1e-9) & (roots.real >= 0) & (roots.real <= 1)]
        found[i] = any(_is_inside(*at(share, np.array([i]))) for share in shares)
    return found


def _volume(points: Floats, triangles: Floats) -> Floats:
    """Six times the volume (n,) of the tetrahedra formed by points (n, 3) and triangles (n, 3, 3); positive for points in front."""
    return np.asarray(np.einsum("ni,ni->n", points - triangles[:, 0], normals(triangles)))


def _is_inside(point: Floats, triangle: Floats) -> bool:
    """True if a ``point`` (1, 3) in the plane of a ``triangle`` (1, 3, 3) is inside the triangle."""
    across = normals(triangle)[0]
    arms = triangle[0] - point
    return bool((np.cross(arms, np.roll(arms, -1, axis=0)) @ across >= 0).all())


def seen_along(points: Floats, directions: Floats, triangles: Floats) -> Floats:
    """Distance (n,) [mm] from ``points`` (n, 3), along unit vectors ``directions`` (n, 3), to the first of ``triangles`` (t, 3, 3)
    whose back faces the point; infinite if there is none (Moeller and Trumbore 1997).
    """
    first, one, other = triangles[:, 0], triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0]
    out, found = np.cross(one, other), np.full(len(points), np.inf)
    for i, (point, direction) in enumerate(zip(points, directions, strict=True)):
        across, away = np.cross(direction, other), point - first
        turn = np.cross(away, one)
        with np.errstate(divide="ignore", invalid="ignore"):
            scale = 1 / np.vecdot(one, across)
            u, v, far = np.vecdot(away, across) * scale, turn @ direction * scale, np.vecdot(other, turn) * scale
            hit = (u >= 0) & (v >= 0) & (u + v <= 1) & (far > 0) & (out @ direction > 0)
        found[i] = far[hit].min(initial=np.inf)
    return found
