"""Ranking of solvers by their distance from the reference; solvers whose error bars overlap share a rank."""

import math
from collections.abc import Iterable
from dataclasses import dataclass

from fem_reference.io.texts import finite
from fem_reference.metrics import Measure, described, find


@dataclass(frozen=True)
class Deviation:
    """The distance ``value`` of a candidate from the reference in its worst frame, and the error ``bar`` there, NaN if unknown."""

    name: str
    value: float
    bar: float


@dataclass(frozen=True)
class Ranked:
    """A deviation with its possible ranks, from ``first`` to ``last``, and the names of the candidates that cannot be distinguished
    from it (``alike``).
    """

    deviation: Deviation
    first: int
    last: int
    alike: tuple[str, ...]

    @property
    def rank(self) -> str:
        """The possible ranks in words: ``2``, or ``2 to 4``."""
        return str(self.first) if self.first == self.last else f"{self.first} to {self.last}"


@dataclass(frozen=True)
class Ranking:
    """The candidates ranked by one statistic (``places``), the smallest deviation first; the statistic's ``title`` and ``unit``."""

    title: str
    unit: str
    places: tuple[Ranked, ...]

    @property
    def pairs(self) -> tuple[int, int]:
        """The number of pairs of candidates that can be distinguished, and the number of all pairs."""
        count = len(self.places)
        alike = sum(len(place.alike) for place in self.places) // 2
        return count * (count - 1) // 2 - alike, count * (count - 1) // 2


def ranked(deviations: Iterable[Deviation]) -> tuple[Ranked, ...]:
    """The ``deviations`` in order, with their ranks. Two of them differ in rank if their error bars do not overlap. NaN comes last.

    >>> [place.rank for place in ranked([Deviation("a", 5.0, 0.4), Deviation("b", 2.0, 0.4), Deviation("c", 2.5, 0.4)])]
    ['1 to 2', '1 to 2', '3']
    """
    ordered = sorted(deviations, key=lambda one: math.inf if math.isnan(one.value) else one.value)
    found = []
    for one in ordered:
        better = sum(_less(other, one) for other in ordered)
        worse = sum(_less(one, other) for other in ordered)
        others = (other for other in ordered if other is not one)
        alike = tuple(other.name for other in others if not _less(other, one) and not _less(one, other))
        found.append(Ranked(one, better + 1, len(ordered) - worse, alike))
    return tuple(found)


def _less(one: Deviation, other: Deviation) -> bool:
    """True if ``one`` is certainly nearer to the truth than ``other``."""
    if math.isnan(other.value):
        return not math.isnan(one.value)
    return one.value + one.bar < other.value - other.bar


def rankings(measured: dict[str, tuple[Measure, ...]], bars: Iterable[Measure]) -> tuple[Ranking, ...]:
    """The rankings by each statistic that serves for ranking, among the runs that have it. ``measured``: the measures of each run
    against the reference, by name. ``bars``: the error bars of deviations; a statistic without a bar is left out.
    """
    known, found = tuple(bars), []
    for key, stated in described("rank").items():
        if (bar := find(known, *key)) is None:
            continue
        places = ranked(
            Deviation(name, abs(one.worst.value), float(bar.values[one.worst.index]))
            for name, measures in measured.items()
            if (one := find(measures, *key)) is not None
        )
        if len(places) > 1:
            found.append(Ranking(stated.label, bar.unit, places))
    return tuple(found)


def facts(found: Iterable[Ranking]) -> list[dict[str, object]]:
    """Rankings as valid JSON, with None for a number that is not finite."""
    return [
        {
            "by": one.title,
            "unit": one.unit,
            "name": place.deviation.name,
            "value": finite(place.deviation.value),
            "error_bar": finite(place.deviation.bar),
            "rank": [place.first, place.last],
            "not_distinguishable_from": list(place.alike),
        }
        for one in found
        for place in one.places
    ]
