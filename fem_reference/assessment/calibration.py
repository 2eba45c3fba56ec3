"""Least-squares fits of parameters of a case to measurements, with confidence intervals and a test for undetermined parameters."""

import math
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from scipy import stats
from scipy.optimize import least_squares

from fem_reference.assessment.judge import in_unit
from fem_reference.assessment.uncertainty import Failure, Parameter
from fem_reference.foundations.errors import InputError
from fem_reference.foundations.mesh import Floats
from fem_reference.io import files
from fem_reference.io.texts import plain

COLUMNS = ("frame", "quantity", "value", "unit", "sd")
CONFIDENCE = 0.95
# Fractions of a parameter's range: the step of finite differences, and the distance from an end of the range within which a value
# counts as being at this end.
_STEP, _AT = 1e-3, 1e-3
# Two estimates whose errors are correlated by more than this are reported as a pair.
_CORRELATED = 0.95
# A combination of parameters is undetermined if its singular value is below this fraction of the largest.
_NOTHING = 1e-6
_WANT = f"a CSV file whose first row is {','.join(COLUMNS)}"
# A function that evaluates the model at several points (d,), whose coordinates are fractions of the ranges of the parameters. For
# each point it returns the values (m,) of the measured quantities, or None if the run has no result.
Forward = Callable[[Sequence[Floats]], Sequence[Floats | None]]
# The maximum number of evaluations per parameter, not counting finite differences.
_MOST = 50
# The model fits the data if the root mean square residual is at most this many standard deviations of the data.
FOLLOWED = 2.0
_ENDED = "a run that the fit needs has no result"


@dataclass(frozen=True)
class Measurement:
    """A measurement: the ``value`` of a ``quantity`` and its standard deviation ``sd`` in ``unit``; ``place``: the file and row."""

    frame: int
    quantity: str
    value: float
    unit: str
    sd: float
    place: str


@dataclass(frozen=True)
class Estimate:
    """The fitted ``value`` of a parameter, in the unit of ``parameter``.

    ``low`` and ``high``: the ends of the confidence interval, infinite if the measurements do not determine the parameter. ``at``:
    the end of the allowed range at which the value lies, ``"low"`` or ``"high"``; otherwise empty.
    """

    parameter: Parameter
    value: float
    low: float
    high: float
    at: str = ""

    @property
    def is_known(self) -> bool:
        """True if the confidence interval is narrower than the allowed range."""
        return self.high - self.low < self.parameter.high - self.parameter.low


@dataclass(frozen=True)
class Calibration:
    """The result of a fit: the ``estimates`` of the parameters of a case, the measurements (``rows``) and the ``fitted`` values.

    ``scatter``: the root mean square residual per degree of freedom, in standard deviations of the data; it is near 1 if model
    and data agree. ``singular``: the singular values of the matrix of sensitivities, in standard deviations per range. ``pairs``:
    for each pair of parameters with correlated errors, both titles and the correlation. ``runs``: the number of requested runs.
    ``converged``: True if no further step reduces the residuals. ``failures``: the failed runs. ``ended``: the reason why the fit
    could not continue and has no intervals; otherwise empty.
    """

    case: str
    estimates: tuple[Estimate, ...]
    rows: tuple[Measurement, ...]
    fitted: tuple[float, ...]
    scatter: float
    singular: tuple[float, ...]
    pairs: tuple[tuple[str, str, float], ...]
    runs: int
    converged: bool = False
    failures: tuple[Failure, ...] = ()
    ended: str = ""

    @property
    def is_followed(self) -> bool:
        """True if the root mean square residual is at most ``FOLLOWED`` standard deviations of the data."""
        return self.scatter <= FOLLOWED

    @property
    def holds(self) -> bool:
        """True if the fit has converged, the model fits the data, and each estimate is determined and lies inside its range."""
        return self.converged and self.is_followed and all(one.is_known and not one.at for one in self.estimates)


def read(path: Path, units: Callable[[str, str], str]) -> tuple[Measurement, ...]:
    """The measurements in a CSV file. ``units(quantity, place)``: a function that returns the unit of a quantity, or raises
    InputError if the quantity has none.
    """
    head, *lines = files.read_rows(path) or [[]]
    if tuple(one.strip() for one in head) != COLUMNS:
        raise InputError(path, f'the first row "{",".join(head)}"', _WANT)
    return tuple(_row(line, f"{path}: row {i}", units) for i, line in enumerate(lines, start=2))


def _row(line: list[str], place: str, units: Callable[[str, str], str]) -> Measurement:
    if len(line) != len(COLUMNS):
        raise InputError(place, f"{len(line)} entries", f"{len(COLUMNS)}: {', '.join(COLUMNS)}")
    frame, quantity, value, unit, sd = (one.strip() for one in line)
    if not frame.isdecimal():
        raise InputError(f"{place}: frame", f'"{frame}"', "a frame number")
    own = units(quantity, f"{place}: quantity")
    numbers = []
    for name, text in (("value", value), ("sd", sd)):
        try:
            numbers.append(in_unit(f"{text} {unit}".strip(), own))
        except ValueError as error:
            raise InputError(
                f"{place}: {name}", f'"{text} {unit}"', f"a number with a unit like {own}: {error}"
            ) from error
    if not numbers[1] > 0:
        raise InputError(f"{place}: sd", f'"{sd}"', "more than 0: a measurement has a standard deviation")
    return Measurement(int(frame), quantity, numbers[0], own, numbers[1], place)


class _NoAnswerError(Exception):
    """Raised if a point that the fit needs has no result."""


class _Residuals:
    """Differences between runs and measurements, in standard deviations. Each point is evaluated only once."""

    def __init__(self, forward: Forward, rows: Sequence[Measurement]) -> None:
        self.forward, self.known = forward, dict[bytes, Floats]()
        self.values, self.deviations = (np.array([getattr(row, name) for row in rows]) for name in ("value", "sd"))

    def at(self, points: Sequence[Floats]) -> list[Floats]:
        """The residuals (m,) at each of the ``points``, infinite for a point without a result."""
        asked = [point for point in points if point.tobytes() not in self.known]
        for point, found in zip(asked, self.forward(asked), strict=True):
            lost = np.full(len(self.values), np.inf)
            left = lost if found is None else _finite((found - self.values) / self.deviations)
            self.known[point.tobytes()] = left
        return [self.known[point.tobytes()] for point in points]

    def slopes(self, point: Floats, *_: Any) -> Floats:
        """Finite differences (m, d) of the residuals at a ``point``, with steps towards the interior of the ranges."""
        steps = np.where(point < 0.5, _STEP, -_STEP)
        at, *moved = self.at([point, *(point + np.diag(steps))])
        if not np.isfinite([at, *moved]).all():
            raise _NoAnswerError
        return np.stack([(one - at) / step for one, step in zip(moved, steps, strict=True)], axis=1)

    def best(self) -> tuple[Floats, Floats] | None:
        """The evaluated point with the smallest sum of squared residuals, and its residuals; None if no point has a result."""
        points = [(np.frombuffer(key), left) for key, left in self.known.items() if np.isfinite(left).all()]
        return min(points, key=lambda one: float(one[1] @ one[1])) if points else None


def fit(forward: Forward, parameters: Sequence[Parameter], rows: Sequence[Measurement], case: str) -> Calibration:
    """Fit the parameters, within their ranges, so that the values of ``forward`` are nearest to the measurements (``rows``),
    with distances in standard deviations.

    The fit starts from the values of the case, and retreats from a point without a result. If the starting point, or a point at
    which sensitivities are needed, has no result, the fit ends and states this reason. Raises InputError unless there are more
    measurements than parameters.
    """
    if len(rows) <= len(parameters):
        raise InputError("data", f"{len(rows)} rows for {len(parameters)} parameters", "more rows than parameters")
    residuals = _Residuals(forward, rows)
    start = np.array([min(max(one.place(one.nominal), 0.01), 0.99) for one in parameters])
    try:
        residuals.slopes(start)  # first, as the fit cannot begin unless these points have results
        found = least_squares(
            lambda point: residuals.at([point])[0],
            start,
            residuals.slopes,
            bounds=(0, 1),
            xtol=1e-5,
            ftol=1e-8,
            max_nfev=_MOST * len(parameters),
        )
        left = np.asarray(found.fun)
        result = replace(_judged(found.x, left, residuals.slopes(found.x), parameters), converged=bool(found.success))
    except _NoAnswerError:
        result, left = _ended(residuals, parameters)
    fitted = tuple(map(float, residuals.values + residuals.deviations * left))
    return replace(result, case=case, rows=tuple(rows), fitted=fitted, runs=len(residuals.known))


def _ended(residuals: _Residuals, parameters: Sequence[Parameter]) -> tuple[Calibration, Floats]:
    """The calibration at the best point of a fit that could not continue, without intervals; and the residuals at this point, NaN
    if no point has a result.
    """
    best, freedom = residuals.best(), len(residuals.values) - len(parameters)
    left = np.full(len(residuals.values), np.nan) if best is None else best[1]
    known = () if best is None else zip(parameters, best[0], strict=True)
    estimates = tuple(_estimate(one, float(at), math.inf) for one, at in known)
    scatter = float(np.sqrt(left @ left / freedom))
    return Calibration("", estimates, (), (), scatter, (), (), 0, ended=_ENDED), left


def _finite(residuals: Floats) -> Floats:
    if not np.isfinite(residuals).all():
        raise InputError(
            "calibrate", "values that are not numbers", "ranges of parameters in which all values are numbers"
        )
    return residuals


def _judged(point: Floats, left: Floats, slopes: Floats, parameters: Sequence[Parameter]) -> Calibration:
    """The estimates at the fitted ``point``, with confidence intervals by Student's t from the singular values of the ``slopes``
    (m, d) and from the residuals ``left`` (m,).
    """
    freedom = len(left) - len(point)
    scatter = float(np.sqrt(left @ left / freedom))
    _, singular, rows = np.linalg.svd(slopes, full_matrices=False)
    nothing = singular <= _NOTHING * singular[0]
    inverse = np.where(nothing, 0.0, 1 / np.where(nothing, 1.0, singular))
    covariance = (rows.T * inverse**2) @ rows
    unknown = (np.abs(rows[nothing]) > math.sqrt(_NOTHING)).any(axis=0)
    widths = stats.t.ppf((1 + CONFIDENCE) / 2, freedom) * scatter * np.sqrt(np.diag(covariance))
    widths = np.where(unknown | (np.abs(slopes).max(axis=0) == 0), np.inf, widths)
    estimates = tuple(_estimate(one, *at) for one, *at in zip(parameters, point, widths, strict=True))
    pairs = _pairs(covariance, rows[nothing], parameters)
    return Calibration("", estimates, (), (), scatter, tuple(map(float, singular)), pairs, 0)


def _estimate(parameter: Parameter, place: float, width: float) -> Estimate:
    """The estimate of a ``parameter``. ``place`` and ``width``: the position of the value in the range, and the half-width of the
    confidence interval, both as fractions of the range.
    """
    at = "low" if place < _AT else "high" if place > 1 - _AT else ""
    low, value, high = (parameter.at(one) for one in (place - width, place, place + width))
    return Estimate(parameter, value, low, high, at)


def _pairs(covariance: Floats, nothing: Floats, parameters: Sequence[Parameter]) -> tuple[tuple[str, str, float], ...]:
    """The titles of each pair of parameters whose errors are correlated, with the correlation.

    ``nothing`` (k, d): the combinations of parameters that the measurements do not determine. The correlation is computed from
    these if both parameters occur in them, otherwise from the ``covariance`` of the determined combinations.
    """
    lost, found = nothing.T @ nothing, list[tuple[str, str, float]]()
    for i, one in enumerate(parameters):
        for k, other in enumerate(parameters[:i]):
            both = lost if min(lost[i, i], lost[k, k]) > _NOTHING else covariance
            scale = math.sqrt(both[i, i] * both[k, k])
            correlation = float(both[i, k]) / scale if scale > 0 else 0.0
            if abs(correlation) > _CORRELATED:
                found.append((other.title, one.title, correlation))
    return tuple(found)


def facts(found: Calibration) -> dict[str, Any]:
    """A calibration as valid JSON."""
    table: dict[str, Any] = plain(asdict(found))
    table |= {"is_followed": found.is_followed, "holds": found.holds}
    for one, row in zip(found.estimates, table["estimates"], strict=True):
        row["is_known"] = one.is_known
    return table
