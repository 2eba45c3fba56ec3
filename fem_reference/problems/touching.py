"""Contact between parts of a body's surface on separate pieces of its mesh (several bodies in one), or of a part with itself."""

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
    """A law of contact, with finite sliding, between two parts of the surface of a body.

    ``one``, ``other``: the names of the two parts among the regions of facets; the same name for contact of a part with itself. The
    pressure per unit rest area follows ``ContactLaw`` with ``stiffness`` k [MPa/mm] and ``smoothing`` d [mm]. The gap is measured
    between points of each part and the present surface of the other part. Under the pressure p the overlap is at most p / k.
    ``friction``: the coefficient of Coulomb's law, as in ``ContactLaw``; None without friction.

    ``relaxed``: two frame numbers between which an overlap at rest is removed, as with bones. If it is None, an overlap of two
    parts causes pressure at once; an overlap of a part with itself causes pressure only if it grows, or closes again after opening.

    ``around``: True if points of each part also touch the skin around the other part, such as attached skin. Otherwise a point that
    slides past the rim of the other part ends the run. The skin around a part has no contact points, so contact there is half as
    stiff: the mean traction is half the reported pressure, and half the area counts.

    ``own_normals``: True if the gap is measured along the normals of the points instead of to the nearest point. This requires two
    different parts, because a line along a normal of a part that touches itself also meets this part behind the point. It excludes
    friction, because slip is measured from the nearest point.
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
        """The names under which frames report the force on ``one`` and the force on ``other``."""
        return f"{self.other} on {self.one}", f"{self.one} on {self.other}"

    @property
    def pressure_name(self) -> str:
        """The name under which frames report the maximum pressure of this law, if there are several laws."""
        return pressure_name(self.one, self.other)

    def allowance(self, frame: float) -> float:
        """The fraction of the overlap at rest that is subtracted from the overlap at ``frame``. Unless the overlap is removed
        gradually, it is 1 for a part that touches itself, so that there is no pressure at rest, and 0 for two parts.
        """
        return float(self.one == self.other) if self.relaxed is None else remaining(self.relaxed, frame)

    def pressure(self, gap: Floats) -> tuple[Floats, Floats]:
        """The pressure (n,) [MPa] at each ``gap`` (n,) [mm], and its derivative with respect to the gap; NaN if the gap is NaN."""
        return penalty(gap, self.stiffness, self.smoothing)


def pressure_name(one: str, other: str) -> str:
    """The name under which frames report the maximum pressure between two parts, if there are several laws."""
    return f"touching_pressure of {one} and {other}"


def with_itself(acting: Sequence[Effect], part: str) -> tuple[Touching, ...]:
    """The law of contact of a ``part`` with itself, if it is among the effects ``acting`` on a single muscle; otherwise empty."""
    law = among(acting)
    if law is None:
        return ()
    return (Touching(part, part, law.stiffness, law.smoothing, law.friction, own_normals=law.own_normals),)


def check_touching(touching: Sequence[Touching], cells: Ints, facets: Mapping[str, Ints], *, moved: bool) -> None:
    """Raise InputError unless all laws ``touching`` are valid.

    The stiffness and the smoothing of a law must be positive. Its two parts, regions of ``facets`` (f, 3 or 4), must belong to
    separate pieces of the mesh with ``cells`` (m, k), or be one region of a body that starts at rest (not ``moved``). No pair of
    facets may be subject to two laws.
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
                "start", f'positions, and "{law.one}" that touches itself', "none, as such contact begins at rest"
            )
    _check_pairs(touching, facets, piece)


def _check_pairs(touching: Sequence[Touching], facets: Mapping[str, Ints], piece: Ints) -> None:
    """Raise InputError if a pair of facets is subject to two laws, whose pressures would add up. Facets of the skin around a part
    are included. ``piece`` (n,): the number of the connected piece of the mesh to which each point belongs.
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
                got = f'"{other.one}" and "{other.other}" with facets that also touch under touching[{i}]'
                raise InputError(f"touching[{j}]", got, "one law for a pair of facets")
