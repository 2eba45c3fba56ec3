"""Bands of results in each frame for varied parameters: from a surrogate of the runs if it is accurate, otherwise from the runs."""

import math
from dataclasses import dataclass, replace

import numpy as np

from fem_reference.assessment import gaussian_process
from fem_reference.assessment.gaussian_process import GaussianProcess
from fem_reference.assessment.uncertainty import Band, Parameter
from fem_reference.foundations.mesh import Floats

# The maximum error of a surrogate that may be used, as a fraction of the variance of the results.
WORST = 0.05
# The maximum fraction of runs without a result. If more were missing, they might all lie beyond the 5th or the 95th percentile.
MISSING = 0.05
# The minimum number of runs for percentiles without a surrogate: the 5th and the 95th percentile must lie between values of runs.
FEWEST = 20
PERCENTILES = (0.05, 0.5, 0.95)
_SAMPLES = 15  # the base-2 logarithm of the number of samples
_SHARE = 1e-6  # the maximum fraction of a field's variance in the principal components that are neglected


@dataclass(frozen=True, eq=False)
class Design:
    """A design of experiments: the ``parameters``, the number of requested runs (``wanted``), and the ``points`` (n, d) of the runs
    that have results, with coordinates from -1 to 1.
    """

    parameters: tuple[Parameter, ...]
    points: Floats
    wanted: int

    @property
    def refused(self) -> str:
        """The reason to refuse a band, if too few runs have results; empty if there are enough."""
        made, variables = len(self.points), self.points.shape[1]
        if made < 2 * (variables + 1):
            return f"{made} runs have results, but {variables} parameters need at least {2 * (variables + 1)}"
        if self.wanted - made > MISSING * self.wanted:
            lost = f"{self.wanted - made} of {self.wanted} runs have no result"
            return f"{lost}: they might all lie beyond the 5th or the 95th percentile"
        return ""


def sampled(variables: int, runs: int, seed: int) -> Floats:
    """Points (runs, variables) of a Latin hypercube from -1 to 1: each variable has one value in each of ``runs`` equal bins."""
    from scipy.stats import qmc  # imported here, as this takes half a second

    return np.asarray(2 * qmc.LatinHypercube(variables, rng=np.random.default_rng(seed)).random(runs) - 1)


def of_values(band: Band, design: Design, values: Floats) -> Band:
    """The ``band`` with percentiles of the ``values`` (n, f) of the runs, in the frames in which the nominal result is a number."""
    defined = np.isfinite(band.nominal)
    known = values[:, defined]
    refused = design.refused or _not_numbers(known)
    if refused:
        return replace(band, refused=refused)
    surrogate = gaussian_process.fit(design.points, known)
    if surrogate is None:
        return _filled(replace(band, by="runs"), defined, np.repeat(known[:1], 3, axis=0))
    return _banded(band, design, surrogate, defined, known, surrogate(_samples(design)))


def of_field(band: Band, design: Design, products: Floats) -> Band:
    """The ``band`` of the weighted root mean square of a field.

    ``products`` (f, n, n): for each frame, the inner products of the weighted fields of each pair of runs. The surrogate describes
    the principal components of the field, because the square root is not a smooth function of the parameters.
    """
    if refused := design.refused or _not_numbers(products):
        return replace(band, refused=refused)
    runs = np.sqrt(np.maximum(np.einsum("fii->if", products), 0.0))
    values, vectors = np.linalg.eigh(products.sum(axis=0))
    kept = values > _SHARE * max(values.sum(), 0.0) / len(values)
    scales = np.sqrt(values[kept])
    surrogate = gaussian_process.fit(design.points, vectors[:, kept] * scales) if kept.any() else None
    every = np.isfinite(band.nominal)
    if surrogate is None:
        return _filled(replace(band, by="runs"), every, np.repeat(runs[:1], 3, axis=0))
    modes = vectors[:, kept] / scales
    shapes = np.einsum("ia,fij,jb->fab", modes, products, modes)
    found = surrogate(_samples(design))
    squares = np.stack([((found @ shape) * found).sum(axis=1) for shape in shapes], axis=1)
    return _banded(band, design, surrogate, every, runs, np.sqrt(np.maximum(squares, 0.0)))


def _banded(
    band: Band, design: Design, surrogate: GaussianProcess, defined: Floats, runs: Floats, predicted: Floats
) -> Band:
    """The ``band`` with percentiles from the values ``predicted`` (s, f) by a surrogate or, if the error of the surrogate is too
    large, from the values of the ``runs`` (n, f).
    """
    band = replace(band, error=surrogate.error)
    if surrogate.error <= WORST:
        keys = [one.key for one in design.parameters]
        first, total = (dict(zip(keys, map(float, one), strict=True)) for one in (surrogate.first, surrogate.total))
        found = np.quantile(predicted, PERCENTILES, axis=0)
        return _filled(replace(band, by="process", first=first, total=total), defined, found)
    missed = f"the surrogate misses {100 * surrogate.error:.0f} % of the variance at runs that it was not fitted to"
    why = f"{missed}, more than {100 * WORST:.0f} %"
    if len(runs) < FEWEST:
        return replace(
            band, unreliable=why, refused=f"{why}, and {len(runs)} runs are too few for percentiles without it"
        )
    return _filled(replace(band, by="runs", unreliable=why), defined, np.quantile(runs, PERCENTILES, axis=0))


def _filled(band: Band, defined: Floats, found: Floats) -> Band:
    """The ``band`` with the percentiles ``found`` (3, k) in the ``defined`` frames, and NaN in all other frames."""
    whole = np.full((3, len(band.nominal)), math.nan)
    whole[:, defined] = found
    return replace(band, low=whole[0], median=whole[1], high=whole[2])


def _samples(design: Design) -> Floats:
    """Points (s, d), with coordinates from -1 to 1, at which a surrogate is evaluated."""
    from scipy.stats import qmc

    return np.asarray(2 * qmc.Sobol(len(design.parameters), rng=np.random.default_rng(0)).random_base2(_SAMPLES) - 1)


def _not_numbers(values: Floats) -> str:
    """The reason to refuse ``values`` if some of them are not finite; empty if all are finite."""
    bad = int((~np.isfinite(values)).sum())
    return f"{bad} values of runs are not numbers" if bad else ""
