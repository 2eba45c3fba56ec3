"""Error bars of references, compared with the differences from finer solutions. The bars are computed without these solutions."""

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from fem_reference.assessment.error_bars import ErrorBars, Of
from fem_reference.metrics import Measure, described, find

# The finer solution has a mesh of its own; the size of its tetrahedra is this fraction of the size in the reference.
FINER = 0.8
# Statistics whose bars are compared with errors: metric and name.
CLAIMED = tuple(described("claim"))
# Differences below this are rounding [mm or %].
LEAST = 1e-6


@dataclass(frozen=True)
class Claim:
    """The error ``bar`` of a statistic at a ``frame`` of a ``case``, and its ``error``, the difference from the finer solution."""

    case: str
    of: Of
    metric: str
    statistic: str
    frame: int
    bar: float
    error: float


@dataclass(frozen=True)
class Cover:
    """A summary of claims: the ``count`` of claims whose error exceeds rounding, the fraction of these claims whose error is within
    the bar (``share``), and the ``median`` of bar / error.
    """

    count: int
    share: float
    median: float

    @classmethod
    def of(cls, claims: Iterable[Claim]) -> "Cover":
        """The summary of ``claims``; fraction and median are NaN if no error exceeds rounding."""
        known = [claim for claim in claims if claim.error > LEAST]
        if not known:
            return cls(0, np.nan, np.nan)
        ratios = np.array([claim.bar / claim.error for claim in known])
        return cls(len(known), float((ratios >= 1).mean()), float(np.median(ratios)))


@dataclass(frozen=True, eq=False)
class Claims:
    """All ``claims``. By case: the ``sizes`` [mm] of the tetrahedra in the reference and in the finer solution, and the reason for
    ``missing`` claims.
    """

    claims: tuple[Claim, ...]
    sizes: dict[str, tuple[float, float]]
    missing: dict[str, str]


def claimed(
    case: str, of: Of, bars: ErrorBars, reference: tuple[Measure, ...], finer: tuple[Measure, ...]
) -> list[Claim]:
    """The claims of the ``bars`` of a reference. The errors are the differences between the measures of the ``reference`` and the
    measures of the ``finer`` solution.
    """
    found = []
    for metric, statistic in CLAIMED:
        bar = bars.find(of, metric, statistic)
        one, other = (find(measures, metric, statistic) for measures in (reference, finer))
        assert bar is not None  # every statistic of every metric has a bar
        assert one is not None
        assert other is not None
        found += [
            Claim(case, of, metric, statistic, number, float(value), float(error))
            for number, value, error in zip(bars.numbers, bar.values, np.abs(one.values - other.values), strict=True)
        ]
    return found
