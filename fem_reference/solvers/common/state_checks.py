"""Whether a state can be a muscle at all: what the fast solvers ask after each frame number, before they go on."""

from dataclasses import dataclass

import numpy as np

from fem_reference.foundations.mesh import Floats, Ints, Surface, diagonal, enclosed_volume
from fem_reference.runs.contents import Status

# A body spread this many times as wide as at rest, or as its attached part, is lost.
_WIDE = 10.0
# So is one of this many times its volume. Flesh keeps its volume within a few percent, and a surface that keeps its dihedral
# angles alone was seen at twice its volume; one blown up by a wrong root or by scaling has no such bound. What the bones draw
# out to n times its length may have n times that.
_LARGE = 5.0


@dataclass(frozen=True)
class Trouble:
    """The status that a state ends a run with, and what is wrong with it."""

    status: Status
    sentence: str


def trouble(points: Floats, rest: Surface, attached: Ints) -> Trouble | None:
    """What is wrong with ``points`` (n, 3) [mm] of a closed surface, with ``attached`` vertices (k,); None if nothing is."""
    lost = np.flatnonzero(~np.isfinite(points).all(axis=1))
    if len(lost):
        return Trouble("diverged", f"the position of {len(lost)} points is not a number (point {lost[0]} for one)")
    wide, at_rest, between = _spread(points), _spread(rest.points), _spread(points[attached])
    if wide > _WIDE * max(at_rest, between):
        return Trouble("diverged", f"the muscle is spread over {wide:.3g} mm, at rest {at_rest:.3g} mm")
    ratio = enclosed_volume(points, rest.triangles) / enclosed_volume(rest.points, rest.triangles)
    if ratio <= 0:
        return Trouble("inverted", "the surface is turned inside out")
    if ratio > _LARGE * max(1, between / at_rest):
        return Trouble("diverged", f"the surface encloses {ratio:.3g} times its volume at rest")
    return None


def _spread(points: Floats) -> float:
    """Diagonal of the box around points [mm], 0 without any."""
    return diagonal(points) if len(points) else 0.0
