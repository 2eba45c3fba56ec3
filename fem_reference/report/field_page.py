"""The page of scalar examples, compared with section 4.6 of the report."""

import tomllib
from pathlib import Path
from typing import Any

import numpy as np

from fem_reference.assessment.comparison import Comparison
from fem_reference.assessment.judge import overall
from fem_reference.report import field_figures
from fem_reference.report.pages import Page, by_name
from fem_reference.report.tables import MEASURES, as_csv, summary
from fem_reference.report.words import number
from fem_reference.runs.store import Run

AGREE = 1e-9  # a difference below this fraction of the maximum is due to rounding


def page(title: str, examples: tuple[Comparison, ...]) -> Page:
    """The page of several scalar examples, with the table of differences between the text and the listings of the report."""
    words = [one.word for one in examples]
    said = (("", overall(words), f"{words.count('pass')} of {len(words)} pass"),)
    contents = _contents(examples) | {"differences": _section()["difference"]}
    return Page("examples", title, said, "field_page.html", contents)


def comparison_page(example: Comparison) -> Page:
    """The page of one scalar example."""
    said = (("", example.word, apart(example)),)
    numbers, title = summary(example), example.scene.title
    contents, rows = _contents((example,)), as_csv(numbers["measures"])
    return Page("comparison", title, said, "field_page.html", contents, numbers, rows, MEASURES)


def _contents(examples: tuple[Comparison, ...]) -> dict[str, Any]:
    return {
        "examples": examples,
        "word": overall(example.word for example in examples),
        "differences": (),
        "figures_of_report": _section()["figure"],
        **by_name(apart, bounds, seconds, pivot, form, field_figures.drawings, field_figures.convergence),
    }


def _section() -> dict[str, list[dict[str, str]]]:
    """The tables of the file ``octave_section.toml``, which is about section 4.6 of the report.

    Each ``difference`` has the ``section``, the ``text``, the ``listing`` and the ``measured`` effect. Each ``figure`` has its
    ``case`` and its ``caption``; the pictures of the report are not distributed.
    """
    return tomllib.loads(Path(__file__).with_name("octave_section.toml").read_text(encoding="utf-8"))


def apart(example: Comparison) -> str:
    """A sentence on the difference at the vertices between the listing (or first candidate) and the solution of the equation."""
    other, reference = field_figures.rival(example), example.reference
    if other is None:
        return "there is only a reference, and no candidate."
    name = f"the {other.name}" if other.solver == "listing" else other.name
    for run, called in ((other, name), (reference, "the reference")):
        if not np.isfinite(run.vertex_values[-1]).all():
            return f"{called} has values that are not finite, so the two solutions cannot be compared."
    distance = float(np.abs(other.vertex_values[-1] - reference.vertex_values[-1]).max())
    size = float(np.abs(reference.vertex_values[-1]).max())
    if distance <= AGREE * size:
        return f"{name} and the equation agree; their maximum difference at a vertex is {number(distance)}."
    (low, high), (least, greatest) = bounds(other), bounds(reference)
    compared = (
        f"{number(distance / size)} times the maximum of the equation's solution"
        if size
        else "and the equation gives zero"
    )
    return (
        f"{name} gives {number(low)} to {number(high)}, the equation {number(least)} to {number(greatest)}; "
        f"their maximum difference at a vertex is {number(distance)}, {compared}."
    )


def bounds(run: Run) -> tuple[float, float] | tuple[None, None]:
    """The minimum and the maximum over the vertices: NaN if a value is NaN, and None if, in addition, the run failed."""
    if _lost(run):
        return None, None
    return float(run.vertex_values[-1].min()), float(run.vertex_values[-1].max())


def _lost(run: Run) -> bool:
    """True for a run that failed and has a value that is not finite."""
    return run.outcome.status != "converged" and not np.isfinite(run.vertex_values[-1]).all()


def seconds(run: Run) -> float | None:
    """The time [s] that a run took; None if the run does not state it."""
    cost = run.outcome.cost
    parts = [value for key, value in cost.items() if key.startswith("seconds_")]
    return sum(parts) if parts else cost.get("seconds")


def form(example: Comparison, run: Run) -> str:
    """The weak form that was solved: the form that the run states or, without one, the form of the problem."""
    return str(run.origin.get("form", example.setup.form))


def pivot(example: Comparison) -> dict[str, list[float | None]]:
    """The values of all runs by metric, with None for a run without a value; empty if the reference failed."""
    if _lost(example.reference):
        return {}
    measured = {"reference": example.changes["reference"]} | example.deviations
    found = {(one.metric, name): float(one.values[-1]) for name, measures in measured.items() for one in measures}
    names = dict.fromkeys(metric for metric, _ in found)
    return {name: [found.get((name, run.name)) for run in example.runs] for name in names}
