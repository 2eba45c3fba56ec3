"""A reference and its candidates, measured and judged: what reports are written from."""

from dataclasses import dataclass, replace
from typing import Any

from fem_reference.assessment.convergence import Ladder
from fem_reference.assessment.error_bars import ErrorBars, Of
from fem_reference.assessment.judge import Verdict, Word, overall, resolved, verdict
from fem_reference.assessment.ranking import Ranking, rankings
from fem_reference.foundations.errors import InputError
from fem_reference.foundations.markup import table
from fem_reference.foundations.mesh import Floats
from fem_reference.foundations.records import join
from fem_reference.metrics import Context, Measure, MeasurementContext, at_rest, context_of, find, measure, names
from fem_reference.metrics.fibre_length import extension_error
from fem_reference.runs.store import Run
from fem_reference.scenes.case import Case, Expectation

# What a notebook shows of a candidate; the page has it all.
_SHOWN = (
    ("volume", "deviation"),
    ("fibre_length", "rms_percent"),
    ("surface_deviation", "rms"),
    ("surface_deviation", "max"),
    ("difference", "max"),
    ("l2_error", "norm"),
)


@dataclass(frozen=True, eq=False)
class Comparison:
    """``setup``: the muscle's ``Setup`` or the ``FieldProblem``. ``deviations``: by candidate name, its measures against the
    reference. ``changes``: by run name (``"reference"`` among them), its measures against the rest state; of a field, which has
    none, those that need no reference. ``extension_error`` [mm]: by frame, the greatest error over the fibres that the extension
    makes on the reference's own surface, None where there is none. ``error_bars``: those of the reference, None without any;
    ``ladders``: how it converges, where that was measured.
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
    ladders: tuple[Ladder, ...] = ()

    @property
    def runs(self) -> tuple[Run, ...]:
        """Every run, the reference first."""
        return (self.reference, *self.candidates)

    def __getitem__(self, key: tuple[str, str, str]) -> Measure:
        """The measure of a candidate by its name, a metric and a statistic, such as ``"mine", "volume", "deviation"``; of
        ``"reference"`` its change from rest. KeyError where there is none.
        """
        name, metric, statistic = key
        measures = self.changes["reference"] if name == "reference" else self.deviations.get(name, ())
        found = find(measures, metric, statistic)
        if found is None:
            raise KeyError(key)
        return found

    def _repr_html_(self) -> str:
        """What notebooks show: the greatest deviation of each candidate, with its frame and its error bar."""
        rows = [
            (name, f"{one.metric}.{one.statistic}", f"{one.values[one.worst]:.4g} {one.unit}", self._known(one), number)
            for name, measures in self.deviations.items()
            for one in measures
            if (one.metric, one.statistic) in _SHOWN
            for number in [self.reference.numbers[one.worst]]
        ]
        return table(f"{self.scene.name}: {self.word}", ("candidate", "measure", "greatest", "known to", "frame"), rows)

    def _known(self, one: Measure) -> str:
        bar = self.error_bars and self.error_bars.find("deviation", one.metric, one.statistic)
        return f"± {bar.values[one.worst]:.2g} {one.unit}" if bar else ""

    @property
    def rankings(self) -> tuple[Ranking, ...]:
        """Which candidates are nearer, as far as the error bars separate them; nothing without these."""
        return rankings(self.deviations, self.error_bars.of_deviations) if self.error_bars else ()

    @property
    def word(self) -> Word:
        """The verdict of the case: none that rests on a reference which was denied."""
        return (
            "fail" if self.reference.outcome.status == "denied" else overall(verdict.word for verdict in self.verdicts)
        )


def compare(
    scene: Case, setup: Any, reference: Run, candidates: tuple[Run, ...], error_bars: ErrorBars | None = None
) -> Comparison:
    """Measure and judge runs of a scene.

    Parameters
    ----------
    scene, setup
        The scene, and what its problem is made from.
    reference
        The run that counts as the truth.
    candidates
        Runs with all frames of the scene, NaN where one did not reach a frame. Of a run only what it carries is judged.
    error_bars
        Those of the reference: nothing is judged that they are too wide for. None without any.

    """
    context, runs = context_of(setup, reference), (reference, *candidates)
    candidate, alone = names(scene.standards("candidates")), names(scene.standards("reference"))
    deviations = {run.name: measure(run, reference, context, candidate) for run in candidates}
    changes = {run.name: measure(run, at_rest(run), context, alone) for run in runs}
    measured = {"reference": changes["reference"]} | deviations
    _check_expected(scene, measured)
    verdicts = tuple(
        verdict(
            expectation.model_copy(update={"of": name}),
            measured[name],
            reference.numbers,
            _bars(error_bars, expectation),
        )
        for expectation in map(resolved, scene.expect)
        for name in (deviations if expectation.of == "candidates" else [expectation.of])
        if _is_measured(expectation, measured.get(name, ()))
    )
    if reference.outcome.status == "denied":  # no truth
        verdicts = tuple(
            replace(one, word="fail" if one.expectation.of == "reference" else "inconclusive") for one in verdicts
        )
    error = extension_error(reference, context) if isinstance(context, MeasurementContext) else None
    return Comparison(scene, setup, reference, candidates, context, deviations, changes, error, verdicts, error_bars)


def alone(scene: Case, setup: Any, run: Run) -> tuple[tuple[Measure, ...], tuple[Verdict, ...]]:
    """What can be measured and judged of a ``run`` without a reference: of a muscle nothing, whose measures all take their
    context from one.
    """
    if "reference" in scene.standards("reference"):
        return (), ()
    measures = measure(run, run, context_of(setup, run), names(scene.standards("reference")))
    expected = [one for one in map(resolved, scene.expect) if one.of == run.name and _is_measured(one, measures)]
    return measures, tuple(verdict(one, measures, run.numbers) for one in expected)


def _check_expected(scene: Case, measured: dict[str, tuple[Measure, ...]]) -> None:
    """InputError where a scene expects of a run by its name what is not measured of it, as it has no surface."""
    for i, one in enumerate(map(resolved, scene.expect)):
        if one.of in measured and not _is_measured(one, measured[one.of]):
            got = f"{one.metric}.{one.statistic} of {one.of}, which has no surface"
            raise InputError(join(scene.place, f"expect[{i}]"), got, "a measure of lines")


def _is_measured(expectation: Expectation, measures: tuple[Measure, ...]) -> bool:
    """Whether what is expected is among ``measures``: of a run without a surface much is not."""
    return find(measures, expectation.metric, str(expectation.statistic)) is not None


def _bars(error_bars: ErrorBars | None, expectation: Expectation) -> Floats | None:
    """The error bars (f,) of what is expected; None without any of it."""
    of: Of = "change" if expectation.of == "reference" else "deviation"
    found = None if error_bars is None else error_bars.find(of, expectation.metric, str(expectation.statistic))
    return None if found is None else found.values
