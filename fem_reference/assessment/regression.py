"""Comparison of current measures with a baseline and with the reference: a verdict on every statistic, from its decisive frame."""

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Literal, NamedTuple

import numpy as np

from fem_reference.assessment import judge
from fem_reference.assessment.baseline import PLACES, POSITION_ROUNDING, Baseline, Positions, StoredStatistic
from fem_reference.assessment.judge import Word, doubts
from fem_reference.assessment.measured import CurrentMeasures
from fem_reference.foundations.mesh import Floats
from fem_reference.foundations.version import __version__

Question = Literal["unchanged", "within"]
MOVED = "positions.moved"
WORST_FIRST: tuple[Word, ...] = ("fail", "inconclusive", "pass")


@dataclass(frozen=True)
class Judgement:
    """The verdict ``word`` on a ``question`` about the statistic ``name``, with values in ``unit`` at the decisive ``frame``.

    ``was`` and ``current``: the earlier and the current value, NaN if there is none. ``allowed``: the maximum distance from the
    earlier value (``unchanged``) or from the reference (``within``), NaN if unknown. ``known``: the error bar of the value with
    which the current value is compared.
    """

    question: Question
    name: str
    unit: str
    word: Word
    frame: int
    was: float
    current: float
    allowed: float
    known: float

    @property
    def away(self) -> float:
        """The distance of the current value from the value with which it is compared."""
        return abs(self.current - self.was if self.question == "unchanged" else self.current)

    @property
    def used(self) -> float:
        """The distance divided by the allowed distance; infinite if this ratio is not a number."""
        part = self.away / self.allowed if self.allowed else math.inf
        return 0.0 if self.away == 0 else math.inf if math.isnan(part) else part

    @property
    def why(self) -> str:
        """The reason for the verdict, in words."""
        if math.isnan(self.was) and math.isnan(self.current):
            return "there is no number now, and there was none before"
        if math.isnan(self.current):
            return "there is no number now"
        if self.question == "unchanged" and math.isnan(self.was):
            return "there is a number now, and there was none before"
        if self.word == "inconclusive":
            return self._why_inconclusive
        start = "the baseline" if self.question == "unchanged" else "the reference"
        much, most = (f"{value:.4g} {self.unit}" for value in (self.away, self.allowed))
        return f"{much} from {start}, {most} allowed{self._direction}"

    @property
    def _direction(self) -> str:
        """The direction of a change, towards the reference or away from it, in words."""
        if self.question == "within" or self.name == MOVED or abs(self.current) == abs(self.was):
            return ""
        where = "nearer to" if abs(self.current) < abs(self.was) else "further from"
        return f": was {self.was:.4g}, now {self.current:.4g} {self.unit}, {where} the reference"

    @property
    def _why_inconclusive(self) -> str:
        if math.isnan(self.known):
            return "the error bar of the reference is unknown; --error-bar measures it"
        if math.isnan(self.allowed):
            return "the baseline has no limit for the distance from the reference; --update adds it, now that there is an error bar"
        known = "the reference" if self.question == "within" else "the baseline"
        text = f"the distance, {self.away:.4g} {self.unit}, differs from the allowed {self.allowed:.4g} {self.unit}"
        return f"{text} by less than the error bar of {known}, {self.known:.4g} {self.unit}"


@dataclass(frozen=True)
class Check:
    """All judgements on a ``candidate``, the worst first, with ``notes`` on how to read them and ``doubts`` about the reference."""

    case: str
    candidate: str
    judgements: tuple[Judgement, ...]
    notes: tuple[str, ...]
    doubts: tuple[str, ...] = ()

    @property
    def word(self) -> Word:
        """The overall verdict; a pass is doubtful if there are doubts about the reference."""
        return judge.doubted(judge.overall(one.word for one in self.judgements), self.doubts)

    def answer(self, question: Question) -> Word:
        """The overall verdict on one ``question``."""
        return judge.overall(one.word for one in self.judgements if one.question == question)

    def count(self, word: Word) -> int:
        """The number of judgements with this ``word``."""
        return sum(one.word == word for one in self.judgements)


def check(baseline: Baseline, current: CurrentMeasures) -> Check:
    """Judge ``current`` against a baseline of the same case, scene and candidate."""
    found = [_moved(baseline.positions, current)]
    for name, stored in baseline.measures.items():
        found += _of_statistic(name, stored, current)
    # Judgements that results are too far from the reference come before judgements that they have merely changed.
    found.sort(
        key=lambda one: (WORST_FIRST.index(one.word), one.question != "within", one.name != MOVED, -one.used, one.name)
    )
    notes = tuple(_notes(baseline, current, found))
    return Check(current.scene.name, current.candidate.name, tuple(found), notes, tuple(doubts(current.reference)))


class _Frames(NamedTuple):
    """The frames (f,) of a statistic: the values in the baseline, the current values, the target values, and the error bars."""

    was: Floats
    current: Floats
    truth: Floats
    bars: Floats


def _moved(positions: Positions, current: CurrentMeasures) -> Judgement:
    """Judge whether the sampled vertices have stayed where they were, by the maximum distance [mm] in each frame."""
    was = positions.points(len(current.rest), "baseline")
    with np.errstate(over="ignore"):  # squares of huge distances overflow and count as infinite
        away = np.linalg.norm(current.points[:, list(positions.vertices)] - was, axis=2).max(axis=1)
    still = np.where(np.isnan(was).any(axis=(1, 2)), np.nan, 0.0)
    frames = _Frames(still, away, still, np.full(len(away), POSITION_ROUNDING))
    return _judged("unchanged", (MOVED, "mm"), frames, positions.tolerance, current)


def _of_statistic(name: str, stored: StoredStatistic, current: CurrentMeasures) -> Iterator[Judgement]:
    """Judge whether a statistic is unchanged since the baseline, which is exact up to rounding, and whether its distance from the
    reference, which is known to within its error bar, is allowed.
    """
    was, now, within = stored.numbers, current.values(name), math.nan if stored.within is None else stored.within
    rounding = np.full(len(was), 0.5 * 10.0 ** -PLACES[stored.unit])
    unchanged = _Frames(was, now, was, rounding)
    yield _judged("unchanged", (name, stored.unit), unchanged, stored.tolerance, current)
    from_reference = _Frames(was, now, np.zeros(len(was)), current.bars(name))
    yield _judged("within", (name, stored.unit), from_reference, within, current)


def _judged(
    question: Question, what: tuple[str, str], frames: _Frames, allowed: float, current: CurrentMeasures
) -> Judgement:
    """Judge all frames and return the judgement on the decisive frame. This is, among the frames with the overall verdict, the
    frame farthest from its target or, if the verdict is inconclusive, the frame with the widest error bar.
    """
    words = [_word(*map(float, row), allowed=allowed) for row in zip(*frames, strict=True)]
    word = judge.overall(words)
    deciding = frames.bars if word == "inconclusive" else np.abs(frames.current - frames.truth)
    furthest = np.where(np.isnan(deciding), np.inf, deciding)
    k = int(np.argmax(np.where([each == word for each in words], furthest, -1.0)))
    was, value, _, bar = (float(column[k]) for column in frames)
    return Judgement(question, *what, word, current.candidate.numbers[k], was, value, allowed, bar)


def _word(was: float, value: float, truth: float, bar: float, *, allowed: float) -> Word:
    """The verdict on one frame: inconclusive if both values are NaN, fail if there was no number before."""
    if math.isnan(was) and math.isnan(value):
        return "inconclusive"
    if math.isnan(truth):
        return "fail"
    return judge.judge(value, truth, allowed, bar)


def _notes(baseline: Baseline, current: CurrentMeasures, found: list[Judgement]) -> Iterator[str]:
    """Notes that explain the judgements and name the statistics that were not judged."""
    if baseline.fem_reference != __version__:
        yield f"measured by fem_reference {__version__}, the baseline by {baseline.fem_reference}"
    if baseline.reference != current.reference_name:
        yield f"the reference is {current.reference_name}, but the reference of the baseline was {baseline.reference}"
    changed = any(one.word == "fail" and one.question == "unchanged" for one in found if one.name != MOVED)
    if changed and all(one.word == "pass" for one in found if one.name == MOVED):
        yield (
            "no sampled vertex moved, but measures changed: either the reference differs, or the candidate moved between the "
            "sampled vertices"
        )
    left = sorted(current.by_name.keys() - baseline.measures.keys())
    if left:
        yield f"not in the baseline and not judged: {', '.join(left)}"
