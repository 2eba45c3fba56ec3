"""Standings: the result of each solver on each case, with its provenance; stale rows; and changes between standings."""

import math
from collections.abc import Collection, Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from statistics import median

from fem_reference.foundations.errors import InputError
from fem_reference.foundations.records import Record, parse
from fem_reference.io import texts

# The version of the method of measurement. Rows of another version are stale.
PROTOCOL = 3
STATES = ("failed", "stale")
# The statistic by which rows are compared, in mm and in per cent; and the error [mm] and the time [s] at which solvers are
# compared.
ERROR, SHARE = "surface_deviation.rms", "surface_deviation.rms_percent"
MATCHED_ERROR, MATCHED_TIME = 2.0, 0.1


class Standing(Record):
    """The result of the solver ``name`` of a ``group`` on a ``case``.

    ``worst``: by ``metric.statistic``, the maximum deviation over the frames; empty for the reference, which has error ``bars``
    instead. ``from_rest``: the rms distance [mm] between the surfaces in the first and last frame, if the reference is back at rest
    then. ``unsound``: the reason why the frames are unusable. ``split``: the root mean squares [mm] of the parts of the error.
    ``least_error``: the error [mm], None unless the time is at most ``MATCHED_TIME``. ``least_time``: the time [s], None unless the
    error is at most ``MATCHED_ERROR``. ``truth`` and ``run``: the keys of the reference and of the run. ``frames``: a hash of the
    positions. ``stale``: True if case, reference, solver, protocol or time limit have changed since the ``date``. ``time_limit``:
    the allowed processor time [s].
    """

    case: str
    group: str
    name: str
    version: str
    status: str
    message: str
    unsound: str = ""
    seconds_per_frame: float | None = None
    worst: dict[str, float | None]
    bars: dict[str, float]
    from_rest: float | None = None
    split: dict[str, float]
    least_error: float | None = None
    least_time: float | None = None
    truth: str
    run: str
    frames: str
    date: str
    machine: str
    protocol: int
    stale: bool = False
    time_limit: float | None = None

    @property
    def failed(self) -> bool:
        """True if the row cannot be ranked."""
        return self.status != "converged" or bool(self.unsound)

    @property
    def ended(self) -> str:
        """The end of the run in words: the reason why its frames are unusable, the time limit that it exceeded, or its status."""
        late = self.status == "timed out" and self.time_limit is not None
        return self.unsound or (f"not within {self.time_limit:g} s" if late else self.status)

    def is_of(self, truth: str, run: str) -> bool:
        """True if the row was measured by the present protocol, on runs with these keys."""
        return (self.truth, self.run, self.protocol) == (truth, run, PROTOCOL)

    def kept(self, missing: bool) -> "Standing":
        """The row of a case that was not measured again, marked if it is stale; ``missing``: True if it could not be measured."""
        return self.model_copy(update={"stale": self.stale or missing or self.protocol != PROTOCOL})

    def asked(self, only: Collection[str]) -> bool:
        """True if the row should be measured again: if it is in one of the states ``only``, or if no states are given."""
        return not only or ("failed" in only and self.failed) or ("stale" in only and self.stale)


class Standings(Record):
    """The ``rows``; ``missing``: by case, or case and solver, why there is no row; ``changes`` since the previous standings."""

    rows: tuple[Standing, ...]
    missing: dict[str, str]
    changes: tuple[str, ...] = ()
    protocol: int = PROTOCOL

    @property
    def cases(self) -> list[str]:
        """The cases, in order."""
        return list(dict.fromkeys(row.case for row in self.rows))

    def of(self, case: str) -> list[Standing]:
        """The rows of a case, by group and error; the failed rows come last in their group, in no particular order."""
        groups = list(dict.fromkeys(row.group for row in self.rows))
        return sorted(
            (row for row in self.rows if row.case == case),
            key=lambda row: (groups.index(row.group), row.failed, _error(row, ERROR)),
        )

    def overall(self) -> list["OverCases"]:
        """A summary of every solver over its cases, without stale rows, in order of group, fraction of solved cases, and error."""
        rows = [row for row in self.rows if not row.stale]
        solvers = dict.fromkeys((row.group, row.name) for row in rows)
        found = [OverCases.of([row for row in rows if (row.group, row.name) == one]) for one in solvers]
        groups = list(dict.fromkeys(one.group for one in found))
        return sorted(found, key=lambda one: (groups.index(one.group), len(one.lost) / one.count, one.share))


@dataclass(frozen=True)
class OverCases:
    """A summary of a solver over ``count`` cases. ``share``: the median of its error, in per cent of the maximum displacement; NaN
    for the reference. ``seconds``: the median of its time [s]. ``lost``: the cases on which it failed.
    """

    group: str
    name: str
    count: int
    share: float
    seconds: float
    lost: tuple[str, ...]

    @classmethod
    def of(cls, rows: Sequence[Standing]) -> "OverCases":
        """The summary of the ``rows`` of one solver."""
        sound = [row for row in rows if not row.failed]
        shares = [value for row in sound if math.isfinite(value := _error(row, SHARE))]
        times = [row.seconds_per_frame for row in sound if row.seconds_per_frame is not None]
        lost = tuple(row.case for row in rows if row.failed)
        share, seconds = (median(found) if found else math.nan for found in (shares, times))
        return cls(rows[0].group, rows[0].name, len(rows), share, seconds, lost)


def _error(row: Standing, name: str) -> float:
    value = row.worst.get(name)
    return math.inf if value is None or math.isnan(value) else value


def load(path: Path) -> tuple[Standing, ...]:
    """The rows of the standings in ``path``; empty if there is no file. InputError if the file does not contain standings."""
    if not path.exists():
        return ()
    found = texts.read_json(path, "standings written by the verb standings")
    if not isinstance(found, dict):
        raise InputError(path, "no table", "standings written by the verb standings")
    return parse(Standings, found, str(path)).rows


def changes(before: Iterable[Standing], after: Iterable[Standing]) -> tuple[str, ...]:
    """The changes from the rows ``before`` to the rows ``after``, in words: new rows, missing rows, changes of status, and errors
    that changed by more than their error bar. Empty if there were no rows before.
    """
    old, new = ({(row.case, row.name): row for row in rows} for rows in (before, after))
    if not old:
        return ()
    bars = {row.case: row.bars.get(ERROR, 0.0) for row in new.values() if row.bars}
    lines = [f"{case}, {name}: new" for case, name in new.keys() - old.keys()]
    lines += [f"{case}, {name}: gone" for case, name in old.keys() - new.keys()]
    for key in old.keys() & new.keys():
        one, other = old[key], new[key]
        ends = [row.unsound.partition(":")[0] or row.status for row in (one, other)]
        values = [_error(row, ERROR) for row in (one, other)]
        if ends[0] != ends[1]:
            lines.append(f"{', '.join(key)}: {ends[0]}, now {ends[1]}")
        elif all(map(math.isfinite, values)) and abs(values[1] - values[0]) > max(bars.get(key[0], 0.0), 1e-6):
            lines.append(f"{', '.join(key)}: {values[0]:.3g} mm, now {values[1]:.3g} mm")
    return tuple(sorted(lines))
