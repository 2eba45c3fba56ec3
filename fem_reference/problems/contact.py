"""Contact with rigid bodies: the obstacles of a body, and the law of the contact pressure."""

import logging
from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from fem_reference.foundations.errors import InputError
from fem_reference.foundations.mesh import Floats, Surface
from fem_reference.geometry.exemption import Exemption
from fem_reference.geometry.rigid_bodies import Obstacle
from fem_reference.geometry.signed_distance import FAR, signed_distances
from fem_reference.geometry.skins import Skin

# Of what is not attached of a surface no more than this share may be exempt from contact; half of that is worth a word.
_LOST = 0.5
# Of the spacing of contact points half the thickness of a bone: between four of them, 0.71 of it apart from each, it would pass.
_THINNEST = 0.75

log = logging.getLogger(__name__)


@dataclass(frozen=True, eq=False)
class ContactBone:
    """An obstacle: its ``shape`` in its own rest frame, and the 4 x 4 matrix ``pose`` of a frame number that takes it
    to where it is; both picklable.
    """

    name: str
    shape: Obstacle
    pose: Callable[[float], Floats]


@dataclass(frozen=True)
class ContactLaw:
    """Frictionless contact of bones, with any sliding, on ``on``: the facets of a region, by name, or a skin. The
    pressure depends on the gap g, the signed distance (negative inside): zero beyond ``smoothing`` d [mm],
    ``k (d - g)^2 / (4 d)`` from d to -d, and ``-k g`` deeper: the slope of an energy per rest area, twice differentiable.
    ``stiffness``: k [MPa/mm]; pressed by p, a surface gets p / k deep.

    With ``relaxed``, two frame numbers, a point that is too near at the first of them for no pressure feels as much less depth
    there, and all of its depth from the second on: an overlap at rest is removed gradually.
    """

    on: str | Skin
    stiffness: float
    smoothing: float
    relaxed: tuple[float, float] | None = None

    def pressure(self, gap: Floats) -> tuple[Floats, Floats]:
        """The pressure (n,) [MPa] at gaps (n,) [mm], and its slope in the gap [MPa/mm]; NaN for NaN."""
        k, d = self.stiffness, self.smoothing
        near = np.where(gap > d, 0.0, d - gap)
        pressure = np.where(gap < -d, -k * gap, k * near**2 / (4 * d))
        return pressure, np.where(gap < -d, -k, -k * near / (2 * d))

    def allowance(self, frame: float) -> float:
        """The share of what overlaps at rest that is not felt at ``frame``."""
        if self.relaxed is None:
            return 0.0
        first, last = self.relaxed
        return float(np.clip((last - frame) / (last - first), 0, 1))


def nearest_on_path(bone: ContactBone, starts: Floats, paths: Floats, least: float) -> Floats:
    """The smallest gap to a bone on straight paths, walked in strides that the gap allows without missing anything.

    Parameters
    ----------
    bone
        The body whose distance is sampled, in its rest frame.
    starts, paths
        Where the paths begin and what they add to that, (n, 3) each [mm].
    least
        The shortest stride [mm].

    Returns
    -------
    array (n,)
        Gaps [mm], negative inside.

    """
    smallest = np.full(len(starts), np.inf)
    lengths = np.linalg.norm(paths, axis=1)
    walked = np.zeros(len(starts))
    going = np.arange(len(starts))
    while len(going):
        shares = walked[going] / np.maximum(lengths[going], least)
        gaps = bone.shape.sample(starts[going] + shares[:, None] * paths[going]).distance
        smallest[going] = np.minimum(smallest[going], gaps)
        # The gradient of a sampled distance is a unit vector but for a tenth; beyond its grid strides are short.
        walked[going] += np.where(gaps < FAR, np.maximum(0.9 * np.abs(gaps), least), 1.0)
        going = going[walked[going] < lengths[going]]
    return smallest


def check_outside(bones: Mapping[str, Surface], muscle: Surface) -> None:
    """InputError where a bone, by its place in a scene, is wholly inside the muscle: nothing moves it out."""
    for place, bone in bones.items():
        if signed_distances(bone.points, muscle).max() < 0:
            raise InputError(place, "a bone wholly inside the muscle", "one that is not")


def check_thickness(bones: Mapping[str, Obstacle], apart: float) -> None:
    """InputError where a bone, by its place in a scene, is too thin for contact points that are ``apart`` [mm]."""
    for place, bone in bones.items():
        if not bone.half_thickness >= _THINNEST * apart:
            got = f"a bone {2 * bone.half_thickness:.2g} mm thick"
            want = f"{2 * _THINNEST * apart:.2g} mm or more, as points of contact are {apart:.2g} mm apart"
            raise InputError(place, got, want)


def check_exempt(exempt: Exemption, place: str) -> None:
    """InputError where the greater part of what is not attached is exempt from contact, a warning where much of it is."""
    got = f"attachments within {exempt.reach:.2g} mm of {100 * exempt.lost:.0f} % of what is not attached, where no contact is felt"
    if not exempt.lost <= _LOST:
        raise InputError(place, got, f"at most {100 * _LOST:.0f} %: larger or fewer pieces, or no effect contact")
    if exempt.lost > _LOST / 2:
        log.warning("%s: %s", place, got)
