"""Winding numbers of closed surfaces: of points, and just outside each triangle (valid, inside another part, or inside out)."""

import igl
import numpy as np
from numpy.typing import NDArray

from fem_reference.foundations.mesh import Floats, Surface, diagonal, normals

# The distance of the sample point outside a triangle, as a share of the surface's diagonal.
_STEP = 1e-5


def inside(surface: Surface, points: Floats) -> NDArray[np.bool_]:
    """Mask (n,) of the ``points`` (n, 3) that a closed ``surface`` winds round."""
    if len(points) == 0:
        return np.zeros(0, bool)
    return np.asarray(igl.fast_winding_number(surface.points, surface.triangles, points) > 0.5)


@np.errstate(over="ignore", invalid="ignore")
def outer_windings(surface: Surface) -> Floats:
    """The winding number (m,) of the surface at a point just outside each triangle: 0 on the skin of a valid body, positive
    inside another part of the body, negative where the triangle faces a part that is inside out; NaN where a triangle has no
    normal.

    "Just outside" is 1e-5 of the surface's diagonal away; thinner folds are not distinguished. Winding numbers by Barill et al.
    2018, doi 10.1145/3197517.3201337, differ by a few thousandths from the whole numbers to which they are rounded.
    """
    points, triangles = surface.points - surface.points.mean(axis=0), surface.triangles
    corners = points[triangles]
    across = normals(corners)
    sizes = np.linalg.norm(across, axis=1)
    step = _STEP * diagonal(points)
    if not (np.isfinite(step) and np.isfinite(sizes).all()):
        return np.full(len(triangles), np.nan)
    outside = corners.sum(axis=1) / 3 + step * across / np.where(sizes > 0, sizes, 1)[:, None]
    return np.where(sizes > 0, np.round(igl.fast_winding_number(points, triangles, outside)), np.nan)
