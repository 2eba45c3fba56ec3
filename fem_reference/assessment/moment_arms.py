"""Comparison of moment arms of fibres with published moment arms.

Moment arms follow from a polynomial fitted to length against angle. They are compared by the fraction of poses in which a published
arm is within the range of the fibres, or by the overlap of two ranges.
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.polynomial import Polynomial

from fem_reference.assessment.experiments import Kind
from fem_reference.foundations.errors import InputError
from fem_reference.foundations.mesh import Floats

# As in Modenese and Kohout 2020, doi 10.1007/s10439-020-02490-4.
DEGREE, STEP = 4, 2.0


@dataclass(frozen=True, eq=False)
class ArmRange:
    """The minimum and the maximum moment arm, ``low`` and ``high`` (a,) [mm], of a muscle's fibres at ``angles`` (a,) [deg]."""

    angles: Floats
    low: Floats
    high: Floats

    def at(self, angles: Floats) -> "ArmRange":
        """The range at other ``angles`` (b,) [deg], by linear interpolation; NaN beyond the first and the last known angle."""
        within = (angles >= self.angles.min()) & (angles <= self.angles.max())
        low, high = (np.interp(angles, self.angles, side) for side in (self.low, self.high))
        return ArmRange(angles, np.where(within, low, np.nan), np.where(within, high, np.nan))


def poses(angles: Floats) -> Floats:
    """The angles (a,) [deg] that are multiples of 2 degrees and within the range of the ``angles`` (f,) [deg] of the frames."""
    first, last = np.ceil(angles.min() / STEP - 1e-9), np.floor(angles.max() / STEP + 1e-9)
    return np.asarray(STEP * np.arange(first, last + 1) + 0.0)  # no -0


def fitted_arms(angles: Floats, lengths: Floats, at: Floats) -> Floats:
    """The moment arms ``-dl/dangle`` (a, k) [mm] of k fibres at the angles ``at`` (a,) [deg], from the quartic polynomials that
    best fit their ``lengths`` (f, k) [mm] at ``angles`` (f,) [deg]. Raises InputError if there are too few different angles.
    """
    if len(np.unique(np.round(angles, 9))) <= DEGREE:
        raise InputError("angles", f"{len(np.unique(angles))} different angles", f"more than {DEGREE}")
    slopes = [Polynomial.fit(angles, length, DEGREE).deriv()(at) for length in lengths.T]
    return np.asarray(-np.stack(slopes, axis=1) * 180 / np.pi)


def range_of(angles: Floats, arms: Floats) -> ArmRange:
    """The range of moment ``arms`` (a, k) [mm] over the k fibres at ``angles`` (a,) [deg]."""
    return ArmRange(angles, arms.min(axis=1), arms.max(axis=1))


def share_inside(curve: Floats, found: ArmRange) -> float:
    """The fraction of poses in which the ``curve`` (a,) [mm] is in the range ``found``, out of the poses in which the curve is
    known; NaN if it is never known. A range of NaN contains nothing.
    """
    known = np.isfinite(curve)
    if not known.any():
        return float("nan")
    inside = (found.low <= curve) & (curve <= found.high)
    return float(inside[known].mean())


def overlap(found: ArmRange, published: ArmRange) -> float:
    """The fraction of the ``published`` range that ``found`` covers, averaged over the poses; NaN without a published range."""
    known = np.isfinite(published.low) & np.isfinite(published.high)
    if not known.any():
        return float("nan")
    common = np.minimum(found.high, published.high) - np.maximum(found.low, published.low)
    covered = np.nan_to_num(np.maximum(common, 0.0)) / (published.high - published.low)
    return float(covered[known].mean())


@dataclass(frozen=True, eq=False)
class ArmsBeside:
    """Moment arms of the fibres of a muscle in a run of ``case``, compared with the published curve or range of an ``experiment``.

    ``found``: the range over the fibres at its angles (a,) [deg]. ``middle`` (a,) [mm]: the mean over the fibres. ``published``:
    the published range at the same angles; for a curve both ends are equal. ``kind``: the kind of the experiment. ``sense``: the
    direction of rotation for which moment arms are positive. ``setting``: the resolution of the run. ``coarser`` [mm]: the maximum
    change, over the poses, that larger tetrahedra cause in the mean moment arm.
    """

    case: str
    muscle: str
    sense: str
    experiment: str
    setting: str
    found: ArmRange
    middle: Floats
    published: ArmRange
    coarser: float
    kind: Kind

    @property
    def is_curve(self) -> bool:
        """True if a single curve was published instead of a range."""
        return bool(np.array_equal(self.published.low, self.published.high, equal_nan=True))

    @property
    def share(self) -> float:
        """The fraction of poses in which a published curve is inside the fibres' range; for a published range the mean overlap."""
        return share_inside(self.published.low, self.found) if self.is_curve else overlap(self.found, self.published)

    @property
    def bias(self) -> float:
        """The mean [mm], over known poses, of the fibres' mean moment arm minus the published arm, or the centre of the published
        range; NaN without a known pose.
        """
        return float(self._off.mean()) if self._off.size else float("nan")

    @property
    def scatter(self) -> float:
        """The standard deviation [mm], over known poses, of the difference in :attr:`bias`; NaN without a known pose."""
        return float(self._off.std()) if self._off.size else float("nan")

    @property
    def known(self) -> int:
        """The number of poses with a known published moment arm; :attr:`share`, bias and scatter are taken over these poses."""
        return int(np.isfinite(self._centre).sum())

    def between(self, first: float, last: float) -> "ArmsBeside":
        """The same comparison, restricted to poses from the ``first`` to the ``last`` angle [deg]."""
        here = (self.found.angles >= first) & (self.found.angles <= last)
        at = self.found.angles[here]
        return replace(self, found=self.found.at(at), middle=self.middle[here], published=self.published.at(at))

    @property
    def _centre(self) -> Floats:
        return np.asarray((self.published.low + self.published.high) / 2)

    @property
    def _off(self) -> Floats:
        return np.asarray((self.middle - self._centre)[np.isfinite(self._centre)])
