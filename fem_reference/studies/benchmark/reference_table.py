"""Timings of the reference: as JSON, and as a table for people."""

import os
from typing import Any

import numpy as np

from fem_reference.runs.key import versions
from fem_reference.studies.benchmark.checkout import Commit
from fem_reference.studies.benchmark.reference import BEFORE, NOW, Ratio, Timing

# Not in the table: one thread by design.
_UNSHOWN = ("threads",)
# Sizes, of which a ratio says nothing.
_SIZES = ("unknowns", "ranks")
_UNITS = {"peak_memory_mb": "peak memory [MB]", "seconds_wall": "wall [s]", "seconds_processor": "processor [s]"}


def facts(timings: list[Timing], against: Commit | None, left_out: dict[str, str]) -> dict[str, Any]:
    """All of it as JSON has it."""
    return {
        "against": None if against is None else {"asked": against.asked, "commit": against.digits},
        "versions": versions(),
        "cores": os.cpu_count(),
        "left_out": left_out,
        "bodies": [_facts(timing) for timing in timings],
    }


def _facts(timing: Timing) -> dict[str, Any]:
    ratios = {name: timing.ratio(name) for name in timing.names if name not in (*_SIZES, *_UNSHOWN)}
    return {
        "name": timing.name,
        "mesh": timing.taken[NOW][0].mesh,
        "sides": {
            side: [{"status": one.status, "message": one.message} | one.numbers for one in repeats]
            for side, repeats in timing.taken.items()
        },
        "ratios": {name: vars(ratio) for name, ratio in ratios.items() if ratio is not None},
        "difference_mm": timing.difference,
    }


def text(timings: list[Timing], against: Commit | None, left_out: dict[str, str]) -> str:
    """The same for people: a table for each body, of the medians over its repeats."""
    parts = ["\n".join(_lines(timing, against)) for timing in timings]
    parts += [f"{name}: left out, {why}" for name, why in left_out.items()]
    parts.append(
        "Times of wall and processor are of the whole solution; of its phases set_up, solve and stability contain the others."
    )
    return "\n\n".join(parts)


def _lines(timing: Timing, against: Commit | None) -> list[str]:
    called = {BEFORE: "" if against is None else against.short, NOW: NOW}
    repeats = len(timing.taken[NOW])
    names = [name for name in timing.names if name not in _UNSHOWN]
    labels = {name: _UNITS.get(name, _label(name)) for name in names}
    width = max(map(len, labels.values()))
    head = "".join(f"{called[side]:>12}" for side in timing.taken)
    beside = "" if against is None else "  before/now, median (minimum to maximum)"
    lines = [f"{timing.name}, repeats: {repeats}", f"  {'':{width}}{head}{beside}"]
    for name in names:
        columns = "".join(f"{_median(timing.values(side, name)):>12}" for side in timing.taken)
        ratio = None if name in _SIZES else timing.ratio(name)
        lines.append(f"  {labels[name]:{width}}{columns}{'' if ratio is None else f'  {_ratio(ratio)}'}")
    failed = {
        called[side]: one
        for side, taken in timing.taken.items()
        for one in reversed(taken)
        if one.status != "converged"
    }
    lines += [f"  {side}: {one.status}, {one.message}" for side, one in failed.items()]
    if timing.difference is not None:
        lines.append(f"  greatest difference of the final positions: {timing.difference:.2g} mm")
    return lines


def _label(name: str) -> str:
    """How the table calls a number.

    >>> _label("seconds_set_up"), _label("newton_iterations")
    ('set_up [s]', 'newton_iterations')
    """
    phase = name.removeprefix("seconds_")
    return name if phase == name else f"{phase} [s]"


def _median(values: list[float] | None) -> str:
    """The median of the repeats; a dash where there is no such number."""
    if values is None:
        return "-"
    middle = float(np.median(values))
    return f"{middle:.0f}" if middle.is_integer() else f"{middle:.2f}"


def _ratio(ratio: Ratio) -> str:
    return f"{ratio.median:.2f} ({ratio.minimum:.2f} to {ratio.maximum:.2f})"
