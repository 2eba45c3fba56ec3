"""Contact with bones: the bones around a body, and the law of contact pressure."""

import logging
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from fem_reference.foundations.errors import InputError
from fem_reference.foundations.mesh import Floats, Surface
from fem_reference.geometry.exemption import Exemption
from fem_reference.geometry.rigid_bodies import Obstacle
from fem_reference.geometry.signed_distance import FAR, signed_distances
from fem_reference.geometry.skins import Skin

# The maximum fraction of the unattached surface that may be exempt from contact. More than half of this fraction causes a warning.
_LOST = 0.5
# The minimum half thickness of a bone, in spacings of contact points. A thinner bone could pass between four contact points, at a
# distance of 0.71 spacings from each.
_THINNEST = 0.75
# If an overlap at rest exceeds this fraction of the half thickness of a bone, the direction in which to remove it is not defined.
_MIDDLE = 0.95

log = logging.getLogger(__name__)


@dataclass(frozen=True, eq=False)
class ContactBone:
    """A bone in contact. ``shape``: its distance function at rest; ``pose``: a function from a frame number to a 4 x 4 matrix. Both
    must be picklable.
    """

    name: str
    shape: Obstacle
    pose: Callable[[float], Floats]


@dataclass(frozen=True)
class ContactLaw:
    """The law of contact with bones, with finite sliding.

    ``on``: the name of a region of facets, or a skin. The pressure depends on the gap g, the signed distance to a bone (negative
    inside): it is zero beyond the ``smoothing`` d [mm], ``k (d - g)^2 / (4 d)`` from d to -d, and ``-k g`` below -d. The pressure
    is the slope of an energy per unit rest area that is twice differentiable. ``stiffness``: k [MPa/mm]; under the pressure p a
    surface penetrates by at most p / k.

    ``relaxed``: two frame numbers between which an overlap at rest is removed gradually. At the first frame the overlap causes no
    pressure; from the second frame on it counts in full.

    ``in_situ`` [mm], for a body under tension at rest: points that overlap a bone, or whose gap is at most this distance, touch the
    bone at rest, with the pressure that balances the tension (``effects.in_situ``). Later only changes of their gaps count.

    ``friction``: the coefficient of Coulomb's law, None without friction. A point sticks to the bone by a spring of stiffness k,
    and slides once its traction reaches ``friction`` times the pressure.

    ``parts``: for several bodies solved as one, the name of each body and the range of its points in the skin. There is then one
    force for each body and bone instead of one for each bone.
    """

    on: str | Skin
    stiffness: float
    smoothing: float
    relaxed: tuple[float, float] | None = None
    in_situ: float | None = None
    friction: float | None = None
    parts: tuple[tuple[str, int, int], ...] = ()

    def pressure(self, gap: Floats) -> tuple[Floats, Floats]:
        """The pressure (n,) [MPa] at each ``gap`` (n,) [mm], and its derivative with respect to the gap; NaN if the gap is NaN."""
        return penalty(gap, self.stiffness, self.smoothing)

    def gap(self, pressure: Floats) -> Floats:
        """The gaps (n,) [mm] that cause the ``pressure`` (n,) [MPa], which must not be negative."""
        k, d = self.stiffness, self.smoothing
        return np.where(pressure > k * d, -pressure / k, d - 2 * np.sqrt(d * pressure / k))

    def allowance(self, frame: float) -> float:
        """The fraction of the overlap at rest that is subtracted from the overlap at ``frame``."""
        if self.relaxed is None:
            return float(self.in_situ is not None)
        return remaining(self.relaxed, frame)


def remaining(relaxed: tuple[float, float], frame: float) -> float:
    """The fraction of an overlap at rest that remains at ``frame`` if it is removed between the two frame numbers ``relaxed``."""
    first, last = relaxed
    return float(np.clip((last - frame) / (last - first), 0, 1))


def penalty(gap: Floats, k: float, d: float) -> tuple[Floats, Floats]:
    """The pressure (n,) [MPa] at each ``gap`` (n,) [mm], and its derivative with respect to the gap [MPa/mm].

    ``k``: the stiffness [MPa/mm]; ``d``: the smoothing [mm].
    """
    near = np.where(gap > d, 0.0, d - gap)
    pressure = np.where(gap < -d, -k * gap, k * near**2 / (4 * d))
    return pressure, np.where(gap < -d, -k, -k * near / (2 * d))


def nearest_on_path(bone: ContactBone, starts: Floats, paths: Floats, least: float) -> Floats:
    """The smallest gap (n,) [mm], negative inside, between a ``bone`` in its rest pose and each of n straight paths.

    ``starts`` (n, 3) [mm]: the first points of the paths; ``paths`` (n, 3) [mm]: the vectors from the first to the last points. The
    gap is sampled at intervals that are as long as the last sampled gap allows, and at least ``least`` [mm] long.
    """
    smallest = np.full(len(starts), np.inf)
    lengths = np.linalg.norm(paths, axis=1)
    walked = np.zeros(len(starts))
    going = np.arange(len(starts))
    while len(going):
        shares = walked[going] / np.maximum(lengths[going], least)
        gaps = bone.shape.sample(starts[going] + shares[:, None] * paths[going]).distance
        smallest[going] = np.minimum(smallest[going], gaps)
        # The gradient of a sampled distance has length 1 to within a tenth; beyond its grid, strides are 1 mm long.
        walked[going] += np.where(gaps < FAR, np.maximum(0.9 * np.abs(gaps), least), 1.0)
        going = going[walked[going] < lengths[going]]
    return smallest


def nearest_at_rest(name: str, bone: Obstacle, points: Floats) -> float:
    """The smallest signed distance [mm] of ``points`` (n, 3) to a ``bone`` at rest. ``name``: the name of the bone in messages.

    Raises InputError if a point is so deep inside the bone that no side is nearest.
    """
    nearest, half = float(bone.sample(points).distance.min(initial=np.inf)), bone.half_thickness
    if nearest < -_MIDDLE * half:
        got = f"{-nearest:.3g} mm of overlap with the muscle at rest"
        want = f"less overlap: in the middle of the bone, {half:.3g} mm deep, no side is nearest"
        raise InputError(f'bone "{name}"', got, want)
    return nearest


def check_bone(place: str, surface: Surface, shape: Obstacle, muscle: Surface, apart: float) -> None:
    """Raise InputError for a bone entirely inside the muscle, as no force would push it out, or for a bone too thin for contact
    points with a spacing of ``apart`` [mm].
    """
    if signed_distances(surface.points, muscle).max() < 0:
        raise InputError(place, "a bone entirely inside the muscle", "a bone that is partly outside")
    if not shape.half_thickness >= _THINNEST * apart:
        want = f"{2 * _THINNEST * apart:.2g} mm or more, as contact points are {apart:.2g} mm apart"
        raise InputError(place, f"a bone {2 * shape.half_thickness:.2g} mm thick", want)


def check_exempt(exempt: Exemption, place: str) -> None:
    """Raise InputError if most of the unattached surface is exempt from contact; log a warning if more than a quarter is exempt."""
    got = f"{100 * exempt.lost:.0f} % of the unattached surface without contact (within {exempt.reach:.2g} mm of attachments)"
    if not exempt.lost <= _LOST:
        raise InputError(place, got, f"at most {100 * _LOST:.0f} %: larger or fewer attachments, or no contact effect")
    if exempt.lost > _LOST / 2:
        log.warning("%s: %s", place, got)
