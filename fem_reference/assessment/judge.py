"""Verdicts on measures, from a truth and a tolerance, and doubts about a reference, which make a pass doubtful."""

import math
from collections.abc import Collection, Iterable
from dataclasses import dataclass
from typing import Literal

import numpy as np

from fem_reference.foundations.errors import InputError
from fem_reference.foundations.limits import ENERGY_GAP
from fem_reference.foundations.records import join
from fem_reference.foundations.units import quantity
from fem_reference.metrics import Measure, units
from fem_reference.runs.store import Run
from fem_reference.scenes.case import Case, Expectation

Word = Literal["pass", "doubtful pass", "fail", "inconclusive", "not judged"]
# Verdicts on expectations that are met.
MET: tuple[Word, ...] = ("pass", "doubtful pass")
_KINDS = {
    "mm": ("a length", 1.0),
    "%": ("a fraction", 100.0),
    "mm3": ("a volume", 1.0),
    "deg": ("an angle", 180 / math.pi),
    "s": ("a time", 1.0),
    "N": ("a force", 1.0),
    "N mm": ("a moment", 1.0),
    "MPa": ("a pressure", 1.0),
    "kPa": ("a pressure", 1000.0),
    "1": ("a number", 1.0),
}
_LOW = 0.1  # a state is doubtful if its det F is below this


@dataclass(frozen=True)
class Verdict:
    """The verdict ``word`` on an expectation.

    ``value``: the decisive value, at ``frame``; ``truth`` and ``within``: the expected value and the tolerance, all in ``unit``.
    ``error_bar``: the error bar of the reference in this frame, NaN if it is unknown and None if there are no bars.
    """

    word: Word
    expectation: Expectation
    value: float
    truth: float
    within: float
    unit: str
    frame: int
    error_bar: float | None = None


def judge(value: float, truth: float, within: float, error_bar: float = 0.0) -> Word:
    """Judge whether a ``value`` is at most ``within`` from the ``truth``, known to within its ``error_bar``; all in one unit.

    The verdict is pass if ``abs(value - truth) <= within`` for every truth in the error bar, fail if this holds for no such truth,
    otherwise inconclusive. A value that is not a number fails. If the truth, the tolerance or the bar is unknown, the verdict is
    inconclusive.

    >>> judge(1.02, 1.0, 0.05), judge(float("nan"), 1.0, 0.05), judge(1.02, 1.0, 0.05, error_bar=0.04)
    ('pass', 'fail', 'inconclusive')
    >>> judge(3.0, 1.0, 0.05, error_bar=1.0)
    'fail'
    """
    if math.isnan(truth) or math.isnan(within):
        return "inconclusive"
    miss = abs(value - truth)
    if math.isnan(miss):
        return "fail"
    if math.isnan(error_bar):
        return "inconclusive"
    if miss - error_bar > within:
        return "fail"
    return "pass" if miss + error_bar <= within else "inconclusive"


def overall(words: Iterable[Word]) -> Word:
    """The overall verdict: the first of fail, inconclusive, doubtful pass and pass among the ``words``; otherwise not judged."""
    found = set(words)
    order: tuple[Word, ...] = ("fail", "inconclusive", "doubtful pass", "pass")
    return next((word for word in order if word in found), "not judged")


def doubts(reference: Run) -> list[str]:
    """Reasons to doubt a reference, in words: missing frames, instability, a small det F, laws out of range, energy gaps."""
    said = [] if reference.outcome.status == "converged" else [str(reference.outcome.status)]
    modes = reference.scalars.get("negative_modes")
    unstable = 0 if modes is None else int((np.nan_to_num(modes) > 0).sum())
    if unstable:
        said.append(f"unstable equilibrium in {unstable} of {len(reference.numbers)} frames")
    smallest = [np.nanmin(values) for name, values in reference.scalars.items() if name.startswith("min_det_F")]
    if smallest and min(smallest) < _LOW:
        said.append(f"det F falls to {float(min(smallest)):#.3g}")
    outside = np.nan_to_num(reference.scalars.get("outside_law", np.zeros(0))) > 0
    if outside.any():
        where = f"in {int(outside.sum())} of {len(outside)} frames, first in frame {reference.numbers[int(outside.argmax())]}"
        said.append(f"cells are outside the intended range of a law {where}: see Provenance")
    gaps = np.nan_to_num(reference.scalars.get("energy_gap", np.zeros(0)))
    if (np.abs(gaps) > ENERGY_GAP).any():
        most = int(np.argmax(np.abs(gaps)))
        said.append(
            f"the energy changed by {100 * gaps[most]:.3g} % without work at frame {reference.numbers[most]}: the body jumped, or "
            "the load steps are too large to decide (largest_step)"
        )
    return said


def doubted(word: Word, doubts: Collection[str]) -> Word:
    """The verdict ``word`` in view of ``doubts`` about its reference: a pass becomes a doubtful pass."""
    return "doubtful pass" if word == "pass" and doubts else word


def check(case: Case) -> None:
    """Raise InputError unless each expectation of a case has an existing measure and frame, and values in a unit of the measure."""
    numbers = case.numbers
    for i, entry in enumerate(case.expect):
        place, expectation = join(case.place, f"expect[{i}]"), resolved(entry)
        name = f"{expectation.metric}.{expectation.statistic}"
        known = units(case.carries, case.standards(expectation.of))
        if name not in known:
            got = f'"{expectation.metric}"' if entry.statistic is None else f'"{name}"'
            raise InputError(f"{place}: metric and statistic", got, f"one of {', '.join(sorted(known))}")
        for key in ("truth", "within"):
            given = getattr(expectation, key)
            got = f'"{given}"' if isinstance(given, str) else repr(given)
            try:
                value = in_unit(given, known[name])
            except ValueError as error:
                raise InputError(f"{place}.{key}", got, str(error)) from error
            if key == "within" and value < 0:
                raise InputError(f"{place}.{key}", got, "a tolerance of at least zero")
        if expectation.frame != "any" and expectation.frame not in numbers:
            listed = [str(number) for number in (numbers if len(numbers) < 3 else [*numbers[:2], "...", numbers[-1]])]
            want = f'"any" or one of {", ".join(listed)}'
            raise InputError(f"{place}.frame", expectation.frame, want)


def resolved(expectation: Expectation) -> Expectation:
    """The ``expectation`` with its statistic. If it states none, and its metric has only one statistic, this one is filled in."""
    start = f"{expectation.metric}."
    names = [name.removeprefix(start) for name in units() if name.startswith(start)]
    if expectation.statistic is not None or len(names) != 1:
        return expectation
    return expectation.model_copy(update={"statistic": names[0]})


def verdict(expectation: Expectation, measures: Iterable[Measure], numbers: tuple[int, ...]) -> Verdict:
    """The verdict on a checked ``expectation``, from the ``measures`` of its run at frame ``numbers``."""
    name = (expectation.metric, expectation.statistic)
    found = next(measure for measure in measures if (measure.metric, measure.statistic) == name)
    bars = found.error_bars
    truth, within = (in_unit(text, found.unit) for text in (expectation.truth, expectation.within))
    frames = range(len(numbers)) if expectation.frame == "any" else [numbers.index(expectation.frame)]
    values = [float(found.values[frame]) for frame in frames]
    known = [0.0 if bars is None else float(bars[frame]) for frame in frames]
    words = [judge(value, truth, within, bar) for value, bar in zip(values, known, strict=True)]
    word = overall(words)
    # The first failing frame decides; otherwise the inconclusive frame with the widest bar; otherwise the frame farthest from the
    # truth.
    furthest = max(range(len(values)), key=lambda k: abs(values[k] - truth))
    width = [math.inf if math.isnan(bar) else bar for bar in known]
    widest = max(range(len(values)), key=lambda k: (words[k] == "inconclusive", width[k]))
    decides = words.index("fail") if word == "fail" else widest if word == "inconclusive" else furthest
    bar = None if bars is None else known[decides]
    frame = numbers[frames[decides]]
    return Verdict(word, expectation, values[decides], truth, within, found.unit, frame, bar)


def in_unit(given: str | float, unit: str) -> float:
    """The quantity ``given`` in the ``unit`` of a measure. A number without a unit is accepted only for the unit "1". Raises
    ValueError if the dimension differs.
    """
    kind, factor = _KINDS[unit]
    return float(given) if unit == "1" and not isinstance(given, str) else quantity(given, kind) * factor
