"""Two versions of a solver: the statistics that are now nearer to the reference or farther from it, with their frames."""

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Literal

import numpy as np

from fem_reference.assessment.baseline import PLACES, POSITION_ROUNDING, Baseline
from fem_reference.assessment.differences import greatest
from fem_reference.assessment.measured import CurrentMeasures
from fem_reference.foundations.errors import InputError
from fem_reference.foundations.mesh import Floats, Ints

Word = Literal["worse", "mixed", "better", "within the error bar", "as it was", "no number"]
SHARE = 0.1
ORDER: tuple[Word, ...] = ("worse", "mixed", "better", "within the error bar", "as it was", "no number")


@dataclass(frozen=True, eq=False)
class Change:
    """The earlier and the current distance of the statistic ``name`` from the reference (``was`` and ``now`` (f,)), in ``unit``, at
    frame ``numbers``. ``bars`` (f,): the error bars of the reference, NaN if unknown.
    """

    name: str
    unit: str
    numbers: tuple[int, ...]
    was: Floats
    now: Floats
    bars: Floats

    @property
    def further(self) -> Floats:
        """The increase (f,) of the distance, negative if it decreased; infinite if only one of the two values is a number."""
        lost, found = np.isnan(self.now) & ~np.isnan(self.was), np.isnan(self.was) & ~np.isnan(self.now)
        further = np.abs(self.now) - np.abs(self.was)
        return np.where(lost, np.inf, np.where(found, -np.inf, further))

    @property
    def at(self) -> int:
        """The index of the frame with the largest change; changes that exceed their error bar take precedence."""
        change = self._counted if self._counted.any() else self.further
        return int(np.argmax(np.nan_to_num(np.abs(change), nan=-1.0, posinf=np.inf)))

    @property
    def frame(self) -> int:
        """The number of the frame with index :attr:`at`."""
        return self.numbers[self.at]

    @property
    def by(self) -> float:
        """The change in the frame :attr:`at`, positive if the distance increased; NaN if both values are NaN."""
        return float(self.further[self.at])

    @property
    def bar(self) -> float:
        """The error bar of the reference in the frame :attr:`at`."""
        return float(self.bars[self.at])

    @property
    def greatest(self) -> tuple[float, float]:
        """The maximum distance from the reference earlier and the maximum distance now, NaN without a number."""
        return greatest(np.abs(self.was)), greatest(np.abs(self.now))

    @property
    def in_bars(self) -> float:
        """The change in the frame :attr:`at` divided by the error bar; NaN if the bar is unknown."""
        return self.by / self.bar if self.bar > 0 else math.nan

    @property
    def size(self) -> float:
        """The number by which changes are sorted: the change as a multiple of the bar or, without bars, of the maximum distance."""
        whole = np.nanmax([*self.greatest, 1e-300])
        return abs(self.by / whole) if math.isnan(self.in_bars) else abs(self.in_bars)

    @property
    def word(self) -> Word:
        """The verdict on the change: neutral below rounding or the error bar, "mixed" if its sign differs between frames."""
        if math.isnan(self.by):
            return "no number"
        if abs(self.by) <= 10.0 ** -PLACES[self.unit]:
            return "as it was"
        nearer, further = bool((self._counted < 0).any()), bool((self._counted > 0).any())
        if nearer and further:
            return "mixed"
        return "worse" if further else "better" if nearer else "within the error bar"

    @property
    def _counted(self) -> Floats:
        """The changes (f,) that exceed rounding, their error bar, and ``SHARE`` of the largest change; 0 in all other frames."""
        change = np.nan_to_num(self.further, nan=0.0, posinf=np.inf, neginf=-np.inf)
        finite = np.abs(change[np.isfinite(change)])
        least = max(10.0 ** -PLACES[self.unit], SHARE * float(finite.max(initial=0.0)))
        return np.where(np.abs(change) > np.fmax(self.bars, least), change, 0.0)

    @property
    def other(self) -> int | None:
        """The index of the frame with the largest change of opposite sign; None unless the change is mixed."""
        if self.word != "mixed":
            return None
        return int(np.argmin(self._counted) if self.by > 0 else np.argmax(self._counted))


@dataclass(frozen=True, eq=False)
class Versions:
    """The ``current`` measures compared with an earlier state, which ``was`` describes in words.

    ``changes``: the changes of statistics, the worst first. ``moved`` (f, k) [mm]: the distance of each of the ``vertices`` (k,)
    from its earlier position. ``before`` (f, n, 3) [mm]: the earlier positions, None if only those of some vertices are known.
    ``differences``: the differences of provenance: key, earlier value and current value.
    """

    current: CurrentMeasures
    was: str
    changes: tuple[Change, ...]
    vertices: Ints
    moved: Floats
    before: Floats | None
    differences: tuple[tuple[str, str, str], ...] = ()

    def count(self, word: Word) -> int:
        """The number of statistics with this verdict."""
        return sum(one.word == word for one in self.changes)

    def of(self, word: Word) -> list[Change]:
        """The statistics with this verdict, the largest change first."""
        return [one for one in self.changes if one.word == word]

    @property
    def place(self) -> tuple[int, int, float] | None:
        """Frame index, vertex and distance [mm] of the largest change of position; None if no position changed."""
        known = np.nan_to_num(self.moved, nan=-1.0)
        i, k = np.unravel_index(int(np.argmax(known)), known.shape)
        if known[i, k] <= POSITION_ROUNDING:
            return None
        return int(i), int(self.vertices[k]), float(known[i, k])


def of_runs(current: CurrentMeasures, before: CurrentMeasures, was: str) -> Versions:
    """Compare the current measures with those of another run over the same frames."""
    if current.points.shape != before.points.shape:
        got, want = (one.points.shape[1] for one in (before, current))
        raise InputError("--against", f"{got} vertices", f"{want}, as in the candidate")
    names = {name: one.unit for name, one in before.by_name.items() if name in current.by_name}
    known = {name: before.values(name) for name in names}
    with np.errstate(invalid="ignore", over="ignore"):
        moved = np.linalg.norm(current.points - before.points, axis=2)
    differences = tuple(_differences(before.candidate.origin, current.candidate.origin))
    vertices = np.arange(moved.shape[1])
    return Versions(current, was, _changes(current, names, known), vertices, moved, before.points, differences)


def of_baseline(current: CurrentMeasures, baseline: Baseline, was: str) -> Versions:
    """Compare the current measures with the rounded measures and positions of sampled vertices in a baseline."""
    names = {name: stored.unit for name, stored in baseline.measures.items()}
    known = {name: stored.numbers for name, stored in baseline.measures.items()}
    vertices, then = np.array(baseline.positions.vertices), baseline.positions.points(len(current.rest), "--against")
    moved = np.linalg.norm(current.points[:, vertices] - then, axis=2)
    return Versions(current, was, _changes(current, names, known), vertices, moved, None)


def _changes(current: CurrentMeasures, units: dict[str, str], was: dict[str, Floats]) -> tuple[Change, ...]:
    numbers = current.candidate.numbers
    now, bars = current.values, current.bars
    found = [Change(name, unit, numbers, was[name], now(name), bars(name)) for name, unit in units.items()]
    return tuple(sorted(found, key=lambda one: (ORDER.index(one.word), -np.nan_to_num(one.size), one.name)))


def _differences(one: object, other: object, key: str = "") -> Iterator[tuple[str, str, str]]:
    """The differences between two nested tables: the key, the value in ``one`` and the value in ``other``."""
    if isinstance(one, dict) and isinstance(other, dict):
        for name in dict.fromkeys([*one, *other]):
            yield from _differences(one.get(name), other.get(name), f"{key}.{name}".lstrip("."))
    elif one != other:
        yield key, str(one), str(other)
