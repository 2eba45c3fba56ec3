"""A comparison restricted to the frames that its reference reached."""

from dataclasses import replace
from functools import partial

import numpy as np

from fem_reference.assessment.comparison import Comparison
from fem_reference.foundations.mesh import Ints
from fem_reference.metrics import Measure
from fem_reference.runs.store import Run, complete


def frames(run: Run) -> Ints:
    """Indices of the frames in which every coordinate of a run is a number."""
    return np.flatnonzero(np.isfinite(run.positions).all(axis=(1, 2)))


def cut(comparison: Comparison) -> Comparison:
    """The comparison without the frames that a failed reference did not reach; unchanged where it reached all, or none."""
    kept = frames(comparison.reference)
    if comparison.reference.outcome.status == "converged" or len(kept) in (0, len(comparison.reference.numbers)):
        return comparison
    numbers, measures = tuple(comparison.reference.numbers[i] for i in kept), partial(_measures, kept)
    error, bars = comparison.extension_error, comparison.error_bars
    if bars is not None:
        shorter = tuple(
            replace(bar, values=bar.values[kept], model=None if bar.model is None else bar.model[kept])
            for bar in bars.bars
        )
        bars = replace(bars, numbers=numbers, bars=shorter)
    return replace(
        comparison,
        reference=complete(comparison.reference, numbers),
        candidates=tuple(complete(run, numbers) for run in comparison.candidates),
        deviations={name: measures(found) for name, found in comparison.deviations.items()},
        changes={name: measures(found) for name, found in comparison.changes.items()},
        extension_error=None if error is None else measures((error,))[0],
        error_bars=bars,
    )


def _measures(kept: Ints, measures: tuple[Measure, ...]) -> tuple[Measure, ...]:
    return tuple(
        replace(
            one,
            values=one.values[kept],
            where=tuple(one.where[i] for i in kept) if one.where else (),
            numbers=tuple(one.numbers[i] for i in kept) if one.numbers else (),
            error_bars=None if one.error_bars is None else one.error_bars[kept],
        )
        for one in measures
    )
