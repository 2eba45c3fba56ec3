"""The kinds of solvers in Table 5.1 of the report DCSE/TR-2022-03, and the results of solvers of these kinds on scenes."""

import tomllib
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from pydantic import Field

from fem_reference.assessment.ranking import Ranking, rankings
from fem_reference.foundations.records import Record, parse
from fem_reference.metrics import Measure, find
from fem_reference.runs.store import Outcome

FILE = Path(__file__).with_suffix(".toml")


class SolverKind(Record):
    """A row of the report's table.

    ``form``: the form of the model. ``speed`` and ``precision``: the ratings in the report, in plus and minus signs.
    ``literature``: the citation numbers in the report. ``of_case``: the names of the candidates that represent this kind.
    """

    name: str
    form: str
    speed: str
    precision: str
    literature: str
    of_case: tuple[str, ...] = ()


class ReportSpeed(Record):
    """The iterations per second of the report's program on a ``case``, and the ``source`` of this value."""

    case: str
    per_second: float = Field(gt=0)
    source: str


class _File(Record):
    kind: tuple[SolverKind, ...]
    report_speed: tuple[ReportSpeed, ...]


def solver_kinds() -> tuple[SolverKind, ...]:
    """The rows of the report's table, in its order."""
    return _file().kind


def report_speeds() -> dict[str, ReportSpeed]:
    """The iterations per second of the report's program, by case."""
    return {one.case: one for one in _file().report_speed}


def _file() -> _File:
    return parse(_File, tomllib.loads(FILE.read_text(encoding="utf-8")), FILE.name)


@dataclass(frozen=True, eq=False)
class SolverResult:
    """The result of a solver (``kind``, ``name``, ``solver``) on a ``case``.

    ``seconds_per_frame``: the time per frame [s], None if unknown. ``measures``: the measures against the reference; for the
    reference itself (``of_reference``) its error bars, empty if these were not requested. ``numbers``: the frame numbers.
    ``needs``: the number of parameters that a user must give, by kind, empty if unknown. ``unsound``: the reason why its frames are
    unusable, otherwise empty.
    """

    kind: str
    name: str
    solver: str
    case: str
    outcome: Outcome
    seconds_per_frame: float | None
    measures: tuple[Measure, ...]
    numbers: tuple[int, ...]
    machine: str
    of_reference: bool = False
    needs: Mapping[str, int] = field(default_factory=dict)
    unsound: str = ""

    def worst(self, metric: str, statistic: str) -> tuple[float, int] | None:
        """The value with the largest magnitude over the frames, and its frame number. The value is NaN if the value of any frame is
        NaN. None if the statistic was not measured.
        """
        found = find(self.measures, metric, statistic)
        return None if found is None else (found.worst.value, self.numbers[found.worst.index])


@dataclass(frozen=True, eq=False)
class Scenario:
    """A scene: its ``title``, the number of ``triangles`` of the muscle, the maximum displacement (``travel`` [mm]) in the
    reference, and the outcome of the ``reference``.
    """

    case: str
    title: str
    triangles: int
    travel: float
    reference: Outcome


@dataclass(frozen=True)
class Overall:
    """A statistic of a solver in its worst frame of each scenario.

    ``median``: the median of the magnitudes over the ``count`` scenarios in which the value is known in every frame. ``worst`` and
    ``case``: the value with the largest magnitude, and its case. ``lost``: the cases on which the solver failed.
    """

    median: float
    worst: float
    case: str
    count: int
    lost: tuple[str, ...] = ()


@dataclass(frozen=True, eq=False)
class Table:
    """The ``results`` of solvers on ``scenarios``; ``missing``: by case, why it was left out; ``machines``: the machines
    of the runs.
    """

    kinds: tuple[SolverKind, ...]
    scenarios: tuple[Scenario, ...]
    results: tuple[SolverResult, ...]
    missing: dict[str, str]
    versions: dict[str, str]
    machines: tuple[str, ...]

    def _by(self, kind: str, name: str) -> list[SolverResult]:
        """The results of the solver ``name`` of a ``kind``."""
        return [one for one in self.results if (one.kind, one.name) == (kind, name)]

    def of(self, kind: str, case: str) -> list[SolverResult]:
        """The results of all solvers of a ``kind`` on a ``case``."""
        return [one for one in self.results if (one.kind, one.case) == (kind, case)]

    def names(self, kind: str) -> list[str]:
        """The solvers of a kind, in order."""
        return list(dict.fromkeys(one.name for one in self.results if one.kind == kind))

    def needs(self, kind: str, name: str) -> Mapping[str, int]:
        """The number of parameters of each kind that ``name`` needs, on the scene that needs the most; empty if unknown."""
        found = [one.needs for one in self._by(kind, name)]
        return max(found, key=lambda needs: sum(needs.values()), default={})

    def over(self, kind: str, name: str, metric: str, statistic: str) -> "Overall | None":
        """The worst frames of ``name`` over all scenarios; None if the statistic was not measured."""
        mine = self._by(kind, name)
        found = [(value[0], one.case) for one in mine if (value := one.worst(metric, statistic)) is not None]
        finite = [(value, case) for value, case in found if not np.isnan(value)]
        lost = tuple(case for value, case in found if np.isnan(value))
        if not finite:
            return Overall(np.nan, np.nan, "", 0, lost) if lost else None
        worst, case = max(finite, key=lambda entry: abs(entry[0]))
        return Overall(float(np.median([abs(value) for value, _ in finite])), worst, case, len(finite), lost)

    def rankings(self, case: str) -> tuple[Ranking, ...]:
        """The rankings of solvers on a ``case``, as far as the error bars of the reference separate them; empty without bars."""
        here = [one for one in self.results if one.case == case]
        bars = [measure for one in here if one.of_reference for measure in one.measures]
        return rankings({one.name: one.measures for one in here if not (one.of_reference or one.unsound)}, bars)

    def speed(self, kind: str, name: str) -> tuple[Scenario, float] | None:
        """The scenario with the most triangles for which the time per frame [s] of ``name`` is known, and that time."""
        known = {one.case: one.seconds_per_frame for one in self._by(kind, name)}
        times = {case: seconds for case, seconds in known.items() if seconds is not None}
        largest = max((one for one in self.scenarios if one.case in times), key=lambda one: one.triangles, default=None)
        return None if largest is None else (largest, times[largest.case])
