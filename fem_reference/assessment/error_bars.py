"""Error bars: solved again with coarser numerics, the reference gives every statistic a bar, frame by frame.

In the measures that runs are measured with, and of two things: of the reference's own change from rest, by how much the changes of
its runs differ; and of a candidate's deviation from the reference, by how much the reference's runs deviate from each other: by the
triangle inequality, replacing the reference by another changes a deviation by at most that.
"""

import json
import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path
from typing import Literal, get_args

import numpy as np

from fem_reference.foundations.errors import InputError
from fem_reference.foundations.mesh import Floats
from fem_reference.io import files, texts
from fem_reference.metrics import Measure, MeasurementContext, at_rest, find, measure, names, of_itself
from fem_reference.runs.store import Run

Of = Literal["change", "deviation"]
FILE = "error_bar.json"
FORMAT = 2
# Of a grid convergence index (Roache 1998, Verification and Validation in Computational Science, ch. 5).
SAFETY = 1.25
# What is left of an error of first order, when halving its cause changes the result by 1.
VARIATION = 2.0
TETRAHEDRA = "tetrahedra"
# The measures of a run against another or (None) its rest.
_Measured = Callable[[Run, Run | None], tuple[Measure, ...]]


@dataclass(frozen=True, eq=False)
class ErrorBar:
    """How far one statistic may be from the truth because the reference is: ``values`` (f,) in ``unit`` by frame, NaN where nobody
    knows; ``of`` the reference's own change from rest, or of a candidate's deviation from the reference. ``parts``: by cause, the
    greatest over the frames that it adds.

    ``model`` (f,), where attachments are springs: by how much exact ones change the statistic. That is another model and no error
    of this one, so that it is no part of ``values``.
    """

    of: Of
    metric: str
    statistic: str
    unit: str
    values: Floats
    parts: dict[str, float]
    model: Floats | None = None

    @property
    def worst(self) -> int:
        """Index of the frame with the greatest bar; one that is not known counts as greatest of all."""
        return int(np.argmax(np.where(np.isnan(self.values), np.inf, self.values)))


@dataclass(frozen=True, eq=False)
class ErrorBars:
    """The error bars of a reference over frame ``numbers`` (f,), from tetrahedra of ``sizes`` [mm], the reference's own first; the
    error is taken to be of the ``order`` in them, in general.
    """

    numbers: tuple[int, ...]
    sizes: tuple[float, float]
    order: float
    bars: tuple[ErrorBar, ...]

    def find(self, of: Of, metric: str, statistic: str) -> ErrorBar | None:
        """The bar of that statistic, None where there is none."""
        wanted = (of, metric, statistic)
        return next((bar for bar in self.bars if (bar.of, bar.metric, bar.statistic) == wanted), None)

    @property
    def of_deviations(self) -> tuple[Measure, ...]:
        """The error bars of deviations from the reference, as measures."""
        return tuple(
            Measure(bar.metric, bar.statistic, bar.unit, bar.values) for bar in self.bars if bar.of == "deviation"
        )


@dataclass(frozen=True)
class Orders:
    """Of which order in the size of tetrahedra the error of a statistic is at least: in ``general``; of the ``volume``, which is
    nearly kept; of lengths of ``fibres``, which end where attachments do; and of those of the ``worst`` place alone: next to the
    rim of an attachment displacement converges more slowly than elsewhere.
    """

    general: float
    volume: float
    fibres: float
    worst: float

    def of(self, of: Of, metric: str, statistic: str) -> float:
        """The order for a statistic of changes or of deviations. What fibres lengthen by on average, surfaces that are near each
        other agree on as they do on all else.
        """
        if is_local(statistic):
            return self.worst
        if metric == "volume":
            return self.volume
        mean_of_surfaces = of == "deviation" and statistic.startswith("mean")
        return self.fibres if metric == "fibre_length" and not mean_of_surfaces else self.general


@dataclass(frozen=True, eq=False)
class Pair:
    """Runs of the reference over the same frames: ``fine``, itself, and ``coarse`` on larger tetrahedra; by name the ``varied``
    ones, each as ``coarse`` with one cause of error halved; and one with ``exact`` attachments, where they are springs.

    ``sizes`` [mm] are those of the tetrahedra, and the error is of the ``orders`` in them, with a ``safety``.
    """

    fine: Run
    coarse: Run
    sizes: tuple[float, float]
    orders: Orders
    varied: dict[str, Run]
    exact: Run | None = None
    safety: float = SAFETY

    def share(self, of: Of, metric: str, statistic: str) -> float:
        """The error of the fine run over what the two differ by, with the safety of a grid convergence index."""
        order = self.orders.of(of, metric, statistic)
        return float(self.safety / ((self.sizes[1] / self.sizes[0]) ** order - 1))


def error_bars(pair: Pair, context: MeasurementContext) -> ErrorBars:
    """The bars of every statistic of every metric, of changes and of deviations: what the tetrahedra and the variations add. What
    is said of a run itself has none: it is known.
    """
    comparing = [name for name in names() if not of_itself(name)]

    @cache
    def measured(run: Run, other: Run | None) -> tuple[Measure, ...]:
        return measure(run, at_rest(run) if other is None else other, context, comparing)

    def apart(run: Run, other: Run) -> Floats:
        found = find(measured(run, other), "surface_deviation", "rms")
        assert found is not None  # both have surfaces
        return found.values

    bars = []
    fine, coarse, *others = (_surface(run) for run in (pair.fine, pair.coarse, *pair.varied.values()))
    gaps = {name: apart(run, coarse) for name, run in zip(pair.varied, others, strict=True)}
    # By what a bar is of, what the runs differ by: the reference's own change sees its fibres inside, candidates are surfaces.
    near: dict[Of, list[Floats]] = {
        "change": _of_changes(pair.coarse, pair.fine, measured),
        "deviation": _of_deviations(coarse, fine, measured),
    }
    varied: dict[Of, dict[str, list[Floats]]] = {
        "change": {name: _of_changes(run, pair.coarse, measured) for name, run in pair.varied.items()},
        "deviation": {
            name: _of_deviations(run, coarse, measured) for name, run in zip(pair.varied, others, strict=True)
        },
    }
    exact: dict[Of, list[Floats]] = {}
    if pair.exact is not None:
        exact["change"] = _of_changes(pair.exact, pair.coarse, measured)
        exact["deviation"] = _of_deviations(_surface(pair.exact), coarse, measured)
    for of, differences in near.items():
        for i, one in enumerate(measured(fine, fine)):
            # The worst places of two runs may be others: by the triangle inequality, what the runs differ by bounds the change too.
            found = differences[i]
            if is_local(one.statistic):
                found = np.fmax(np.abs(found), np.abs(near["deviation"][i]))
            parts = {TETRAHEDRA: pair.share(of, one.metric, one.statistic) * typical(found, apart(coarse, fine))}
            parts |= {name: VARIATION * typical(other[i], gaps[name]) for name, other in varied[of].items()}
            greatest = {name: float(part.max()) for name, part in parts.items()}
            model = np.abs(exact[of][i]) if of in exact else None
            total = np.sqrt(np.sum([part**2 for part in parts.values()], axis=0))  # of causes that are independent
            bars.append(ErrorBar(of, one.metric, one.statistic, one.unit, total, greatest, model))
    return ErrorBars(pair.fine.numbers, pair.sizes, pair.orders.general, tuple(bars))


def is_local(statistic: str) -> bool:
    """Whether a ``statistic`` is that of the worst place, or of the worst fibre, alone."""
    return statistic.startswith(("max", "hausdorff"))


def typical(differences: Floats, apart: Floats) -> Floats:
    """The size (f,) of signed ``differences`` (f,) of a statistic between two runs whose surfaces are ``apart`` (f,) [mm]: at least
    what it is for surfaces so far apart on average over the frames. A difference that crosses zero says nothing about the error
    there; where the surfaces are the same it is 0.
    """
    known = np.isfinite(differences) & np.isfinite(apart)
    squares = float(apart[known] @ apart[known])
    ratio = math.sqrt(float(differences[known] @ differences[known]) / squares) if squares > 0 else 0.0
    return np.maximum(np.abs(differences), ratio * apart)


def _surface(run: Run) -> Run:
    """The run as candidates are: a surface without an interior, so that lengths go through the measurement context's extension."""
    return replace(run, fibres=None, fibre_positions=None)


def _of_changes(run: Run, other: Run, measured: _Measured) -> list[Floats]:
    """By how much (f,) each statistic of the change from rest of ``run`` is more than that of ``other``."""
    return [one.values - same.values for one, same in zip(measured(run, None), measured(other, None), strict=True)]


def _of_deviations(run: Run, other: Run, measured: _Measured) -> list[Floats]:
    """By how much (f,) each statistic of ``other`` against ``run`` is more than against itself: what becomes of a deviation when
    the reference is another.
    """
    return [one.values - same.values for one, same in zip(measured(other, run), measured(other, other), strict=True)]


def save(bars: ErrorBars, folder: Path, of: dict[str, str]) -> None:
    """Store error bars beside the run that they are of.

    Parameters
    ----------
    bars
        What is stored.
    folder
        Of the run.
    of
        What they are good for, by name: they are not read again where any of it is another.

    """
    rows = [
        {"of": bar.of, "metric": bar.metric, "statistic": bar.statistic, "unit": bar.unit}
        | {"values": [_null(value) for value in bar.values]}
        | {"parts": {name: _null(value) for name, value in bar.parts.items()}}
        | {"model": None if bar.model is None else [_null(value) for value in bar.model]}
        for bar in bars.bars
    ]
    table = {
        "format": FORMAT,
        "of": of,
        "numbers": bars.numbers,
        "sizes_mm": bars.sizes,
        "order": bars.order,
        "bars": rows,
    }
    files.write_text(folder / FILE, json.dumps(table, indent=1, allow_nan=False))


def load(folder: Path, of: dict[str, str]) -> ErrorBars | None:
    """The bars stored in ``folder``; None where there are none for what ``of`` names, InputError where the file is damaged."""
    place = folder / FILE
    if not place.exists():
        return None
    try:
        table = texts.read_json(place, "the error bar of a stored run (--error-bar makes it anew)")
        if table["format"] != FORMAT or table["of"] != of:
            return None
        numbers = tuple(int(number) for number in table["numbers"])
        bars = tuple(_bar(row, len(numbers)) for row in table["bars"])
        fine, coarse = (float(size) for size in table["sizes_mm"])
        return ErrorBars(numbers, (fine, coarse), float(table["order"]), bars)
    except (ValueError, KeyError, TypeError, AttributeError, OverflowError) as error:
        raise InputError(place, repr(error), "the error bar of a stored run (--error-bar makes it anew)") from error


def _bar(row: dict[str, object], frames: int) -> ErrorBar:
    values = np.array(_numbers(row["values"]))
    parts, model = row["parts"], row["model"]
    band = None if model is None else np.array(_numbers(model))
    if any(one is not None and one.shape != (frames,) for one in (values, band)) or row["of"] not in get_args(Of):
        raise ValueError(f"the bar of {row['metric']}.{row['statistic']}")
    if not isinstance(parts, dict):
        raise TypeError("no parts by name")
    greatest = dict(zip(parts, _numbers(list(parts.values())), strict=True))
    metric, statistic, unit = (str(row[key]) for key in ("metric", "statistic", "unit"))
    return ErrorBar(row["of"], metric, statistic, unit, values, greatest, band)  # type: ignore[arg-type]


def _numbers(values: object) -> list[float]:
    if not isinstance(values, Iterable):
        raise TypeError("no list of numbers")
    return [math.nan if value is None else float(value) for value in values]


def _null(value: float) -> float | None:
    return float(value) if math.isfinite(value) else None
