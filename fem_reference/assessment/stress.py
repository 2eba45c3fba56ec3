"""Results of hard cases: a table cell for each case and solver, with the verdict and the evidence for it."""

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Any, Literal, get_args

import numpy as np
from pydantic import Field

from fem_reference.foundations.mesh import Floats, Ints
from fem_reference.foundations.records import Record
from fem_reference.io.texts import plain

# Not applicable: the solver does not accept the case. No solution: no equilibrium exists, and the solver reports this.
Verdict = Literal["ok", "degraded", "failed", "not applicable", "no solution", "inconclusive"]
VERDICTS: tuple[Verdict, ...] = get_args(Verdict)


class Bound(Record):
    """A bound that a healthy run satisfies: a ``quantity`` of :mod:`health` is at most ``at_most``, in every frame or, if
    ``frame`` is "last", in the last frame.
    """

    quantity: str
    at_most: float = Field(ge=0)
    frame: Literal["any", "last"] = "any"


@dataclass(frozen=True, eq=False)
class History:
    """A ``quantity`` over the frames: its ``values`` (f,) in ``unit`` at frame ``numbers``. ``where``: the worst point of each
    frame in words. ``points`` (f, 3) [mm]: the positions of the worst points, None for a quantity without a position.
    """

    quantity: str
    unit: str
    numbers: tuple[int, ...]
    values: Floats
    where: tuple[str, ...] = ()
    points: Floats | None = None

    def worst(self, frame: Literal["any", "last"]) -> int:
        """The index of the decisive frame: the last, or the one with the largest value; NaN counts as the largest."""
        if frame == "last":
            return len(self.values) - 1
        return int(np.argmax(np.where(np.isnan(self.values), np.inf, self.values)))


@dataclass(frozen=True, eq=False)
class Scene:
    """A picture of ``triangles`` (m, 3) with ``points`` (n, 3) [mm] at a frame, and the position (3,) of a mark (``place``)."""

    points: Floats
    triangles: Ints
    place: Floats | None = None


@dataclass(frozen=True, eq=False)
class Cell:
    """The result of a ``solver`` on a hard case: the ``verdict`` and a ``sentence`` on the result.

    ``status``: the status of the run, empty without a run. ``quantity``, ``value`` and ``bound``: the decisive quantity, with its
    ``history`` and the index of its decisive frame (``at``). ``scene``: a picture of the worst point.
    """

    case: str
    solver: str
    verdict: Verdict
    sentence: str
    status: str = ""
    quantity: str = ""
    unit: str = ""
    value: float | None = None
    bound: float | None = None
    seconds: float = 0.0
    history: History | None = None
    at: int = 0
    scene: Scene | None = None


@dataclass(frozen=True)
class HardCase:
    """A hard case: its ``name``, its ``title``, and signs of a healthy run, in words (``healthy``) and as numerical ``bounds``."""

    name: str
    title: str
    healthy: str
    bounds: tuple[Bound, ...]


@dataclass(frozen=True, eq=False)
class Stress:
    """All ``cells``, with the ``cases`` and the ``solvers`` in the order in which pages show them. ``origin``: the provenance."""

    cases: tuple[HardCase, ...]
    solvers: tuple[str, ...]
    cells: tuple[Cell, ...]
    seconds: float
    origin: dict[str, str] = field(default_factory=dict)

    def at(self, case: str, solver: str) -> Cell:
        """The cell of a case and a solver."""
        return next(cell for cell in self.cells if (cell.case, cell.solver) == (case, solver))

    def count(self, solver: str) -> Counter[Verdict]:
        """The number of cases with each verdict for a solver."""
        return Counter(cell.verdict for cell in self.cells if cell.solver == solver)


_OTHER_REASONS = ("timed out", "crashed", "denied")  # endings of a run that do not mean that there is no solution
_PICTURED = ("history", "at", "scene")  # fields of a cell for its picture
Weighed = Sequence[tuple[Bound, History]]


def judge(cell: Cell, weighed: Weighed, contrast: str = "") -> Cell:
    """The ``cell`` of a run that reached every frame, with its verdict.

    The verdict follows from the first bound that is violated or, if none is, from the first bound. A value that is not finite
    fails. ``contrast``: the reason why the run should violate a bound, empty if it should not. A run that should do so, but does
    not, fails.
    """
    shown = _decisive(cell, weighed)
    if shown.value is None or shown.bound is None or not np.isfinite(shown.value):
        return replace(shown, verdict="failed", sentence=f"{cell.status}, but {shown.sentence}")
    kept = shown.value <= shown.bound
    if not contrast:
        return replace(shown, verdict="ok" if kept else "degraded")
    said = f"{'not as expected' if kept else 'as expected'} ({contrast}): {shown.sentence}"
    return replace(shown, verdict="failed" if kept else "degraded", sentence=said)


def unfinished(cell: Cell, message: str, weighed: Weighed, no_solution: str) -> Cell:
    """The ``cell`` of a run that did not reach every frame: failed, with two exceptions.

    The verdict is "no solution" if the run ended at a limit point. It is the same if ``no_solution`` gives a reason why the case
    has no solution, the run reached some frames, and it neither timed out nor crashed and was not denied.
    """
    shown = _decisive(cell, weighed)
    if cell.status == "limit point":
        return replace(shown, verdict="no solution", sentence=message)
    if no_solution and cell.status not in _OTHER_REASONS and len(weighed[0][1].numbers) > 1:
        sentence = f"as expected ({no_solution}): {cell.status}: {message}"
        return replace(shown, verdict="no solution", sentence=sentence)
    return replace(shown, verdict="failed", sentence=f"{cell.status}: {message}")


def doubted(cell: Cell, doubt: str, no_solution: str) -> Cell:
    """The ``cell`` in view of a ``doubt`` about the solver's result ("" for none): degraded, or no solution if that is expected."""
    if not doubt or cell.verdict != "ok":
        return cell
    if no_solution:
        return replace(cell, verdict="no solution", sentence=f"as expected ({no_solution}): {doubt}; {cell.sentence}")
    return replace(cell, verdict="degraded", sentence=f"{doubt}; {cell.sentence}")


def _decisive(cell: Cell, weighed: Weighed) -> Cell:
    """The ``cell`` with the first quantity that violates its bound or, if none does, with the first quantity."""
    values = [(bound, history, history.worst(bound.frame)) for bound, history in weighed]
    bound, history, i = next((one for one in values if not one[1].values[one[2]] <= one[0].at_most), values[0])
    where = f" {history.where[i]}" if history.where else ""
    unit = f" {history.unit}" if history.unit else ""
    value = float(history.values[i])
    sentence = (
        f"{history.quantity.replace('_', ' ')} {value:.3g}{unit} at frame {history.numbers[i]}{where}; "
        f"a healthy run has at most {bound.at_most:.3g}{unit}"
    )
    return replace(
        cell,
        sentence=sentence,
        quantity=history.quantity,
        unit=history.unit,
        value=value,
        bound=bound.at_most,
        history=history,
        at=i,
    )


def facts(stress: Stress) -> dict[str, Any]:
    """The contents of pages, without pictures, as valid JSON."""
    cells = [{name: value for name, value in vars(cell).items() if name not in _PICTURED} for cell in stress.cells]
    return {
        "format": 1,
        "cases": [vars(case) | {"bounds": [bound.model_dump() for bound in case.bounds]} for case in stress.cases],
        "solvers": list(stress.solvers),
        "cells": plain(cells),
        "seconds": stress.seconds,
        "origin": stress.origin,
    }
