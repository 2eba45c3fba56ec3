"""The page of a comparison."""

import math
from collections import Counter
from functools import partial
from typing import Any

import numpy as np

from fem_reference.assessment import reached
from fem_reference.assessment.comparison import Comparison
from fem_reference.assessment.doubts import doubts
from fem_reference.assessment.error_bars import Of
from fem_reference.assessment.judge import overall
from fem_reference.metrics import Measure, find
from fem_reference.report import gallery
from fem_reference.report.at_frames import columns, label
from fem_reference.report.curves import curves, label_of
from fem_reference.report.drawings import colour_of
from fem_reference.report.pages import Headlines, Page
from fem_reference.report.sections import facts_of, sections
from fem_reference.report.sections.origin import changes
from fem_reference.report.tables import DEVIATIONS, MEASURES, as_csv, known, summary
from fem_reference.report.templates import template
from fem_reference.report.viewer import view
from fem_reference.report.words import listed, number, ratio
from fem_reference.runs.cost import seconds_per_frame
from fem_reference.runs.store import Run

# The deviations of a candidate in its headline, and their words.
_HEADLINE = (
    ("surface_deviation", "rms", "surface off by up to {} rms"),
    ("fibre_length", "rms_percent", "lengths of fibres by {} rms"),
    ("volume", "deviation", "volume by {}"),
)


def page(comparison: Comparison) -> Page:
    """The page of a comparison; of a reference that failed, over the frames that it reached."""
    numbers, failed = summary(comparison), _failed(comparison)
    nothing, comparison = not len(reached.frames(comparison.reference)), reached.cut(comparison)
    shared, said = _shared(comparison), headlines(comparison)
    shown = [
        template(f"sections/{name}.html").render(shared | facts_of(name, comparison))
        for name, section in sections().items()
        if section.has_numbers(comparison) and not (nothing and section.of_reference)
    ]
    contents = shared | {
        "sentence": _sentence(comparison),
        "headlines": said,
        "failed": failed,
        "key": _key(comparison),
        "sections": shown,
        "nothing": nothing,
    }
    name, rows = "comparison_page.html", as_csv(numbers["measures"])
    return Page("comparison", comparison.scene.title, said, name, contents, numbers, rows, MEASURES)


def _failed(comparison: Comparison) -> str:
    """The reason why the reference did not reach all frames, and what the page shows then; empty where it did."""
    reference, wanted = comparison.reference, len(comparison.reference.numbers)
    if reference.outcome.status == "converged":
        return ""
    kept = reached.frames(reference)
    why = f"{reference.outcome.message.rstrip('.')}."
    if not len(kept):
        return f"{why} No frame was reached, so that nothing could be measured against it."
    if reference.outcome.status == "denied":
        return f"{why} What follows is measured against no truth."
    last = label(comparison.scene, comparison.setup, reference.numbers[kept[-1]])
    return f"{why} {len(kept)} of {wanted} frames were reached, up to {last}: what follows is about these."


def _key(comparison: Comparison) -> dict[str, Any]:
    """The key to the page: colours of the curves, and the frames at both ends."""
    names = [run.name for run in comparison.runs]
    numbers = comparison.reference.numbers
    ends = [label(comparison.scene, comparison.setup, number) for number in (numbers[0], numbers[-1])]
    return {"colours": list(zip(names, map(colour_of, range(len(names))), strict=True)), "ends": ends}


def _shared(comparison: Comparison) -> dict[str, Any]:
    """The contents that all templates of the page share."""
    error = comparison.extension_error
    return {
        "comparison": comparison,
        "scene": comparison.scene,
        "reference": comparison.reference,
        "runs": comparison.runs,
        "columns": DEVIATIONS,
        "groups": Counter(group for _, _, group, _, _ in DEVIATIONS),
        "curves": curves,
        "bars": known(comparison),
        "bar_at": partial(_bar_at, comparison),
        "error": error and worst(comparison.reference, error),
        "viewer": view(comparison),
        "colours": gallery.ramp(),
        "worst": worst,
        "find": find,
        "ratio": ratio,
        "label_of": label_of,
        "label": partial(label, comparison.scene, comparison.setup),
        "frame_columns": columns(comparison.scene, comparison.setup),
        "changes": changes(comparison.scene),
        "seconds_per_frame": seconds_per_frame,
    }


def worst(run: Run, measure: Measure) -> dict[str, Any]:
    """A measure at its worst frame: ``value``, ``frame`` number and ``where`` in words.

    Where that value is not a number, ``finite`` is the worst (value, frame) of the frames where it is one, else None.
    """
    i = measure.worst
    known = np.flatnonzero(np.isfinite(measure.values))
    finite = None
    if len(known) and not np.isfinite(measure.values[i]):
        k = known[np.argmax(np.abs(measure.values[known]))]
        finite = (float(measure.values[k]), run.numbers[k])
    where = measure.where[i] if measure.where else ""
    return {"value": float(measure.values[i]), "frame": run.numbers[i], "where": where, "finite": finite}


def _bar_at(comparison: Comparison, of: Of, metric: str, statistic: str, frame: int) -> float | None:
    """The error bar of a statistic at a frame number, None without any."""
    bars = comparison.error_bars
    found = None if bars is None else bars.find(of, metric, statistic)
    return None if bars is None or found is None else float(found.values[bars.numbers.index(frame)])


def headlines(comparison: Comparison) -> Headlines:
    """The verdict on each candidate, "not judged" where nothing is expected of it, with its greatest deviations; then the
    reference's own checks, and what makes it doubtful.
    """
    found = list[tuple[str, str, str]]()
    for run in comparison.candidates:
        words = [one.word for one in comparison.verdicts if one.expectation.of == run.name]
        ended = "" if run.outcome.status == "converged" else f"{run.outcome.status}; "
        found.append((run.name, overall(words) if words else "not judged", ended + _greatest(comparison, run)))
    words = [one.word for one in comparison.verdicts if one.expectation.of == "reference"]
    checks = f"{words.count('pass')} of {len(words)} of its own checks met" if words else "nothing is expected of it"
    word: str = overall(words) if words else "not judged"
    if comparison.reference.outcome.status != "converged":  # whatever of it was met
        word = "fail"
    doubtful = doubts(comparison.reference)
    if word == "pass" and doubtful:
        word = "doubtful pass"
    found.append(("reference", word, "; ".join([checks, *doubtful])))
    return tuple(found)


def _greatest(comparison: Comparison, run: Run) -> str:
    """The greatest deviations of a candidate, with the error bars of the reference."""
    said = []
    for metric, statistic, words in _HEADLINE:
        one = find(comparison.deviations.get(run.name, ()), metric, statistic)
        if one is None:
            continue
        at = worst(run, one)
        lost = "" if at["finite"] is None else f", and not a number in frame {at['frame']}"
        value, frame = at["finite"] or (at["value"], at["frame"])
        if not math.isfinite(value):
            continue
        bar = _bar_at(comparison, "deviation", metric, statistic, frame)
        value = f"{number(value)}{f' ± {number(bar)}' if bar is not None else ''} {one.unit}".strip()
        said.append(words.format(value) + lost)
    return "; ".join(said) or "nothing of it can be measured"


def _sentence(comparison: Comparison) -> str:
    numbers, names = comparison.reference.numbers, [run.name for run in comparison.candidates]
    over = f"over {len(numbers)} frames ({numbers[0]} to {numbers[-1]})"
    outcomes = [verdict.word for verdict in comparison.verdicts]
    judged = f"{outcomes.count('pass')} of {len(outcomes)} expectations met"
    if names and all(verdict.expectation.of == "reference" for verdict in comparison.verdicts):
        solver = comparison.reference.solver
        what = f"{listed(names)} compared with the reference computed by {solver}, {over}"
        return f"{what}. The verdict is on the reference ({judged}): what candidates do is measured, not judged."
    unjudged = [name for name in names if all(verdict.expectation.of != name for verdict in comparison.verdicts)]
    those = "a candidate" if len(unjudged) == len(names) else listed(unjudged)
    judged += f"; none concerns {those}: measured, not judged." if unjudged else "."
    solver = comparison.reference.solver
    if not names:
        return f"The reference computed by {solver}, {over}, without a candidate: {judged}"
    return f"{listed(names)} compared with the reference computed by {solver}, {over}: {judged}"
