"""A comparison as rows of numbers: the contents of measures.json and measures.csv."""

import csv
import io
from collections.abc import Iterable
from typing import Any

import numpy as np

from fem_reference.assessment import ranking, second_check
from fem_reference.assessment.comparison import Alone, Comparison
from fem_reference.assessment.error_bars import ErrorBar
from fem_reference.assessment.judge import Verdict, Word
from fem_reference.io.texts import finite, plain
from fem_reference.metrics import Measure, described
from fem_reference.runs.contents import scalar_vectors, vector_names
from fem_reference.runs.store import Run
from fem_reference.scenes.case import Case

MEASURES = "measures"  # the name of the files
COLUMNS = ("candidate", "metric", "statistic", "frame", "value", "unit")
# The columns of the first table: metric, statistic, heading of the group, heading of the column, unit.
DEVIATIONS = tuple((*key, one.title, one.part, one.unit) for key, one in described("table").items())

# Computed with the same springs at points of the surface and over facets of tetrahedra, on two hip muscles (gluteus_medius and
# gluteus_maximus) at 1 rad.
SPREAD = (
    "Attachments are springs, and 5 to 9 % of a force or moment depend on how the same springs are spread over them (5.3 and "
    "8.8 % for two hip muscles): error bars of forces and moments exclude this effect. It is reported as that of another model"
)


def summary(comparison: Comparison) -> dict[str, Any]:
    """All results of a comparison as valid JSON: a number that is not finite is None.

    ``measures``: the deviation of each candidate from the reference; rows of the ``"reference"`` are its change from rest, its
    recorded forces and its smallest det F. ``doubts``: the reasons to doubt the reference, in words. ``from_rest``: the change from
    rest of every run, with its forces. ``error_bars``: error bars of the reference; ``rankings``: solvers in order of each
    measure; both are empty without error bars. ``unsound``: the reasons why frames of candidates are not valid.
    """
    reference = comparison.reference
    deviations = [row for run in comparison.candidates for row in rows(run, comparison.deviations[run.name])]
    from_rest = {run.name: rows(run, (*comparison.changes[run.name], *exerted(run))) for run in comparison.runs}
    facts = _head(comparison.scene, reference, comparison.word) | {
        "doubts": comparison.doubts,
        "second_check": reference.origin.get(second_check.RECORD, {}),
        "mesh": plain(reference.origin.get("mesh", {})),
        "cost": {run.name: {key: finite(value) for key, value in run.outcome.cost.items()} for run in comparison.runs},
        "measures": from_rest[reference.name] + rows(reference, inversion(reference)) + deviations,
        "from_rest": [row for rows in from_rest.values() for row in rows],
        "verdicts": [_verdict(verdict) for verdict in comparison.verdicts],
        "error_bars": [row for bar in known(comparison) for row in _bar_rows(comparison, bar)],
        "rankings": ranking.facts(comparison.rankings),
        "unsound": comparison.unsound,
    }
    return facts | ({"convergence": plain(comparison.ladders)} if comparison.ladders else {})


def of_run(case: Case, run: Run, found: Alone) -> dict[str, Any]:
    """The result of a ``run`` without a comparison, with the keys of :func:`summary`."""
    return _head(case, run, found.word) | {
        "cost": {run.name: run.outcome.cost},
        "measures": rows(run, found.measures),
        "verdicts": [_verdict(verdict) for verdict in found.verdicts],
        "folder": str(run.folder),
    }


def _head(case: Case, run: Run, word: Word) -> dict[str, Any]:
    ended = {"status": run.outcome.status, "message": run.outcome.message}
    return {"case": case.name, "solver": run.solver, **ended, "verdict": word}


def as_csv(rows: Iterable[dict[str, Any]]) -> str:
    """Rows of ``COLUMNS`` as CSV text, with all digits; a number that is not finite is left empty."""
    text = io.StringIO()
    writer = csv.DictWriter(text, COLUMNS, lineterminator="\n")
    writer.writeheader()
    writer.writerows(rows)
    return text.getvalue()


def known(comparison: Comparison) -> tuple[ErrorBar, ...]:
    """The error bars of the reference; empty if there are none."""
    return () if comparison.error_bars is None else comparison.error_bars.bars


def spread(comparison: Comparison) -> str:
    """The sentence on the effect that error bars of forces exclude; empty without error bars of forces or without springs."""
    forces = any(bar.metric == "joint_moment" for bar in known(comparison))
    return SPREAD if forces and any(one.stiffness is not None for one in comparison.setup.attached) else ""


def inversion(run: Run) -> tuple[Measure, ...]:
    """The smallest det F [1] in each frame, if a solver recorded it (scalars ``min_det_F...``), as measures."""
    names = [name for name in run.scalars if name.startswith("min_det_F")]
    return tuple(Measure("inversion", name, "1", run.scalars[name]) for name in names)


def exerted(run: Run) -> tuple[Measure, ...]:
    """The recorded forces [N] and moments about the origin [N mm] on each bone as measures: the magnitude and the components."""
    found = list[Measure]()
    for kind, unit in {"force_on_": "N", "moment_on_": "N mm"}.items():
        parts = {name.removeprefix(kind): values for name, values in run.scalars.items() if name.startswith(kind)}
        whole = {
            bone: np.linalg.norm(scalar_vectors(run.scalars, kind, bone), axis=1)
            for bone in vector_names(run.scalars, kind)
        }
        found += [Measure(f"{kind}bone", name, unit, values) for name, values in (whole | parts).items()]
    return tuple(found)


def rows(run: Run, measures: Iterable[Measure]) -> list[dict[str, Any]]:
    """One row for each statistic and frame, as a dictionary with the keys ``COLUMNS``."""
    return [
        dict(zip(COLUMNS, (run.name, one.metric, one.statistic, number, finite(value), one.unit), strict=True))
        for one in measures
        for number, value in zip(run.numbers, one.values, strict=True)
    ]


def _bar_rows(comparison: Comparison, bar: ErrorBar) -> list[dict[str, Any]]:
    """One row for each frame of an error bar. The key ``model`` has the change of the statistic under another spring model."""
    columns = {"of": bar.of, "metric": bar.metric, "statistic": bar.statistic, "unit": bar.unit}
    model = [None] * len(bar.values) if bar.model is None else [finite(value) for value in bar.model]
    return [
        columns | {"frame": number, "value": finite(value), "model": other}
        for number, value, other in zip(comparison.reference.numbers, bar.values, model, strict=True)
    ]


def _verdict(verdict: Verdict) -> dict[str, Any]:
    expectation = verdict.expectation
    return {
        "verdict": verdict.word,
        **{name: getattr(expectation, name) for name in ("of", "metric", "statistic", "kind", "because")},
        **{name: getattr(verdict, name) for name in ("frame", "truth", "within", "unit")},
        "expected_at": expectation.frame,
        **plain({"value": verdict.value, "error_bar": verdict.error_bar}),
    }
