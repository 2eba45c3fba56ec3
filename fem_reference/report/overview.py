"""A case and its results as lines of text, for the verbs ``show``, ``run`` and ``compare``."""

import math
from collections.abc import Iterable
from typing import Any

from fem_reference.assessment import second_check
from fem_reference.assessment.comparison import Alone, Comparison
from fem_reference.assessment.error_bars import ErrorBar
from fem_reference.assessment.judge import Verdict
from fem_reference.metrics import Measure, described, find
from fem_reference.problems import of_case
from fem_reference.problems.of_case import CaseSetup
from fem_reference.report.tables import exerted, spread
from fem_reference.runs.store import Run
from fem_reference.scenes.case import Case

# The statistics that are printed for a comparison; the page and the JSON and CSV files contain all statistics.
PRINTED = tuple(key for key in described("table") if not key[1].endswith("_percent"))


def case_facts(case: Case, setup: CaseSetup) -> dict[str, Any]:
    """The main facts about a case that are known before it is solved, by name."""
    return {
        "case": case.name,
        "title": case.title,
        "proves": case.proves,
        **of_case.facts(case, setup),
        "reference": " ".join([case.reference.solver, *(f"{k}={v}" for k, v in case.reference.settings.items())]),
        "candidates": {candidate.name: candidate.solver for candidate in case.candidate},
        "expects": [
            f"{one.of} {one.metric}{f' {one.statistic} at frame {one.frame}' if one.statistic is not None else ''}: "
            f"{one.truth} within {one.within} ({one.kind})"
            for one in case.expect
        ],
    }


def comparison_text(result: Comparison) -> str:
    """The result of a comparison as lines of text: its runs, error bars, worst deviations and verdicts."""
    runs = [f"{run.name}: {run.outcome.status}, {run.outcome.message}" for run in result.runs]
    runs += [f"reference: doubtful, {why}" for why in result.doubts if why != result.reference.outcome.status]
    runs += [f"{name}: no answer, not ranked: {why}" for name, why in result.unsound.items()]
    checks = second_check.texts_of(result.reference)
    if checks and result.reference.outcome.status == "converged":
        runs.append(f"second check: passed, {len(checks)} checks")
    judged = [_judged(verdict) for verdict in result.verdicts]
    asked = {verdict.expectation.of for verdict in result.verdicts}
    unjudged = result.candidates and asked == {"reference"}
    note = " for the reference; candidates are measured, not judged" if unjudged else ""
    return "\n".join([*runs, *_known(result), *_worst(result), *judged, f"verdict: {result.word}{note}"])


def _judged(verdict: Verdict) -> str:
    """A verdict as a line of text; values without a unit have more digits."""
    expected = verdict.expectation
    if verdict.unit == "1":
        truth = f"expected {verdict.truth:.6g} within {verdict.within:.3g}"
        return f"{verdict.word}: {expected.of} {expected.metric} is {_number(verdict.value)}, {truth}"
    return (
        f"{verdict.word}: {expected.of} {expected.metric} {expected.statistic} at frame "
        f"{verdict.frame} is {verdict.value:.4g} {verdict.unit}, expected {verdict.truth:.4g} within {verdict.within:.4g}"
        + ("" if verdict.error_bar is None else f", error bar ± {verdict.error_bar:.2g}")
    )


def _measured(name: str, measures: Iterable[Measure]) -> list[str]:
    """A line for each value of ``measures`` of a field."""
    return [f"{name} {one.metric}: {_number(value)}" for one in measures for value in one.values]


def _number(value: float) -> str:
    return f"{value:.6g}" if math.isfinite(value) else "not a number"


def _worst(result: Comparison) -> list[str]:
    """A line for each candidate with its worst deviations in the ``PRINTED`` statistics; for fields, a line for each value."""
    if "field" in result.reference.carries:
        measured = {"reference": result.changes["reference"]} | result.deviations
        return [line for name, measures in measured.items() for line in _measured(name, measures)]
    lines = []
    for name, measures in result.deviations.items():
        text = [
            f"{' '.join(key).replace('_', ' ')} {measure.worst.value:.4g} {measure.unit} (frame {measure.worst.frame})"
            for key in PRINTED
            if (measure := find(measures, *key)) is not None
        ]
        lines.append(f"{name} at its worst: {', '.join(text)}")
    return lines


def _known(result: Comparison) -> list[str]:
    """A line for each statistic with an error bar of the reference; no lines without error bars."""
    if result.error_bars is None:
        return []
    lines = ["error bars of the reference (the maximum change from rest, and the widest error bar of this change):"]
    for measure in (*result.changes[result.reference.name], *exerted(result.reference)):
        bar = result.error_bars.find("change", measure.metric, measure.statistic)
        if bar is not None:
            value = f"{measure.worst.value:.4g} {measure.unit}"
            lines.append(f"  {measure.metric} {measure.statistic}: {value}, {_bar(result, bar)}")
    lines.append("error bars of deviations from the reference (the widest):")
    deviations = [bar for bar in result.error_bars.bars if bar.of == "deviation"]
    lines += [f"  {bar.metric} {bar.statistic}: {_bar(result, bar)}" for bar in deviations]
    return [*lines, *filter(None, [spread(result)])]


def _bar(result: Comparison, bar: ErrorBar) -> str:
    assert result.error_bars is not None  # the bar is one of them
    at = f"frame {result.error_bars.numbers[bar.widest]}"
    value = bar.values[bar.widest]
    return (
        f"no error bar is known at {at}" if math.isnan(value) else f"\N{PLUS-MINUS SIGN} {value:.2g} {bar.unit} at {at}"
    )


def run_text(run: Run, found: Alone) -> str:
    """The result of a run without a comparison, as lines of text."""
    printed = [f"{run.name}: {run.outcome.status}, {run.outcome.message}", *_measured(run.name, found.measures)]
    return "\n".join([*printed, *map(_judged, found.verdicts), f"stored in {run.folder}"])
