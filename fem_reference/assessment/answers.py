"""The settings that studies recommend for usual requests: an error limit, a frame rate, or the knee of error against time."""

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

from fem_reference.assessment.recommendation import Expected, chosen

ERRORS = (1.0, 5.0)  # the requested error limits, in the unit of the metric
RATE = 60.0  # the requested frame rate [frames per second]


@dataclass(frozen=True)
class Answer:
    """The answer to a request.

    ``limits``: the upper limits of the error and of the time [s], empty for the knee. ``best``: the best setting, None if no
    setting meets the limits. ``nearest``: if no setting meets the limits, the setting that exceeds them least. ``by_solver``: the
    best setting of each solver that has one.
    """

    limits: Mapping[str, float]
    best: Expected | None
    nearest: Expected | None
    by_solver: Mapping[str, Expected]


def answers(known: Sequence[Expected]) -> tuple[Answer, ...]:
    """The answers for each error limit, for the frame rate, and for the knee."""
    requests = [*({"error": error} for error in ERRORS), {"time": 1 / RATE}]
    names = dict.fromkeys(one.point.solver for one in known)
    of = {name: [one for one in known if one.point.solver == name] for name in names}
    found = [
        (limits, chosen(known, limits), {name: chosen(some, limits)[0] for name, some in of.items()})
        for limits in requests
    ]
    found.append(({}, (knee(known), None), {name: knee(some) for name, some in of.items()}))
    return tuple(
        Answer(limits, best, nearest, {name: one for name, one in by_solver.items() if one is not None})
        for limits, (best, nearest), by_solver in found
    )


def knee(known: Iterable[Expected]) -> Expected | None:
    """The setting at the knee of the front of error against time: on logarithmic axes, the setting farthest below the line that
    joins the two ends of the front (Das 1999, Structural Optimization 18, 107-115).

    None if the front has fewer than three points, or if no point lies below the line.
    """
    front = list[Expected]()
    for one in sorted(known, key=lambda one: (one.time, one.error)):
        if not front or one.error < front[-1].error:
            front.append(one)
    if len(front) < 3:
        return None
    first, last = front[0], front[-1]

    def below(one: Expected) -> float:
        along = math.log(one.time / first.time) / math.log(last.time / first.time)
        down = math.log(first.error / one.error) / math.log(first.error / last.error)
        return down - along

    best = max(front[1:-1], key=below)
    return best if below(best) > 0 else None
