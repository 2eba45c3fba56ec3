"""Contact between parts of a body's surface on separate pieces of its mesh (several bodies in one), or of one part with itself."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations
from math import isfinite

import numpy as np

from fem_reference.effects import Effect
from fem_reference.effects.touching import among
from fem_reference.foundations.errors import InputError
from fem_reference.foundations.mesh import Floats, Ints, connected_parts, sorted_corners
from fem_reference.problems.contact import penalty, remaining


@dataclass(frozen=True)
class Touching:
    """Contact, with any sliding, between two parts of the surface of a body, ``one`` and ``other``: regions of its facets, by name.
    The pressure per rest area follows ``ContactLaw`` with ``stiffness`` k [MPa/mm] and ``smoothing`` d [mm], for the gap between
    points of either part and the present surface of the other. Under pressure p the parts overlap by p / k. ``friction``: the
    coefficient of Coulomb's law, as in ``ContactLaw``; None without friction. ``relaxed``: two frame numbers over which an overlap
    at rest is removed, as with bones. If None, an overlap of two parts presses at once, and an overlap of a part with itself only
    after it has opened. ``around``: True if points of either part also touch the skin around the other part, such as
    attached skin; otherwise a point that slides past the rim of the other part ends the run. This skin has no contact points, so
    contact there is half as stiff: the mean traction is half the reported pressure, and half the area counts. ``own_normals``: True
    if the gap is measured along the points' own normals instead of to the nearest place, between two parts without friction: slip
    is counted from the nearest place, and behind a part that touches itself is this part.
    """

    one: str
    other: str
    stiffness: float
    smoothing: float
    friction: float | None = None
    relaxed: tuple[float, float] | None = None
    around: bool = False
    own_normals: bool = False

    @property
    def forces(self) -> tuple[str, str]:
        """The names of the forces on ``one`` and on ``other``, under which a frame reports them."""
        return f"{self.other} on {self.one}", f"{self.one} on {self.other}"

    @property
    def pressure_name(self) -> str:
        """The name under which a frame of several laws reports the greatest pressure of this law."""
        return pressure_name(self.one, self.other)

    def allowance(self, frame: float) -> float:
        """The share of the overlap at rest that is subtracted at ``frame``. For a part with itself it is 1, unless the overlap is
        removed, so that there is no pressure at rest.
        """
        return float(self.one == self.other) if self.relaxed is None else remaining(self.relaxed, frame)

    def pressure(self, gap: Floats) -> tuple[Floats, Floats]:
        """The pressure (n,) [MPa] at gaps (n,) [mm], and its derivative with respect to the gap [MPa/mm]; NaN if the gap is NaN."""
        return penalty(gap, self.stiffness, self.smoothing)


def pressure_name(one: str, other: str) -> str:
    """The name under which a frame of several laws reports the greatest pressure between two parts."""
    return f"touching_pressure of {one} and {other}"


def with_itself(acting: Sequence[Effect], part: str) -> tuple[Touching, ...]:
    """The contact of a ``part`` with itself, if the effects ``acting`` in a single muscle include it."""
    law = among(acting)
    if law is None:
        return ()
    return (Touching(part, part, law.stiffness, law.smoothing, law.friction, own_normals=law.own_normals),)


def check_touching(touching: Sequence[Touching], cells: Ints, facets: Mapping[str, Ints], *, moved: bool) -> None:
    """Raise InputError unless each law has a stiffness and a smoothing, and its two regions of ``facets`` (f, 3 or 4) belong to
    separate pieces of the mesh of ``cells`` (m, k). They may also be the same region, in a body that does not begin ``moved``. No
    pair of facets may be under two laws.
    """
    if not touching:
        return
    piece = connected_parts(np.repeat(cells[:, 0], cells.shape[1]), cells.ravel(), int(cells.max()) + 1)
    for i, law in enumerate(touching):
        for name, value in (("stiffness", law.stiffness), ("smoothing", law.smoothing)):
            if not (isfinite(value) and value > 0):
                raise InputError(f"touching[{i}].{name}", value, "a number above 0")
        if law.own_normals and (law.friction is not None or law.one == law.other):
            got = "True with friction" if law.friction else "True for a part that touches itself"
            raise InputError(f"touching[{i}].own_normals", got, "two parts without friction")
        if law.one != law.other and len(np.intersect1d(piece[facets[law.one]], piece[facets[law.other]])):
            got = f'"{law.one}" and "{law.other}" on one connected piece of the mesh'
            raise InputError(f"touching[{i}]", got, "regions of separate pieces, or one region with itself")
        if law.one == law.other and moved:  # it is unknown which side was in front
            raise InputError(
                "start", f'places, and "{law.one}" that touches itself', "none, as such contact begins at rest"
            )
    _check_pairs(touching, facets, piece)


def _check_pairs(touching: Sequence[Touching], facets: Mapping[str, Ints], piece: Ints) -> None:
    """Raise InputError if a pair of facets, also of skin around a part, is under two laws, whose pressures would add up. ``piece``
    (n,): the number of the piece of the mesh to which each point belongs.
    """
    names = {name for law in touching for name in (law.one, law.other)}
    own = {name: set(sorted_corners(facets[name])) for name in names}
    for (i, law), (j, other) in combinations(enumerate(touching), 2):
        for one, two in ((other.one, other.other), (other.other, other.one)):
            sides = (law.one, one), (law.other, two)
            shared = [bool(own[a] & own[b]) for a, b in sides]
            skins = law.around and other.around and any(shared)
            if all(shared) or (
                skins and all(len(np.intersect1d(piece[facets[a]], piece[facets[b]])) for a, b in sides)
            ):
                got = f'"{other.one}" and "{other.other}" with facets that touch under touching[{i}], too'
                raise InputError(f"touching[{j}]", got, "one law for a pair of facets")
