"""The page of a comparison. It contains everything itself, and reads without a network."""

from functools import partial
from typing import Any

from fem_reference.assessment.comparison import Comparison
from fem_reference.metrics import described, find
from fem_reference.report import reached
from fem_reference.report.at_frames import columns, label
from fem_reference.report.curves import colour_of, label_of
from fem_reference.report.sections import sections
from fem_reference.report.sections.origin import changes
from fem_reference.report.sections.pictures import ramp
from fem_reference.report.tables import DEVIATIONS, known, runs
from fem_reference.report.templates import template
from fem_reference.report.viewer import view
from fem_reference.report.words import listed, number, ratio
from fem_reference.runs.cost import seconds_per_frame
from fem_reference.runs.store import Run


def render(comparison: Comparison) -> str:
    """The whole page as text; of a reference that failed, over the frames that it reached."""
    nothing = not len(reached.frames(comparison.reference))
    failed, comparison = _failed(comparison), reached.cut(comparison)
    shared = _shared(comparison)
    shown = [
        template(f"sections/{name}.html").render(shared | section.facts(comparison))
        for name, section in sections().items()
        if section.has_numbers(comparison) and not (nothing and section.of_reference)
    ]
    head = {"sentence": _sentence(comparison), "headlines": headlines(comparison), "failed": failed}
    return template("page.html").render(
        shared | head | {"key": _key(comparison), "sections": shown, "nothing": nothing}
    )


def _failed(comparison: Comparison) -> str:
    """Why the reference did not reach all frames, and what the page shows then; empty where it did."""
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
    """How to read the page: colours of the curves, frames, and what was set otherwise than in the file of the case."""
    names = [run.name for run in comparison.runs]
    numbers = comparison.reference.numbers
    ends = [label(comparison.scene, comparison.setup, number) for number in (numbers[0], numbers[-1])]
    return {"colours": list(zip(names, map(colour_of, range(len(names))), strict=True)), "ends": ends}


def _shared(comparison: Comparison) -> dict[str, Any]:
    """What every template of the page is filled with."""
    return {
        "comparison": comparison,
        "scene": comparison.scene,
        "reference": comparison.reference,
        "runs": runs(comparison),
        "columns": DEVIATIONS,
        "bars": known(comparison),
        "error": comparison.extension_error and comparison.extension_error.worst,
        "viewer": view(comparison),
        "colours": ramp(),
        "find": find,
        "ratio": ratio,
        "label_of": label_of,
        "label": partial(label, comparison.scene, comparison.setup),
        "frame_columns": columns(comparison.scene, comparison.setup),
        "changes": changes(comparison.scene),
        "seconds_per_frame": seconds_per_frame,
    }


def headlines(comparison: Comparison) -> list[tuple[str, str, str]]:
    """What was asked: by candidate its verdict, "not judged" where nothing is expected of it, and its greatest deviations; then the
    reference's own checks, and what makes it doubtful.
    """
    found = list[tuple[str, str, str]]()
    for run in comparison.candidates:
        ended = "" if run.outcome.status == "converged" else f"{run.outcome.status}; "
        found.append((run.name, comparison.word_of(run.name), ended + _greatest(comparison, run)))
    words = [one.word for one in comparison.verdicts if one.expectation.of == "reference"]
    checks = f"{words.count('pass')} of {len(words)} of its own checks met" if words else "nothing is expected of it"
    found.append(("reference", comparison.word_of("reference"), "; ".join([checks, *comparison.doubts])))
    return found


def _greatest(comparison: Comparison, run: Run) -> str:
    """The greatest deviations of a candidate, with the error bars of the reference."""
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
