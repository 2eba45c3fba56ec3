"""Patches of triangles spanned by landmarks on a surface, and draped on it."""

import igl
import numpy as np

from fem_reference.foundations.errors import InputError
from fem_reference.foundations.mesh import Floats, Ints, Surface
from fem_reference.geometry.distance import distances
from fem_reference.geometry.skins import edge_lengths

# The most triangles of a draped patch: those of a patch of some metres.
_MOST_TRIANGLES = 2**20
# The longest side [mm] of the triangles of a draped patch.
_SIDE = 2.0


def draped(patches: Surface, bone_surface: Surface) -> Surface:
    """The patches draped on the bone: in triangles with sides of at most 2 mm, each corner moved to the nearest point of the
    bone.

    Landmarks lie on the bone, but the triangles between them do not in a hollow: over the iliac fossa they are 13 mm off, more
    than the thickness of the muscle there.
    """
    points, triangles = patches.points, patches.triangles
    longest = _longest_side(points, triangles)
    if len(triangles) * (longest / _SIDE) ** 2 > _MOST_TRIANGLES:
        got = f"landmarks {longest:.4g} mm apart"
        raise InputError(patches.place, got, "those around one attachment, in the unit stated")
    while _longest_side(points, triangles) > _SIDE:
        points, triangles = igl.upsample(points, triangles)
    return Surface(distances(points, bone_surface).closest, triangles, patches.place)


@np.errstate(over="ignore")  # squares overflow for a point that is infinitely far away
def _longest_side(points: Floats, triangles: Ints) -> float:
    return float(edge_lengths(points[triangles]).max())


def fan(points: Floats) -> Surface:
    """Triangles from the centroid of ``points`` (n, 3) to each two successive ones by angle in their best-fit plane."""
    centre = points.mean(axis=0)
    _, _, axes = np.linalg.svd(points - centre)
    x, y, _ = axes @ (points - centre).T
    ring = np.argsort(np.arctan2(y, x), kind="stable")
    triangles = np.stack([np.full(len(ring), len(points)), ring, np.roll(ring, -1)], axis=1)
    return Surface(np.concatenate([points, centre[None]]), triangles)
