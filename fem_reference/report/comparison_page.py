"""The page of a comparison."""

import math
from collections import Counter
from dataclasses import replace
from functools import partial
from typing import Any, NamedTuple

import numpy as np

from fem_reference.assessment import experiments, second_check
from fem_reference.assessment.comparison import Comparison, reached, reached_frames
from fem_reference.assessment.credibility import claims
from fem_reference.assessment.differences import greatest
from fem_reference.assessment.error_bars import ErrorBar
from fem_reference.foundations.limits import ENERGY_GAP
from fem_reference.metrics import Measure, described, find
from fem_reference.report import gallery
from fem_reference.report.at_frames import columns, label
from fem_reference.report.curves import curves, label_of
from fem_reference.report.drawings import looks
from fem_reference.report.pages import Headlines, Page, by_name
from fem_reference.report.sections import cost, origin
from fem_reference.report.tables import DEVIATIONS, MEASURES, as_csv, exerted, inversion, known, spread, summary
from fem_reference.report.viewer import view
from fem_reference.report.words import listed, number
from fem_reference.runs.store import Run, seconds_per_frame


def page(comparison: Comparison) -> Page:
    """The page of a comparison. If the reference failed, the page covers the frames that the reference reached."""
    numbers, failed = summary(comparison), _failed(comparison)
    nothing, comparison = not len(reached_frames(comparison.reference)), reached(comparison)
    said, rows = headlines(comparison), as_csv(numbers["measures"])
    contents = _contents(comparison) | {"headlines": said, "failed": failed, "nothing": nothing}
    title, name = comparison.scene.title, "comparison_page.html"
    return Page("comparison", title, said, name, contents, numbers, rows, MEASURES)


def _failed(comparison: Comparison) -> str:
    """The reason why the reference failed, and the resulting scope of the page; empty if the reference converged."""
    reference, wanted = comparison.reference, len(comparison.reference.numbers)
    if reference.outcome.status == "converged":
        return ""
    kept = reached_frames(reference)
    why = f"{reference.outcome.message.rstrip('.')}."
    if not len(kept):
        return f"{why} No frame was reached, so nothing could be compared with it."
    if reference.outcome.status == "denied":
        return f"{why} The measures below are relative to states that are not a valid truth."
    last = label(comparison.scene, comparison.setup, reference.numbers[kept[-1]])
    return f"{why} {len(kept)} of {wanted} frames were reached, up to {last}; the page covers these."


def _contents(comparison: Comparison) -> dict[str, Any]:
    """The contents of the page and of its sections."""
    error = comparison.extension_error
    return {
        "sentence": _sentence(comparison),
        "looks": list(looks(run.name for run in comparison.runs).items()),
        "comparison": comparison,
        "scene": comparison.scene,
        "reference": comparison.reference,
        "runs": comparison.runs,
        "columns": DEVIATIONS,
        "groups": Counter(group for _, _, group, _, _ in DEVIATIONS),
        "bars": known(comparison),
        "own": (*comparison.changes[comparison.reference.name], *exerted(comparison.reference)),
        "spread": spread(comparison),
        "error": error and error.worst,
        "model_bands": [
            (one, experiments.model_band(one.band)) for one in claims() if comparison.scene.task == "solve"
        ],
        "viewer": view(comparison),
        "pictures": gallery.of_comparison,
        "label": partial(label, comparison.scene, comparison.setup),
        "frame_columns": columns(comparison.scene, comparison.setup),
        "changes": origin.changes(comparison.scene),
        "energy_gap_limit": ENERGY_GAP,
        "second_check": second_check.texts_of,
        **by_name(curves, label_of, seconds_per_frame, inversion, greatest, widest, gap, first_rows, first_columns),
        **cost.facts(comparison),
        **origin.facts(comparison),
    }


def widest(bar: ErrorBar, measure: Measure | None) -> int:
    """The index of the frame with the widest ``bar``. Frames without a value of the reference's ``measure`` are ignored (a moment
    arm has no value without a force); an unknown bar in any other frame counts as the widest.
    """
    if measure is None or not np.isfinite(measure.values).any():
        return bar.widest
    return replace(bar, values=np.where(np.isfinite(measure.values), bar.values, -1.0)).widest


def gap(run: Run) -> float:
    """The energy gap [%] with the largest magnitude; NaN if there is none."""
    values = run.scalars["energy_gap"]
    return 100 * float(values[np.nanargmax(np.abs(values))]) if np.isfinite(values).any() else math.nan


def headlines(comparison: Comparison) -> Headlines:
    """The verdict on each candidate with its maximum deviations, followed by the verdict on the reference with its expectations and
    doubts.
    """
    found = list[tuple[str, str, str]]()
    for run in comparison.candidates:
        ended = "" if run.outcome.status == "converged" else f"{run.outcome.status}; "
        found.append((run.name, comparison.word_of(run.name), ended + _greatest(comparison, run)))
    found.append(("reference", comparison.word_of("reference"), "; ".join([_checks(comparison), *comparison.doubts])))
    return tuple(found)


def _checks(comparison: Comparison) -> str:
    """The number of expectations of the reference that are met, in words."""
    words = [one.word for one in comparison.verdicts if one.expectation.of == "reference"]
    return f"{words.count('pass')} of {len(words)} expectations met" if words else "no expectations"


class VerdictRow(NamedTuple):
    """A row of the top table: a ``run``, its verdict (``word``), its headline ``measures`` (None if missing), and ``remarks``."""

    run: Run
    word: str
    measures: tuple[Measure | None, ...]
    remarks: tuple[str, ...]


def first_rows(comparison: Comparison) -> list[VerdictRow]:
    """The rows of the top table. The last row is that of the reference, with the doubts about the reference."""
    rows = list[VerdictRow]()
    for run in comparison.candidates:
        found = comparison.deviations.get(run.name, ())
        remarks = () if run.outcome.status == "converged" else (f"{run.outcome.status}: {run.outcome.message}",)
        measures = tuple(find(found, *key) for key in _headline_keys(comparison))
        rows.append(VerdictRow(run, comparison.word_of(run.name), measures, remarks))
    nothing = (None,) * len(_headline_keys(comparison))
    word = comparison.word_of("reference")
    before = "doubtful: " if word == "doubtful pass" else ""
    why = (_checks(comparison), *(f"{before}{one}" for one in comparison.doubts))
    return [*rows, VerdictRow(comparison.reference, word, nothing, why)]


def _headline_keys(comparison: Comparison) -> list[tuple[str, str]]:
    """The metric and statistic of each column of the top table: those headline statistics that at least one candidate has."""
    every = [one for run in comparison.candidates for one in comparison.deviations.get(run.name, ())]
    return [key for key in described("headline") if find(every, *key) is not None]


def first_columns(comparison: Comparison) -> list[str]:
    """The headings of the columns of numbers in the top table."""
    named = described("headline")
    return [f"{named[key].title}, {named[key].part}".strip(", ") for key in _headline_keys(comparison)]


def _greatest(comparison: Comparison, run: Run) -> str:
    """The maximum deviations of a candidate with the error bars of the reference, in words."""
    said = []
    for (metric, statistic), described_as in described("headline").items():
        one = find(comparison.deviations.get(run.name, ()), metric, statistic)
        if one is None:
            continue
        at = one.worst_number
        if at is None:
            continue
        lost = "" if at.index == one.worst.index else f", and not a number in frame {one.worst.frame}"
        bar = "" if at.error_bar is None else f" ± {number(at.error_bar)}"
        value = f"{number(at.value)}{bar} {one.unit}".strip()
        said.append(described_as.headline.format(value) + lost)
    return "; ".join(said) or "nothing could be measured"


def _sentence(comparison: Comparison) -> str:
    """A sentence on the comparison: the candidates, the frames, and the number of expectations that are met."""
    numbers, names = comparison.reference.numbers, [run.name for run in comparison.candidates]
    compared = f"{listed(names)} compared with the reference" if names else "The reference"
    words = [verdict.word for verdict in comparison.verdicts]
    met = f"{words.count('pass')} of {len(words)} expectations met" if words else "no expectations"
    alone = "" if names else ", without a candidate"
    solver = comparison.reference.solver
    return f"{compared} computed by {solver}, over {len(numbers)} frames ({numbers[0]} to {numbers[-1]}){alone}: {met}."
