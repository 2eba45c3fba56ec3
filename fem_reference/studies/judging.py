"""Runs of a case -> a comparison, whatever was solved."""

from collections.abc import Iterable
from dataclasses import replace

from fem_reference.assessment import comparison
from fem_reference.assessment.comparison import Comparison
from fem_reference.assessment.error_bars import ErrorBars
from fem_reference.runs.reached import complete
from fem_reference.runs.store import Run
from fem_reference.scenes.case import Case
from fem_reference.studies import convergence
from fem_reference.studies.execution import Bench


def compare(
    bench: Bench[Case], reference: Run, candidates: Iterable[Run], error_bars: ErrorBars | None = None
) -> Comparison:
    """Measure and judge the runs of the case of a ``bench``, over all its frames, and how its reference converges."""
    case, setup = bench.scene, bench.setup()
    complete_runs = tuple(complete(run, case.numbers) for run in candidates)
    result = comparison.compare(case, setup, complete(reference, case.numbers), complete_runs, error_bars)
    return replace(result, ladders=convergence.ladders(setup, case))
