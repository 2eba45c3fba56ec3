"""measure + truth + tolerance -> pass, fail or cannot say."""

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Literal

from fem_reference.errors import InputError
from fem_reference.metrics import Measure
from fem_reference.records import join
from fem_reference.scene import Expectation, Scene
from fem_reference.units import quantity

Word = Literal["pass", "fail", "cannot say"]
_KINDS = {"mm": ("a length", 1.0), "%": ("a fraction", 100.0), "mm3": ("a volume", 1.0), "1": ("a fraction", 1.0)}


@dataclass(frozen=True)
class Verdict:
    """How an expectation came out: the ``word``, and the ``value`` in ``unit`` at ``frame`` that decided it."""

    word: Word
    expectation: Expectation
    value: float
    truth: float
    within: float
    unit: str
    frame: int


def judge(value: float, truth: float, within: float, error_bar: float = 0.0) -> Word:
    """Pass only if ``abs(value - truth) <= within``, so NaN never passes; *cannot say* where the truth's own ``error_bar`` is
    above a third of ``within`` (all four in one unit).

    >>> judge(1.02, 1.0, 0.05), judge(float("nan"), 1.0, 0.05), judge(1.02, 1.0, 0.05, error_bar=0.02)
    ('pass', 'fail', 'cannot say')
    """
    if error_bar > within / 3:
        return "cannot say"
    return "pass" if abs(value - truth) <= within else "fail"


def overall(words: Iterable[Word]) -> Word:
    """Fail if one fails, else cannot say if one cannot, else pass."""
    found = set(words)
    return "fail" if "fail" in found else "cannot say" if "cannot say" in found else "pass"


def verdict(scene: Scene, i: int, measures: Iterable[Measure], numbers: tuple[int, ...]) -> Verdict:
    """The verdict on ``scene.expect[i]`` from the measures of the run that it is of, over frame ``numbers``."""
    expectation = scene.expect[i]
    place = join(scene.place, f"expect[{i}]")
    by_name = {f"{measure.metric}.{measure.statistic}": measure for measure in measures}
    name = f"{expectation.metric}.{expectation.statistic}"
    if name not in by_name:
        raise InputError(f"{place}.statistic", f'"{name}"', f"one of {', '.join(sorted(by_name))}")
    found = by_name[name]
    truth, within = (_number(getattr(expectation, key), found.unit, f"{place}.{key}") for key in ("truth", "within"))
    if expectation.frame == "any":
        frames = range(len(numbers))
    elif expectation.frame in numbers:
        frames = range(at := numbers.index(expectation.frame), at + 1)
    else:
        raise InputError(f"{place}.frame", expectation.frame, f'"any" or a frame from {numbers[0]} to {numbers[-1]}')
    words = [judge(float(found.values[frame]), truth, within) for frame in frames]
    # The frame that decides: the first that fails, else the one furthest from the truth.
    decides = words.index("fail") if "fail" in words else max(range(len(words)), key=lambda k: abs(found.values[frames[k]] - truth))
    frame = frames[decides]
    return Verdict(overall(words), expectation, float(found.values[frame]), truth, within, found.unit, numbers[frame])


def _number(text: str, unit: str, place: str) -> float:
    kind, factor = _KINDS[unit]
    try:
        return quantity(text, kind) * factor
    except ValueError as error:
        raise InputError(place, f'"{text}"', str(error)) from error
