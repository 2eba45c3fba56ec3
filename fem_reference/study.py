"""How well the reference is known: solved again with other numerics, it gives every statistic an error bar, frame by frame.

Told in the measures that runs are measured with, and of two things: of the reference's own change from rest, by how much the
changes of its runs differ; and of a candidate's deviation from the reference, by how much the reference's runs deviate from each
other: by the triangle inequality, replacing the reference by another changes a deviation by at most that.
"""

import json
import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path
from typing import Literal, get_args

import numpy as np
from scipy.optimize import brentq

from fem_reference import files
from fem_reference.errors import InputError
from fem_reference.mesh import Floats
from fem_reference.metrics import Measure, Yardstick, at_rest, measure, names, of_itself
from fem_reference.runs import Run

Of = Literal["change", "deviation"]
Course = Literal["converges", "oscillates", "does not converge", "equal", "not known"]
FILE = "error_bar.json"
FORMAT = 1
# Of a grid convergence index over three meshes (Roache 1998, Verification and Validation in Computational Science, ch. 5).
SAFETY = 1.25
# At the rim of what a bone holds, where a held and a free surface meet, displacement goes with the root of the distance (Grisvard
# 1985, Elliptic Problems in Nonsmooth Domains): an error of first order, whatever the degree. A higher observed order is no ground
# for a smaller bar; below the lowest one none is seen.
LOWEST_ORDER, HIGHEST_ORDER = 0.5, 1.0
# What is left of an error of first order, when halving its cause changes the result by 1.
VARIATION = 2.0
_SIZES = "tetrahedra"
# The measures of a run against another or (None) its rest, and what two runs differ by in each of them.
_Measured = Callable[[Run, Run | None], tuple[Measure, ...]]
_Differences = Callable[[Run, Run, _Measured], list[Floats]]


@dataclass(frozen=True, eq=False)
class ErrorBar:
    """How far one statistic may be from the truth because the reference is: ``values`` (f,) in ``unit`` by frame, NaN where nobody
    knows; ``of`` the reference's own change from rest, or of a candidate's deviation from the reference.

    ``order`` is the observed order of convergence over the sizes of tetrahedra, NaN without one, and ``course`` how the sizes
    behave. ``parts``: by what was varied, the greatest over the frames that it adds.
    """

    of: Of
    metric: str
    statistic: str
    unit: str
    values: Floats
    order: float
    course: Course
    parts: dict[str, float]

    @property
    def worst(self) -> int:
        """Index of the frame with the greatest bar; one that is not known counts as greatest of all."""
        return int(np.argmax(np.where(np.isnan(self.values), np.inf, self.values)))


@dataclass(frozen=True, eq=False)
class ErrorBars:
    """The error bars of a reference over frame ``numbers`` (f,), from tetrahedra of ``sizes`` [mm], the reference's own first."""

    numbers: tuple[int, ...]
    sizes: tuple[float, ...]
    bars: tuple[ErrorBar, ...]

    def find(self, of: Of, metric: str, statistic: str) -> ErrorBar | None:
        """The bar of that statistic, None where there is none."""
        wanted = (of, metric, statistic)
        return next((bar for bar in self.bars if (bar.of, bar.metric, bar.statistic) == wanted), None)


@dataclass(frozen=True, eq=False)
class Ladder:
    """Runs of the reference over the same frames: ``runs`` on three sizes of tetrahedra, finest first, and by name the ``varied``
    ones, each with one cause of error halved on the coarsest of the sizes.

    ``sizes`` [mm] are those wanted, ``lengths`` [mm] those that the meshes have (the cube root of volume per tetrahedron).
    """

    runs: tuple[Run, Run, Run]
    sizes: tuple[float, float, float]
    lengths: tuple[float, float, float]
    varied: dict[str, Run]


def error_bars(ladder: Ladder, yardstick: Yardstick) -> ErrorBars:
    """The bars of every statistic of every metric, of changes and of deviations: that of the sizes and what variations add. What
    is said of a run itself has none: it is known.
    """
    fine, medium, coarse = (_surface(run) for run in ladder.runs)
    others = {name: _surface(run) for name, run in ladder.varied.items()}

    comparing = [name for name in names() if not of_itself(name)]

    @cache
    def measured(run: Run, other: Run | None) -> tuple[Measure, ...]:
        return measure(run, at_rest(run) if other is None else other, yardstick, comparing)

    bars = []
    kinds: tuple[tuple[Of, _Differences], ...] = (("change", _of_changes), ("deviation", _of_deviations))
    for of, differences in kinds:
        near, far = differences(medium, fine, measured), differences(coarse, medium, measured)
        varied = {name: differences(run, coarse, measured) for name, run in others.items()}
        for i, one in enumerate(measured(fine, fine)):
            values, order, course = of_sizes(near[i], far[i], ladder.lengths, rounding(one.unit))
            parts = {_SIZES: values} | {name: VARIATION * np.abs(found[i]) for name, found in varied.items()}
            greatest = {name: float(part.max()) for name, part in parts.items()}
            total = np.sum(list(parts.values()), axis=0)
            bars.append(ErrorBar(of, one.metric, one.statistic, one.unit, total, order, course, greatest))
    return ErrorBars(fine.numbers, ladder.sizes, tuple(bars))


def _surface(run: Run) -> Run:
    """The run without its fibres: those traced in other tetrahedra are others, while the yardstick's extension serves all alike."""
    return replace(run, fibres=None, fibre_positions=None)


def _of_changes(run: Run, other: Run, measured: _Measured) -> list[Floats]:
    """By how much (f,) each statistic of the change from rest of ``run`` is more than that of ``other``."""
    return [one.values - same.values for one, same in zip(measured(run, None), measured(other, None), strict=True)]


def _of_deviations(run: Run, other: Run, measured: _Measured) -> list[Floats]:
    """By how much (f,) each statistic of ``other`` against ``run`` is more than against itself: what becomes of a deviation when
    the reference is another.
    """
    return [one.values - same.values for one, same in zip(measured(other, run), measured(other, other), strict=True)]


def rounding(unit: str) -> float:
    """Differences up to here are what Newton's method leaves and not of the mesh, in ``unit``."""
    return 1e-2 if unit == "mm3" else 1e-6


def of_sizes(
    near: Floats, far: Floats, lengths: tuple[float, float, float], least: float
) -> tuple[Floats, float, Course]:
    """The bar (f,) of the finest of three meshes by extrapolation, the observed order and the course.

    ``near`` and ``far`` (f,) are the differences of the second mesh to the first and of the third to the second, signed where the
    statistic is; ``least`` is what differences are rounding below. One order p is observed over all frames: with x(h) = x + a h^p
    on ``lengths`` h, the ratio of the differences is (h3^p - h2^p) / (h2^p - h1^p). In each frame the bar is
    1.25 d h1^p / (h2^p - h1^p), where d is ``near``, or what the order makes of ``far`` where that is more.
    """
    known = np.isfinite(near) & np.isfinite(far)
    first, second = np.abs(near[known]).sum(), np.abs(far[known]).sum()
    order, course = math.nan, _course(near[known], far[known], least)
    if course not in ("equal", "not known"):
        order = observed_order(second / first if first else math.inf, lengths)
        course = "does not converge" if order < LOWEST_ORDER else course
    trusted = float(np.clip(order, LOWEST_ORDER, HIGHEST_ORDER)) if course == "converges" else LOWEST_ORDER
    h1, h2, _ = (length**trusted for length in lengths)
    difference = np.maximum(np.abs(near), np.abs(far) / _ratio(trusted, lengths))
    return SAFETY * difference * h1 / (h2 - h1), order, course


def observed_order(ratio: float, lengths: tuple[float, float, float]) -> float:
    """The order p for which (h3^p - h2^p) / (h2^p - h1^p) is ``ratio``, from -20 to 20.

    >>> round(observed_order((4**2 - 2**2) / (2**2 - 1), (1.0, 2.0, 4.0)), 6)
    2.0
    """
    low, high = -20.0, 20.0
    if ratio <= _ratio(low, lengths):
        return low
    if ratio >= _ratio(high, lengths):
        return high
    return float(brentq(lambda order: math.log(_ratio(order, lengths) / ratio), low, high))


def _ratio(order: float, lengths: tuple[float, float, float]) -> float:
    """How the difference of the two coarser meshes compares with that of the two finer ones, for an ``order``."""
    h1, h2, h3 = np.log(lengths)
    if order == 0:
        return float((h3 - h2) / (h2 - h1))
    return float(np.expm1(order * (h3 - h2)) / -np.expm1(order * (h1 - h2)))


def _course(near: Floats, far: Floats, least: float) -> Course:
    """What the differences (f,) of known frames say before an order does."""
    if len(near) == 0:
        return "not known"
    if max(np.abs(near).max(), np.abs(far).max()) <= least:
        return "equal"
    return "oscillates" if near @ far < 0 else "converges"


def save(bars: ErrorBars, folder: Path, of: dict[str, str]) -> None:
    """Store the bars beside the run in ``folder``, as good for what ``of`` names and nothing else."""
    rows = [
        {"of": bar.of, "metric": bar.metric, "statistic": bar.statistic, "unit": bar.unit, "course": bar.course}
        | {"order": _null(bar.order), "values": [_null(value) for value in bar.values]}
        | {"parts": {name: _null(value) for name, value in bar.parts.items()}}
        for bar in bars.bars
    ]
    table = {"format": FORMAT, "of": of, "numbers": bars.numbers, "sizes_mm": bars.sizes, "bars": rows}
    files.write_text(folder / FILE, json.dumps(table, indent=1, allow_nan=False))


def load(folder: Path, of: dict[str, str]) -> ErrorBars | None:
    """The bars stored in ``folder``; None where there are none for what ``of`` names, InputError where the file is damaged."""
    place = folder / FILE
    if not place.exists():
        return None
    try:
        table = json.loads(place.read_text(encoding="utf-8"))
        if table["format"] != FORMAT or table["of"] != of:
            return None
        numbers = tuple(int(number) for number in table["numbers"])
        bars = tuple(_bar(row, len(numbers)) for row in table["bars"])
        return ErrorBars(numbers, tuple(float(size) for size in table["sizes_mm"]), bars)
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise InputError(place, repr(error), "the error bar of a stored run (--error-bar makes it anew)") from error


def _bar(row: dict[str, object], frames: int) -> ErrorBar:
    values = np.array(_numbers(row["values"]))
    parts = row["parts"]
    known = row["of"] in get_args(Of) and row["course"] in get_args(Course)
    if values.shape != (frames,) or not known or not isinstance(parts, dict):
        raise ValueError(f"the bar of {row['metric']}.{row['statistic']}")
    greatest = dict(zip(parts, _numbers(list(parts.values())), strict=True))
    (order,) = _numbers([row["order"]])
    metric, statistic, unit = (str(row[key]) for key in ("metric", "statistic", "unit"))
    of, course = row["of"], row["course"]
    return ErrorBar(of, metric, statistic, unit, values, order, course, greatest)  # type: ignore[arg-type]


def _numbers(values: object) -> list[float]:
    if not isinstance(values, Iterable):
        raise TypeError("no list of numbers")
    return [math.nan if value is None else float(value) for value in values]


def _null(value: float) -> float | None:
    return float(value) if math.isfinite(value) else None
