"""The ends of a muscle's fibres: their attachments, their distances from the attachments, and the areas that they cover."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.spatial import cKDTree

from fem_reference.foundations.mesh import Bools, Floats, Ints, Polylines, Surface, corner_areas
from fem_reference.foundations.motion import apply
from fem_reference.geometry.distance import Distances, distances
from fem_reference.geometry.exemption import Exemption
from fem_reference.problems.setup import AttachedVertices

# The maximum distance [mm] at which an end counts as reaching its attachment. This close to it, the muscle practically moves with
# the bone.
REACHES = 2.0
SIDES = ("first", "last")  # the ends of a fibre


@dataclass(frozen=True, eq=False)
class FibreEnds:
    """The first and the last end of each of k fibres.

    ``attached``: the attachments of the muscle. ``by`` (k, 2): the index in ``attached`` of the attachment to which each end
    belongs. ``distance`` (k, 2) [mm]: the distance of each end from its attached area at rest; ``closest`` (k, 2, 3) [mm]: the
    closest point of this area. ``covered``: for each attachment, the fraction of its area that is within the mean fibre spacing,
    sqrt(area / k), of an end that belongs to it. An end that does not reach its attachment continues as the tendon of the
    attachment, if the attachment has one.
    """

    attached: tuple[AttachedVertices, ...]
    by: Ints
    distance: Floats
    closest: Floats
    covered: Floats

    @cached_property
    def tendons(self) -> Floats:
        """The points (k, 2, 3) [mm] of bones at rest to which ends continue as tendons; NaN for an end without a tendon."""
        points = np.array([np.full(3, np.nan) if one.tendon is None else one.tendon for one in self.attached])
        return np.where((self.distance > REACHES)[:, :, None], points[self.by], np.nan)

    @property
    def beside(self) -> Bools:
        """Mask (k, 2) of the ends that neither reach their attachment nor continue as a tendon."""
        return np.asarray((self.distance > REACHES) & np.isnan(self.tendons[:, :, 0]))

    def taken(self, rest: Floats, frame: float) -> Floats:
        """The positions (k, 2, 3) [mm] at a ``frame`` of points that move with the bones of the ends.

        ``rest`` (k, 2, 3) [mm]: the rest positions of these points.
        """
        found = np.array(rest)
        for i, one in enumerate(self.attached):
            found[self.by == i] = apply(one.bone.pose(frame), rest[self.by == i])
        return found

    def off(self, ends: Floats, rest: Floats, frame: float) -> Floats:
        """The distances (k, 2) [mm] between ``ends`` (k, 2, 3) [mm] at a ``frame`` and the positions that they would have if they
        moved with their bones from ``rest`` (k, 2, 3) [mm].
        """
        return np.asarray(np.linalg.norm(ends - self.taken(rest, frame), axis=2))

    def beyond(self, ends: Floats, frame: float) -> Floats:
        """The lengths (k,) [mm] of the straight tendons of each fibre at a ``frame``, summed over both ends; 0 without tendons.

        ``ends`` (k, 2, 3) [mm]: the ends of the fibres at this frame.
        """
        lengths = np.linalg.norm(self.taken(self.tendons, frame) - ends, axis=2)
        return np.asarray(np.where(np.isnan(self.tendons[:, :, 0]), 0.0, lengths).sum(axis=1))

    def named(self, fibre: int, side: int) -> str:
        """A description of the end on a ``side`` (0 or 1) of a ``fibre``, for messages."""
        how = (
            "which continues to {} as a tendon" if np.isfinite(self.tendons[fibre, side, 0]) else "which belongs to {}"
        )
        return f"{SIDES[side]} end of fibre {fibre}, {how.format(self.attached[self.by[fibre, side]].attachment)}"

    @cached_property
    def facts(self) -> dict[str, float | str]:
        """Facts about the ends, by name: the number of ends, the ends with a tendon, the ends that neither reach their attachment
        nor continue as a tendon, and the covered area of each attachment [%].
        """
        tied = np.isfinite(self.tendons[:, :, 0])
        found: dict[str, float | str] = {
            "fibre_ends": float(self.by.size),
            "fibre_ends_beside": float(self.beside.sum()),
        }
        for one, covered in zip(self.attached, self.covered, strict=True):
            found[f"{one.attachment}_covered_percent"] = 100 * float(covered)
        if tied.any():
            found |= {"fibre_ends_continued": float(tied.sum()), "fibre_ends_continued_by": self._words(tied)}
        if self.beside.any():
            found["fibre_end_farthest_mm"] = float(self.distance[self.beside].max())
            found["fibre_ends_not_attached"] = self._words(self.beside)
        return found

    def _words(self, mask: Bools) -> str:
        """The ends in a ``mask`` (k, 2) in words, each with its distance from its attached area."""
        named = ((self.named(*end), self.distance[*end]) for end in np.argwhere(mask).tolist())
        return "; ".join(f"{name}: {far:.1f} mm from the attached area" for name, far in named)


def ends_of(lines: Polylines, points: Floats | None = None) -> Floats:
    """The first and the last point (k, 2, 3) of each of the ``lines``, at rest or with their ``points`` (n, 3) at another frame."""
    at = lines.points if points is None else points
    return np.stack([at[lines.offsets[:-1]], at[lines.offsets[1:] - 1]], axis=1)


def facts_of(lines: Polylines, ends: FibreEnds | None) -> dict[str, float | str]:
    """Facts about fibres: the mean length [mm] of ``lines`` at rest, including the straight tendons of their ``ends``, and the
    facts about these ends.
    """
    if ends is None:
        return {"fibre_length_mean_mm": float(lines.lengths().mean())}
    tendons = np.linalg.norm(ends.tendons - ends_of(lines), axis=2)
    return {"fibre_length_mean_mm": float((lines.lengths() + np.nansum(tendons, axis=1)).mean())} | ends.facts


def attached_ends(attached: tuple[AttachedVertices, ...], exempt: Exemption, fibres: Polylines) -> FibreEnds | None:
    """The ends of the ``fibres`` of a muscle and their attachments; None without attachments. ``exempt``: the attached areas.

    A fibre is assumed to run from bone to bone: its ends belong to the pair of attachments, on two bones, with the smallest sum of
    distances. The two ends of a short fibre near its origin therefore do not both belong to the origin. If all attachments are on
    one bone, each end belongs to the nearest attachment.
    """
    if not attached:
        return None
    ends = ends_of(fibres)
    nearest = [_nearest(exempt, i, ends) for i in range(len(attached))]
    away = np.stack([one.distance for one in nearest], axis=1).reshape(len(ends), 2, -1)
    closest = np.stack([one.closest for one in nearest], axis=1).reshape(len(ends), 2, -1, 3)
    bones = np.array([one.bone.name for one in attached])
    sums = away[:, 0, :, None] + away[:, 1, None, :]
    if len(np.unique(bones)) > 1:
        sums = np.where(bones[:, None] == bones, np.inf, sums)
    pairs = np.argmin(sums.reshape(len(ends), -1), axis=1)
    by = np.stack(np.divmod(pairs, len(bones)), axis=1)
    fibre, side = np.indices(by.shape)
    covered = np.array([_covered(exempt.part[exempt.by == i], ends[by == i], len(ends)) for i in range(len(attached))])
    return FibreEnds(attached, by, away[fibre, side, by], closest[fibre, side, by], covered)


def completed(lines: Polylines, ends: FibreEnds) -> Polylines:
    """The ``lines``, in which each end that misses its attachment is extended straight to the closest point of the attachment.

    The extension has steps of at most 2 mm. It may leave the muscle; the caller moves its points back inside.
    """
    parts = []
    for i, (first, last) in enumerate(ends.beside):
        line = lines.points[lines.offsets[i] : lines.offsets[i + 1]]
        before = _steps(line[0], ends.closest[i, 0])[::-1] if first else line[:0]
        after = _steps(line[-1], ends.closest[i, 1]) if last else line[:0]
        parts.append(np.concatenate([before, line, after]))
    return Polylines(np.concatenate(parts), np.cumsum([0, *map(len, parts)]))


def _steps(start: Floats, end: Floats) -> Floats:
    """Evenly spaced points (n, 3) [mm] from ``start``, which is not included, to ``end``."""
    return np.linspace(start, end, int(np.ceil(np.linalg.norm(end - start) / REACHES)) + 1)[1:]


def _covered(part: Floats, ends: Floats, fibres: int) -> float:
    """The fraction of the area of the triangles ``part`` (r, 3, 3) that is covered by ``ends`` (m, 3). A triangle is covered if
    its centroid is within the mean spacing of the fibres from an end. ``fibres``: the number of fibres.
    """
    areas = corner_areas(part)
    if len(ends) == 0 or not areas.sum():
        return 0.0
    away, _ = cKDTree(ends).query(part.mean(axis=1))
    return float(areas[away <= np.sqrt(areas.sum() / fibres)].sum() / areas.sum())


def _nearest(exempt: Exemption, i: int, ends: Floats) -> Distances:
    """The distances (2 k,) of all ``ends`` (k, 2, 3) from the area of attachment ``i``, and the closest points of this area."""
    part = exempt.part[exempt.by == i]
    return distances(ends.reshape(-1, 3), Surface(part.reshape(-1, 3), np.arange(3 * len(part)).reshape(-1, 3)))
