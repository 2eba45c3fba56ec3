"""The page of a comparison. It contains everything itself, and reads without a network."""

import base64
import json
import math
from dataclasses import dataclass
from functools import partial
from itertools import groupby
from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.colors import to_hex

from fem_reference.assessment.comparison import Comparison
from fem_reference.assessment.error_bars import ErrorBar, Of
from fem_reference.foundations.errors import InputError, MissingSoftware
from fem_reference.metrics import Measure, find
from fem_reference.report import gallery, pictures
from fem_reference.report.curves import curves, label_of
from fem_reference.report.tables import inversion, known, runs
from fem_reference.report.templates import template
from fem_reference.report.viewer import view
from fem_reference.report.words import listed, ratio, words
from fem_reference.runs.cost import seconds_per_frame
from fem_reference.runs.store import Run
from fem_reference.scenes import casefile
from fem_reference.scenes.case import Case

# The columns of the first table: metric, statistic, the words above a group and above the column, unit.
COLUMNS = (
    ("volume", "deviation", "Volume", "", "%"),
    ("fibre_length", "max", "Fibre length", "worst fibre", "mm"),
    ("fibre_length", "max_percent", "Fibre length", "worst fibre", "%"),
    ("surface_deviation", "rms", "Surface", "rms", "mm"),
    ("surface_deviation", "p95", "Surface", "95 % below", "mm"),
    ("surface_deviation", "max", "Surface", "worst vertex", "mm"),
    ("surface_deviation", "hausdorff", "Surface", "Hausdorff", "mm"),
    ("penetration", "deepest", "In bones", "deepest", "mm"),
)


@dataclass(frozen=True)
class Figure:
    """Two pictures of a run at a frame, ``top`` the greatest distance [mm] on its colour bar or None."""

    name: str
    number: int
    sources: tuple[str, str]
    top: float | None


def render(comparison: Comparison) -> str:
    """The whole page as text."""
    figures, missing = _figures(comparison)
    return template("page.html").render(
        comparison=comparison,
        scene=comparison.scene,
        reference=comparison.reference,
        runs=runs(comparison),
        sentence=_sentence(comparison),
        columns=COLUMNS,
        groups=[(group, len(list(kept))) for group, kept in groupby(COLUMNS, key=lambda column: column[2])],
        worst=worst,
        find=find,
        inversion=inversion,
        seconds_per_frame=seconds_per_frame,
        ratio=ratio,
        label_of=label_of,
        least=least,
        greatest=greatest,
        figures=figures,
        viewer=view(comparison),
        missing=missing,
        colours=_colours(),
        ticks=ticks,
        curves=curves(comparison),
        bars=known(comparison),
        bar_at=partial(_bar_at, comparison),
        rankings=comparison.rankings,
        parts=_parts(comparison),
        modelled=any(bar.model is not None for bar in known(comparison)),
        model_change=_model_change,
        variations=listed(_parts(comparison)[1:]) if _parts(comparison)[1:] else "",
        costs=_costs(comparison),
        changes=_changes(comparison.scene),
        origins=[(run, _flat(run.origin)) for run in runs(comparison)],
        scene_text=_scene_text(comparison.scene),
    )


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


def greatest(run: Run, scalar: str) -> float:
    """The greatest value of a scalar over the frames that have one, NaN without any."""
    values = run.scalars[scalar]
    return float(np.nanmax(values)) if np.isfinite(values).any() else float("nan")


def least(measure: Measure) -> float:
    """The smallest value of a measure over the frames where it is a number, NaN where it nowhere is."""
    known = measure.values[np.isfinite(measure.values)]
    return float(known.min()) if len(known) else math.nan


def _bar_at(comparison: Comparison, of: Of, metric: str, statistic: str, frame: int) -> float | None:
    """The error bar of a statistic at a frame number, None without any."""
    bars = comparison.error_bars
    found = None if bars is None else bars.find(of, metric, statistic)
    return None if bars is None or found is None else float(found.values[bars.numbers.index(frame)])


def _parts(comparison: Comparison) -> list[str]:
    """What was varied for the error bars, tetrahedra first."""
    return list(dict.fromkeys(name for bar in known(comparison) for name in bar.parts))


def _model_change(bar: ErrorBar) -> float | None:
    """The greatest change by another model over the frames that it reached, None without any."""
    known = np.zeros(0) if bar.model is None else bar.model[np.isfinite(bar.model)]
    return float(known.max()) if len(known) else None


def ticks(top: float) -> list[tuple[float, float]]:
    """Round values from 0 to ``top`` with their share of it, and ``top`` itself.

    >>> ticks(4.6)
    [(0.0, 0.0), (0.217, 1.0), (0.435, 2.0), (0.652, 3.0), (1.0, 4.6)]
    """
    if not top > 0:
        return [(0.0, 0.0)]
    power = 10.0 ** math.floor(math.log10(top / 2))
    step = next(power * factor for factor in (1, 2, 5, 10) if top / (power * factor) <= 6)
    values = [k * step for k in range(int(top / step) + 1) if k * step < 0.86 * top]
    return [(round(value / top, 3), value) for value in values] + [(1.0, top)]


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


def _figures(comparison: Comparison) -> tuple[list[Figure], str]:
    """The pictures, or none and what is missing."""
    wanted = gallery.shots(comparison)
    try:
        drawn = gallery.draw(comparison.setup, comparison.reference.surface, wanted)
    except MissingSoftware as error:
        return [], str(error)
    figures = []
    for shot, (first, second) in zip(wanted, drawn, strict=True):
        top = None if shot.distances is None else float(shot.distances.max())
        figures.append(Figure(shot.name, shot.number, (_source(first), _source(second)), top))
    return figures, ""


def _source(picture: bytes) -> str:
    return f"data:image/webp;base64,{base64.b64encode(picture).decode()}"


def _colours() -> str:
    """The colour map of the pictures as the stops of a CSS gradient."""
    return ", ".join(to_hex(colour) for colour in mpl.colormaps[pictures.COLOURS](np.linspace(0, 1, 17)))


def _costs(comparison: Comparison) -> list[tuple[str, str, list[float | None]]]:
    """What each kind of cost was for every run: name, unit, values; times first."""
    keys = dict.fromkeys(key for run in runs(comparison) for key in run.outcome.cost)
    times = [key for key in keys if key.startswith("seconds")]
    rows = [("in all" if key == "seconds" else words(key.removeprefix("seconds_")), "s", key) for key in times]
    rows += [(words(key), "", key) for key in keys if key not in times]
    return [(name, unit, [run.outcome.cost.get(key) for run in runs(comparison)]) for name, unit, key in rows]


def _flat(table: Any, key: str = "") -> list[tuple[str, Any]]:
    """Every (key, value) below ``table``, keys joined by dots."""
    if isinstance(table, dict):
        return [entry for name, value in table.items() for entry in _flat(value, f"{key}.{name}".lstrip("."))]
    return [(key, table if isinstance(table, str | float | int | None) else json.dumps(table, default=str))]


def _changes(scene: Case) -> list[tuple[str, Any, Any]]:
    """Where the scene differs from its file: key, value in the file, value here."""
    if not scene.place.endswith(".toml"):  # made without a file
        return []
    try:
        in_file = dict(_flat(_table(casefile.read(scene.place))))
    except InputError as error:
        return [("the scene file", "not readable any more", str(error))]
    here = dict(_flat(_table(scene)))
    return [
        (key, in_file.get(key, ""), here.get(key, "")) for key in in_file | here if in_file.get(key) != here.get(key)
    ]


def _table(scene: Case) -> dict[str, Any]:
    """The scene as nested tables, entries of a list by their number."""
    listed_effects = {"effect": [effect.model_dump(mode="json") for effect in scene.effects]}
    return dict(_numbered(scene.model_dump(mode="json", exclude={"folder", "effect"}) | listed_effects))


def _numbered(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _numbered(inside) for key, inside in value.items()}
    if isinstance(value, list):
        return {f"[{i}]": _numbered(inside) for i, inside in enumerate(value)}
    return value


def _scene_text(scene: Case) -> str:
    path = Path(scene.place)
    return path.read_text(encoding="utf-8") if path.is_file() else ""
