"""The ends of a muscle's fibres: the attachment that each belongs to, and its distance from that."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from fem_reference.foundations.mesh import Floats, Ints, Polylines, Surface
from fem_reference.foundations.motion import apply
from fem_reference.geometry.distance import distances
from fem_reference.geometry.exemption import Exemption
from fem_reference.problems.setup import AttachedVertices

# An end this far [mm] from its attachment does not reach it; within that the muscle is as good as attached there.
REACHES = 2.0
SIDES = ("first", "last")  # ends of a fibre


@dataclass(frozen=True, eq=False)
class FibreEnds:
    """The first and the last end of k fibres: ``by`` (k, 2), the index of the attachment in ``attached`` that each belongs to, and
    its ``distance`` (k, 2) [mm] from the attached area at rest.
    """

    attached: tuple[AttachedVertices, ...]
    by: Ints
    distance: Floats

    def taken(self, rest: Floats, frame: float) -> Floats:
        """The places (k, 2, 3) [mm] to which the bones take the ends from ``rest`` (k, 2, 3) [mm], by a ``frame``."""
        found = np.array(rest)
        for i, one in enumerate(self.attached):
            found[self.by == i] = apply(one.bone.pose(frame), rest[self.by == i])
        return found

    def named(self, fibre: int, side: int) -> str:
        """An end in words."""
        return f"{SIDES[side]} end of fibre {fibre}, of {self.attached[self.by[fibre, side]].attachment}"

    @cached_property
    def facts(self) -> dict[str, float | str]:
        """The number of ends, and of those that do not reach their attachment the number, the worst, and all by name."""
        beyond = np.argwhere(self.distance > REACHES)
        found: dict[str, float | str] = {
            "fibre_ends": float(self.by.size),
            "fibre_ends_beyond_2_mm": float(len(beyond)),
        }
        if len(beyond):
            worst = np.unravel_index(np.argmax(self.distance), self.by.shape)
            found["fibre_end_farthest_mm"] = float(self.distance[worst])
            names = (f"{self.named(*end)}: {self.distance[*end]:.1f} mm" for end in beyond.tolist())
            found["fibre_ends_not_attached"] = "; ".join(names)
        return found


def ends_of(lines: Polylines, points: Floats | None = None) -> Floats:
    """The first and the last points (k, 2, 3) of ``lines`` at rest, or where their ``points`` (n, 3) are."""
    at = lines.points if points is None else points
    return np.stack([at[lines.offsets[:-1]], at[lines.offsets[1:] - 1]], axis=1)


def attached_ends(attached: tuple[AttachedVertices, ...], exempt: Exemption, fibres: Polylines) -> FibreEnds | None:
    """The ends of the ``fibres`` of a muscle by its attachments and the parts that they exempt from contact, None without any.

    A fibre runs from bone to bone: of the pairs of attachments to two bones, its ends belong to that with the least sum of
    distances, so that a short fibre beside its origin does not belong to the origin twice. Where one bone has all attachments,
    each end belongs to the nearest.
    """
    if not attached:
        return None
    ends = ends_of(fibres)
    away = np.stack([_distances(exempt, i, ends) for i in range(len(attached))], axis=2)  # (k, 2, a)
    bones = np.array([one.bone.name for one in attached])
    sums = away[:, 0, :, None] + away[:, 1, None, :]
    if len(np.unique(bones)) > 1:
        sums = np.where(bones[:, None] == bones, np.inf, sums)
    pairs = np.argmin(sums.reshape(len(ends), -1), axis=1)
    by = np.stack(np.divmod(pairs, len(bones)), axis=1)
    return FibreEnds(attached, by, np.take_along_axis(away, by[:, :, None], axis=2)[:, :, 0])


def _distances(exempt: Exemption, i: int, ends: Floats) -> Floats:
    """Distances (k, 2) [mm] of ``ends`` (k, 2, 3) from the area of attachment ``i``."""
    part = exempt.part[exempt.by == i]
    area = Surface(part.reshape(-1, 3), np.arange(3 * len(part)).reshape(-1, 3))
    return distances(ends.reshape(-1, 3), area).distance.reshape(ends.shape[:2])
