"""Lengths of the fibres of a run compared with the reference, frame by frame.

If both runs carry the fibres of the measurement context in their interior, these fibres are measured. Otherwise the surfaces of
both runs carry the fibres, by the extension in the measurement context, so that both runs are measured in the same way. The length
of a fibre includes its straight tendon, if it has one.

A run of lines alone (lines of action) has its own fibre points. The total length of each line is compared, so a straight line that
is shorter than the fibre deviates even at rest. This counts as an error, even if the change of length from rest is correct.
"""

from functools import partial

import numpy as np

from fem_reference.foundations.mesh import Floats
from fem_reference.metrics import Measure, MeasurementContext, Statistic, measures
from fem_reference.problems.fibre_ends import ends_of
from fem_reference.runs.store import Run

_TITLE = "Fibre length"
# Fibres are few and end at rims, so a single fibre may contribute most of the mean square: all statistics count as local.
_of_lines = partial(Statistic, local=True)
STATISTICS = {
    "mean": _of_lines("mm", curve="Change of fibre length from rest, mean over the fibres", shown={"curve": 20}),
    "rms": _of_lines("mm", _TITLE, "rms", shown={"solvers": 20}),
    "max": _of_lines("mm", _TITLE, "worst fibre", shown={"table": 20}, lone=True),
    "mean_percent": _of_lines("%", _TITLE, "mean", shown={"claim": 40}),
    "rms_percent": _of_lines(
        *("%", _TITLE, "rms"),
        headline="lengths of fibres by {} rms",
        shown={"main": 20, "table": 25, "headline": 20, "solvers": 30, "scenes": 20, "rank": 20, "claim": 50},
    ),
    "max_percent": _of_lines("%", _TITLE, "worst fibre", shown={"table": 30, "claim": 60}, lone=True),
}
OF, AGAINST = "lines", "reference"
# Fibre points within this distance [mm] of the points of the measurement context are the same points, stored in single precision.
_SAME = 1e-3
# The same distance for a run of lines alone: a reference may begin this far from rest if overlaps with bones were removed.
_RELAXED = 5.0


@np.errstate(over="ignore", invalid="ignore")
def measure(run: Run, reference: Run, context: MeasurementContext) -> tuple[Measure, ...]:
    """Statistics, over the fibres, of ``L - L_reference`` [mm]: the signed ``mean``, the ``rms`` and the maximum magnitude ``max``.
    ``mean_percent``, ``rms_percent`` and ``max_percent``: the same in per cent of the length of each fibre at rest.
    """
    found, expected = both_lengths(run, reference, context)
    longer, at_rest = found - expected, lengths_at(context.fibres.points, run.numbers[0], context)
    return _statistics(longer, "") + _statistics(100 * longer / at_rest, "_percent")


def both_lengths(run: Run, reference: Run, context: MeasurementContext) -> tuple[Floats, Floats]:
    """The lengths (f, k) [mm] of the fibres in each frame of the ``run`` and of the ``reference``, measured in the same way."""
    inside = _carries(run, context) and _carries(reference, context)
    return _lengths(run, context, inside=inside), _lengths(reference, context, inside=inside)


def _statistics(longer: Floats, suffix: str) -> tuple[Measure, ...]:
    """The mean, rms and maximum magnitude over the fibres of ``longer`` (f, k); the ``suffix`` is added to these names."""
    rms = np.sqrt(np.mean(longer**2, axis=1))
    values = {"mean": longer.mean(axis=1), "rms": rms, "max": np.abs(longer).max(axis=1)}
    return measures("fibre_length", {f"{name}{suffix}": each for name, each in values.items()}, _worst(longer))


def fibre_points(run: Run, context: MeasurementContext) -> Floats:
    """Positions (f, m, 3) [mm] of the points of the fibres, from the run itself or carried by its surface."""
    own = run.fibre_positions
    if own is not None and own.shape[1:] == context.fibres.points.shape:
        return own
    return np.stack([context.extension.apply(points) for points in run.positions])


@np.errstate(over="ignore", invalid="ignore")
def extension_error(reference: Run, context: MeasurementContext) -> Measure:
    """The maximum error [mm], over the fibres, of the lengths that the extension gives for the surface of the reference itself.

    The error is the length by the extension minus the length in the interior; NaN if the reference does not carry the fibres of the
    measurement context.
    """
    if _carries(reference, context):
        errors = _lengths(reference, context, inside=False) - _lengths(reference, context, inside=True)
    else:
        errors = np.full((len(reference.positions), len(context.fibres)), np.nan)
    worst = np.abs(errors).max(axis=1)
    return Measure("fibre_length", "extension_error", "mm", worst, _worst(errors), reference.numbers)


def _carries(run: Run, context: MeasurementContext) -> bool:
    """True if the fibres of ``run`` are the fibres of the measurement context."""
    if run.fibres is None or run.fibre_positions is None or run.fibres.points.shape != context.fibres.points.shape:
        return False
    same_lines = np.array_equal(run.fibres.offsets, context.fibres.offsets)
    within = _SAME if run.has_surface else _RELAXED
    return same_lines and np.allclose(run.fibres.points, context.fibres.points, rtol=0, atol=within)


def _lengths(run: Run, context: MeasurementContext, *, inside: bool) -> Floats:
    """The length (f, k) [mm] of each fibre in each frame, on the fibre points of the run itself if ``inside``, otherwise on points
    that its surface carries. In the rest state the bones have their poses in the first frame.
    """
    points = run.fibre_positions if inside else [context.extension.apply(each) for each in run.positions]
    assert points is not None  # the caller has checked _carries
    numbers = run.numbers[:1] * len(run.numbers) if run.solver == "rest" else run.numbers
    return np.array([lengths_at(*at, context) for at in zip(points, numbers, strict=True)])


def lengths_at(points: Floats, number: int, context: MeasurementContext) -> Floats:
    """The length (k,) [mm] of each fibre including its tendons, if its points are at ``points`` (n, 3) [mm] in frame ``number``."""
    inside = context.fibres.lengths(points)
    return inside if context.ends is None else inside + context.ends.beyond(ends_of(context.fibres, points), number)


def _worst(deviations: Floats) -> tuple[str, ...]:
    return tuple(f"fibre {fibre}" for fibre in np.argmax(np.abs(deviations), axis=1))
