"""A reference and its candidates, measured and judged, as input for reports."""

from dataclasses import dataclass, replace
from functools import cached_property, partial
from typing import Any, NamedTuple

import numpy as np

from fem_reference import metrics
from fem_reference.assessment.error_bars import ErrorBars, Of
from fem_reference.assessment.judge import Verdict, Word, doubted, doubts, overall, resolved, verdict
from fem_reference.assessment.ranking import Ranking, rankings
from fem_reference.assessment.soundness import unsound
from fem_reference.foundations.errors import InputError
from fem_reference.foundations.markup import table
from fem_reference.foundations.mesh import Ints
from fem_reference.foundations.records import join
from fem_reference.metrics import Context, Measure, MeasurementContext, find
from fem_reference.metrics.fibre_length import extension_error
from fem_reference.problems.of_case import CaseSetup
from fem_reference.runs.store import Run, complete
from fem_reference.scenes.case import Case, Expectation


@dataclass(frozen=True)
class Convergence:
    """The convergence of an ``element`` on meshes whose size is halved from each mesh to the next: the number of ``cells`` and
    the error (``errors``) of each mesh, and the ``order`` of convergence on the two finest meshes, NaN if the errors are only
    rounding errors.

    ``against``: the definition of the error, in words: the L2 distance to the exact solution, or the rms distance at the vertices
    from the finest solution of order 2.
    """

    element: str
    cells: tuple[int, ...]
    errors: tuple[float, ...]
    order: float
    against: str


@dataclass(frozen=True, eq=False)
class Comparison:
    """The runs of a case with their measures and verdicts.

    ``setup``: the ``Setup`` of a muscle, or the ``FieldProblem``. ``deviations``: the measures of each candidate against the
    reference, by the name of the candidate. ``changes``: the measures of each run against the rest state, by the name of the run
    (including ``"reference"``); for a field, which has no rest state, the measures that need no reference. ``extension_error``
    [mm]: for each frame, the maximum error of the lengths of fibres carried by the reference's surface, None for a field.
    ``error_bars``: the error bars of the reference, None if they were not computed. ``ladders``: the convergence of the reference
    on refined meshes, if it was measured.
    """

    scene: Case
    setup: Any
    reference: Run
    candidates: tuple[Run, ...]
    context: Context
    deviations: dict[str, tuple[Measure, ...]]
    changes: dict[str, tuple[Measure, ...]]
    extension_error: Measure | None
    verdicts: tuple[Verdict, ...]
    error_bars: ErrorBars | None = None
    ladders: tuple[Convergence, ...] = ()

    @property
    def runs(self) -> tuple[Run, ...]:
        """All runs, the reference first."""
        return (self.reference, *self.candidates)

    def __getitem__(self, key: tuple[str, str, str]) -> Measure:
        """The measure of a candidate, by the name of the candidate, a metric and a statistic, such as ``"mine", "volume",
        "deviation"``. For ``"reference"`` it is the change from rest. Raises KeyError if there is no such measure.
        """
        name, metric, statistic = key
        measures = self.changes["reference"] if name == "reference" else self.deviations.get(name, ())
        found = find(measures, metric, statistic)
        if found is None:
            raise KeyError(key)
        return found

    def _repr_html_(self) -> str:
        """A table for notebooks: the maximum deviation of each candidate, with its frame and its error bar."""
        rows = [
            (name, f"{one.metric}.{one.statistic}", f"{it.value:.4g} {it.unit}", known, it.frame)
            for name, measures in self.deviations.items()
            for one in measures
            if (one.metric, one.statistic) in metrics.described("main")
            for it in [one.worst]
            for known in ["" if it.error_bar is None else f"± {it.error_bar:.2g} {it.unit}"]
        ]
        heads = ("candidate", "measure", "greatest deviation", "error bar", "frame")
        return table(f"{self.scene.name}: {self.word}", heads, rows)

    @property
    def rankings(self) -> tuple[Ranking, ...]:
        """The rankings of the sound candidates, as far as the error bars separate them; empty without bars."""
        sound = {name: found for name, found in self.deviations.items() if name not in self.unsound}
        return rankings(sound, self.error_bars.of_deviations) if self.error_bars else ()

    @cached_property
    def unsound(self) -> dict[str, str]:
        """The reasons why the frames of candidates are unusable, by the name of the candidate; empty for fields."""
        if "surface" not in self.reference.carries:
            return {}
        return {run.name: why for run in self.candidates if (why := unsound(run, self.reference))}

    @property
    def doubts(self) -> list[str]:
        """Reasons to doubt the reference, in words."""
        return doubts(self.reference)

    @property
    def word(self) -> Word:
        """The verdict on the case; it is fail if the second check denies the reference."""
        if self.reference.outcome.status == "denied":
            return "fail"
        return doubted(overall(one.word for one in self.verdicts), self.doubts)

    def word_of(self, name: str) -> Word:
        """The verdict on the run ``name``. A reference that did not converge fails, even if it meets its expectations."""
        found = overall(one.word for one in self.verdicts if one.expectation.of == name)
        if name != "reference":
            return found
        return doubted(found, self.doubts) if self.reference.outcome.status == "converged" else "fail"


def compare(
    case: Case, setup: CaseSetup, reference: Run, candidates: tuple[Run, ...], error_bars: ErrorBars | None = None
) -> Comparison:
    """Measure the runs of a case and judge them, with the ``reference`` as the truth.

    Only the data that a run carries are judged. ``candidates`` have all frames of the case, with NaN in frames that were not
    reached. A verdict is inconclusive if the error bar is partly outside the tolerance. Raises InputError if the case
    expects a measure of a named run, and this run has no surface from which to compute it.
    """
    context, runs = metrics.context_of(setup, reference), (reference, *candidates)
    candidate, alone = metrics.names(case.standards("candidates")), metrics.names(case.standards("reference"))
    apart = {run.name: metrics.measure(run, reference, context, candidate) for run in candidates}
    deviations = {name: _with_bars(found, "deviation", error_bars) for name, found in apart.items()}
    changes = {run.name: metrics.measure(run, metrics.at_rest(run), context, alone) for run in runs}
    changes["reference"] = _with_bars(changes["reference"], "change", error_bars)
    measured = {"reference": changes["reference"]} | deviations
    for i, one in enumerate(map(resolved, case.expect)):
        if one.of in measured and not _is_measured(one, measured[one.of]):
            got = f"{one.metric}.{one.statistic} of {one.of}, which has no surface"
            raise InputError(join(case.place, f"expect[{i}]"), got, "a measure that needs no surface")
    verdicts = tuple(
        verdict(expectation.model_copy(update={"of": name}), measured[name], reference.numbers)
        for expectation in map(resolved, case.expect)
        for name in (deviations if expectation.of == "candidates" else [expectation.of])
        if _is_measured(expectation, measured.get(name, ()))
    )
    if reference.outcome.status == "denied":  # a denied reference is not a truth
        verdicts = tuple(
            replace(one, word="fail" if one.expectation.of == "reference" else "inconclusive") for one in verdicts
        )
    error = extension_error(reference, context) if isinstance(context, MeasurementContext) else None
    return Comparison(case, setup, reference, candidates, context, deviations, changes, error, verdicts, error_bars)


class Alone(NamedTuple):
    """A run without a reference: its ``measures``, the ``verdicts`` on them, and the overall verdict ``word``."""

    measures: tuple[Measure, ...]
    verdicts: tuple[Verdict, ...]
    word: Word


def alone(case: Case, setup: CaseSetup, run: Run) -> Alone:
    """Measure and judge a ``run`` without a reference. A muscle is not judged, because its measures need a reference."""
    if "reference" in case.standards("reference"):
        return Alone((), (), "not judged")
    measures = metrics.measure(run, run, metrics.context_of(setup, run), metrics.names(case.standards("reference")))
    expected = [one for one in map(resolved, case.expect) if one.of == run.name and _is_measured(one, measures)]
    verdicts = tuple(verdict(one, measures, run.numbers) for one in expected)
    return Alone(measures, verdicts, doubted(overall(one.word for one in verdicts), doubts(run)))


def _is_measured(expectation: Expectation, measures: tuple[Measure, ...]) -> bool:
    """True if the expected measure is among ``measures``; a run without a surface lacks many measures."""
    return find(measures, expectation.metric, str(expectation.statistic)) is not None


def _with_bars(measures: tuple[Measure, ...], of: Of, error_bars: ErrorBars | None) -> tuple[Measure, ...]:
    """The ``measures``, each with its error bars if these exist. ``of``: the kind of the bars, "change" or "deviation"."""
    if error_bars is None:
        return measures
    known = [(one, error_bars.find(of, one.metric, one.statistic)) for one in measures]
    return tuple(one if bar is None else replace(one, error_bars=bar.values) for one, bar in known)


def reached_frames(run: Run) -> Ints:
    """Indices of the frames in which all coordinates of a run are finite."""
    return np.flatnonzero(np.isfinite(run.positions).all(axis=(1, 2)))


def reached(comparison: Comparison) -> Comparison:
    """The comparison without frames that a failed reference did not reach; unchanged if it reached all frames, or none."""
    kept = reached_frames(comparison.reference)
    if comparison.reference.outcome.status == "converged" or len(kept) in (0, len(comparison.reference.numbers)):
        return comparison
    numbers, measures = tuple(comparison.reference.numbers[i] for i in kept), partial(_kept, kept)
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


def _kept(kept: Ints, measures: tuple[Measure, ...]) -> tuple[Measure, ...]:
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
